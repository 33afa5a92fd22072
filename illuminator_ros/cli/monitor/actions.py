# Copyright 2026 The illuminator_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
What a key asks of a light: pure functions from what is known of it to a request.

They are called when the request is made and not when the key is pressed: what several keys have
asked for before counts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

from .model import Light

# %; of the keys for a lot and for a little.
STEP = 10.0
FINE_STEP = 1.0
# s and %: a strobe for a light that has none.
STROBE_PERIOD = 1.0
STROBE_DUTY_CYCLE = 50.0


class Service(Enum):
    """The service of a light that a request goes to."""

    ENABLE = 'enable'
    REFRESH = 'refresh'
    SET = 'set_parameters_atomically'


@dataclass(frozen=True)
class Request:
    """
    What is asked of a light.

    :param text: what it is, for people.
    :param value: for ENABLE a bool, for SET the parameters by their names.
    """

    service: Service
    text: str
    value: Any = None


# None is that nothing can be asked, for want of knowledge.
Ask = Callable[[Light], Request | None]


def switch_off(light: Light) -> Request:
    """Switch a light off."""
    return switch(light, False)


def switch(light: Light, on: bool | None = None) -> Request:
    """Switch a light on or off; None is the other way round, on if that is not known."""
    wanted = not light.wanted.get('enabled', light.value('enabled')) if on is None else on
    return Request(Service.ENABLE, 'on' if wanted else 'off', wanted)


def dim(light: Light, step: float) -> Request | None:
    """
    Make a light brighter by a step, %, or darker; None if that cannot be done.

    It starts from what is being asked for, else from what is agreed, else from what is shown.
    """
    known = (light.wanted.get('brightness'), light.setpoint, light.value('brightness'))
    start = next((value for value in known if value is not None), None)
    if start is None:
        return None
    target = min(max(round(start + step, 1), 0.0), 100.0)
    return Request(Service.SET, f'brightness {target:g} %', {'brightness': target})


def strobe(light: Light) -> Request:
    """Have a light strobe, or shine steadily if it strobes; as it did before, if it ever did."""
    if light.wanted.get('strobe_period', light.value('strobe_period')):
        return Request(Service.SET, 'no strobe', {'strobe_period': 0.0})
    duty = light.value('strobe_duty_cycle') or STROBE_DUTY_CYCLE
    return Request(Service.SET, f'strobe {STROBE_PERIOD:g} s, {duty:g} %',
                   {'strobe_period': STROBE_PERIOD, 'strobe_duty_cycle': round(duty, 3)})


def refresh(light: Light) -> Request:
    """Ask a light for its identity and status again."""
    return Request(Service.REFRESH, 'refresh')
