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

"""The settings of a simulated light, and its registration with the simulator."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, replace
from typing import Any

from .model import Limits, Mode, MODES
from .simulated import SimulatedIlluminator
from .simulated_properties import Extension, IlluminatorProperties, PROFILES
from .thermal import ThermalProperties
from ..mavlink.messages import Address
from ..payload.identity import Identity
from ..payload.simulated import SimulatedType
from ..payload.simulated_settings import integer, number, one_of, Setting, text, Values

THERMAL = {field.name: field.default for field in fields(ThermalProperties)}


def _modes(names: str) -> tuple[Mode, ...]:
    modes = tuple(MODES[one_of(MODES)(name.strip())] for name in names.split(',') if name.strip())
    if not modes:
        raise ValueError('at least one mode is needed')
    return modes


def _thermal(values: str) -> dict[str, float]:
    result = {}
    for part in values.split(','):
        name, equals, value = part.strip().partition('=')
        if name not in THERMAL or not equals:
            raise ValueError(f'{part!r} is not one of '
                             + ', '.join(f'{known}=VALUE' for known in THERMAL))
        result[name] = number(-1000, 100_000)(value)
    return result


_byte = integer(0, 255)

SETTINGS: dict[str, Setting] = {
    'profile': Setting('NAME', 'a kind of light, see below (default: default)', one_of(PROFILES)),
    'vendor': Setting('TEXT', 'vendor_name', text),
    'model': Setting('TEXT', 'model_name', text),
    'software_version': Setting('TEXT', 'software_version', text),
    'hardware_version': Setting('TEXT', 'hardware_version', text),
    'serial_number': Setting('TEXT', 'serial_number; several lights append their component id',
                             text),
    'status_interval': Setting('S', 'time between statuses; 0 sends them only on request '
                               '(default: 1)', number(0, 3600)),
    'min_strobe_period': Setting('S', 'shortest strobe period (default: 0.05)',
                                 number(0, 3600)),
    'max_strobe_period': Setting('S', 'longest strobe period (default: 10)', number(0, 3600)),
    'modes': Setting('MODE,...', 'modes that it can be configured to (default: '
                     f'{",".join(MODES)})', _modes),
    'mode_bitmask': Setting('N', 'mode_bitmask, if it does not follow from the modes', _byte),
    'ambient': Setting('DEG_C', 'ambient temperature (default: 25)', number(-60, 150)),
    'thermal': Setting('NAME=VALUE,...', 'thermal model, see below', _thermal, True),
    'time_scale': Setting('X', 'factor by which it heats faster than real time (default: 1)',
                          number(0.001, 10000)),
    'zoom_level': Setting('N', 'zoom_level, which makes the status one of 38 bytes', _byte),
    'color_mode': Setting('N', 'color_mode, likewise', _byte),
    'gimbal_device_id': Setting('N', 'gimbal_device_id, likewise', _byte),
}


def _profile(settings: Values) -> IlluminatorProperties:
    return PROFILES[settings.get('profile', 'default')].properties


def properties(
    settings: Values, address: Address, several: bool = False,
) -> IlluminatorProperties:
    """
    Return the light that settings describe.

    :param several: whether its serial number must differ from those of other lights.
    :raises ValueError: if they contradict each other.
    """
    def given(names: Iterable[str]) -> dict[str, Any]:
        return {name: settings[name] for name in names if name in settings}

    profile = _profile(settings)
    limits = replace(profile.limits, **given(field.name for field in fields(Limits)))
    if limits.min_strobe_period > limits.max_strobe_period:
        raise ValueError('min_strobe_period is above max_strobe_period')
    behaviour = profile.behaviour
    if extension := given(Extension._fields):
        behaviour = replace(
            behaviour, extension=(behaviour.extension or Extension())._replace(**extension))
    identity = profile.identity
    if profile.identity == IlluminatorProperties.identity:
        identity = replace(identity, serial_number=f'SIM-{address.system}-{address.component}')
    identity = replace(identity, **given(field.name for field in fields(Identity)))
    if several and 'serial_number' in settings:
        identity = replace(
            identity, serial_number=f'{identity.serial_number}-{address.component}')
    return replace(
        profile, address=address, identity=identity, limits=limits, behaviour=behaviour,
        thermal=ThermalProperties(**{**given(['ambient']), **settings.get('thermal', {})}),
        **given(['modes', 'mode_bitmask', 'status_interval', 'time_scale']))


SIMULATED = SimulatedType(
    'light', 'lights', SimulatedIlluminator,
    make=lambda *settings: SimulatedIlluminator(properties(*settings)),
    address=lambda settings: _profile(settings).address,
    settings=SETTINGS, mavlink_version=2,
    examples=(
        'simulator', 'simulator udpin://127.0.0.1:14550 --count 3',
        'simulator --light 1/243=bow --light 1/250=stern --fault stern:drop=0.2',
        'simulator --ambient 60 --time-scale 60      gets hot in seconds',
        'simulator --file lights.yaml                the same settings, for each light'),
    profiles={name: profile.description for name, profile in PROFILES.items()},
    notes='thermal, with defaults (degC, K and s; throttle_to is a share of the brightness):\n  '
    + ', '.join(f'{name}={value:g}' for name, value in THERMAL.items()))
