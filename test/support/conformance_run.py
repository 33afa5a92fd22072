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

"""Runs of the conformance suite against simulated lights, on a virtual clock."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from illuminator_ros.illuminator.checks.requirements import CHECKS
from illuminator_ros.illuminator.messages import STATUS_ID
from illuminator_ros.illuminator.model import Configuration
from illuminator_ros.illuminator.simulated import SimulatedIlluminator
from illuminator_ros.illuminator.simulated_properties import FAULTS, IlluminatorProperties
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address, CommandLong
from illuminator_ros.payload.simulated import Effect, SimulatedComponents
from support.checks_run import ChecksRun
from support.virtual_link import START

# s for which the lights have been on when a run begins.
UPTIME = 100.0


class Run(ChecksRun):
    """
    The run for a light.

    :param lights: the first is checked; default properties if there is none.
    :param faults: of the first light.
    :param seed: of their random faults.
    :param options: of :class:`ChecksRun`; ``heat``, s at 100 %.
    """

    def __init__(
        self, *lights: IlluminatorProperties, faults: tuple[str, ...] = (), seed: int = 0,
        **options: Any,
    ) -> None:
        first, *others = lights or [IlluminatorProperties()]
        for fault in faults:
            first = replace(first, behaviour=FAULTS.add(first.behaviour, fault))
        self.lights = SimulatedComponents(
            (SimulatedIlluminator(replace(one, seed=seed)) for one in (first, *others)),
            START - UPTIME)
        self.light = self.lights.components[0]
        super().__init__(CHECKS, self.lights, **options)

    @property
    def lamp(self) -> SimulatedIlluminator:
        """Return the state of the light."""
        return self.light.device

    def press(self, **changes: Any) -> None:
        """Switch or configure the light by hand."""
        now = self.link.now
        self.light.apply(self.light.device.press(now, **changes), now)

    def set_interval(self, seconds: float) -> None:
        """Set the interval of the light's status, as another sender; -1 stops the stream."""
        self.light.receive(Address(255, 1), CommandLong(
            *self.light.address, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 0, STATUS_ID,
            seconds if seconds < 0 else 1e6 * seconds, 0, 0, 0, 0, 0), self.link.now)

    def fault(self, *names: str) -> None:
        """Switch faults on."""
        for name in names:
            self.light.behave(FAULTS.add(self.light.behaviour, name), self.link.now)

    def interrupt(self) -> None:
        """Interrupt the run."""
        self.session.runner.interrupt(self.link.now)

    def watch(self) -> list[Configuration]:
        """Return a list that gets the configuration after each change that leaves it on."""
        seen: list[Configuration] = []
        apply = self.light.apply

        def noted(effect: Effect, now: float) -> None:
            apply(effect, now)
            if self.lamp.enabled:
                seen.append(self.lamp.configuration)
        self.light.apply = noted  # type: ignore[method-assign]
        return seen
