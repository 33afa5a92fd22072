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
What can be set of a simulated light.

One table for the command line and the YAML file: a setting ``status_interval`` of the file is the
option ``--status-interval``, and both are read by the same function.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from ..options import integer, number
from ... import __version__
from ...illuminator.faults import FAULTS
from ...illuminator.identity import Identity
from ...illuminator.model import InvalidValue, Limits, Mode, MODES
from ...illuminator.simulated_properties import (
    Extension,
    IlluminatorBehaviour,
    IlluminatorProperties,
    Profile,
    PROFILES,
)
from ...illuminator.thermal import ThermalProperties
from ...mavlink.messages import Address
from ...payload.faults import FaultError

THERMAL = {field.name: field.default for field in fields(ThermalProperties)}


class SettingError(ValueError):
    """A setting that does not exist or cannot be; the message names it."""


def _text(text: str) -> str:
    if len(text.encode()) > 200:
        raise ValueError(f'{text[:20]!r}... is too long')
    return text


def _profile(text: str) -> str:
    if text not in PROFILES:
        raise ValueError(f'{text!r} is none of {", ".join(PROFILES)}')
    return text


def _modes(text: str) -> tuple[Mode, ...]:
    names = [name.strip() for name in text.split(',') if name.strip()]
    for name in names:
        if name not in MODES:
            raise ValueError(f'{name!r} is none of {", ".join(MODES)}')
    if not names:
        raise ValueError('there has to be one')
    return tuple(MODES[name] for name in names)


def _bitmask(text: str) -> int:
    value = int(text, 0)
    if not 0 <= value <= 255:
        raise ValueError(f'{text} is outside 0 to 255')
    return value


def _thermal(text: str) -> dict[str, float]:
    values = {}
    for part in text.split(','):
        name, equals, value = part.strip().partition('=')
        if name not in THERMAL or not equals:
            raise ValueError(f'{part!r} is none of '
                             + ', '.join(f'{known}=VALUE' for known in THERMAL))
        values[name] = number(-1000, 100_000)(value)
    return values


def _faults(text: str) -> tuple[str, ...]:
    names = tuple(part.strip() for part in text.split(',') if part.strip())
    for name in names:
        FAULTS.add(IlluminatorBehaviour(), name)
    return names


@dataclass(frozen=True)
class Setting:
    """
    One thing that can be set.

    :param read: makes a value from text; ValueError if it cannot be one.
    :param adds: whether a further one adds to the one before, else it replaces it.
    """

    metavar: str
    help: str  # noqa: A003
    read: Callable[[str], Any]
    adds: bool = False


_byte = integer(0, 255)

SETTINGS: dict[str, Setting] = {
    'profile': Setting('NAME', 'a kind of light, see below (default: default)', _profile),
    'vendor': Setting('TEXT', 'vendor_name', _text),
    'model': Setting('TEXT', 'model_name', _text),
    'software_version': Setting('TEXT', 'software_version', _text),
    'hardware_version': Setting('TEXT', 'hardware_version', _text),
    'serial_number': Setting('TEXT', 'serial_number; with the component id behind it where '
                             'there are several lights', _text),
    'status_interval': Setting('S', 'time between statuses; 0 sends them only on request '
                               '(default: 1)', number(0, 3600)),
    'min_strobe_period': Setting('S', 'shortest strobe period (default: 0.05)',
                                 number(0, 3600)),
    'max_strobe_period': Setting('S', 'longest strobe period (default: 10)', number(0, 3600)),
    'modes': Setting('MODE,...', f'modes that it can be configured to (default: '
                     f'{",".join(MODES)})', _modes),
    'mode_bitmask': Setting('N', 'mode_bitmask, where it is not to follow from the modes',
                            _bitmask),
    'ambient': Setting('DEG_C', 'ambient temperature (default: 25)', number(-60, 150)),
    'thermal': Setting('NAME=VALUE,...', 'what heats and cools it, see below', _thermal, True),
    'time_scale': Setting('X', 'how much faster than real it gets hot (default: 1)',
                          number(0.001, 10000)),
    'zoom_level': Setting('N', 'zoom_level, which makes the status one of 38 bytes', _byte),
    'color_mode': Setting('N', 'color_mode, likewise', _byte),
    'gimbal_device_id': Setting('N', 'gimbal_device_id, likewise', _byte),
    'fault': Setting('[LIGHT:]NAME[=VALUE]', 'something that goes wrong, see below', _faults,
                     True),
    'seed': Setting('N', 'seed of what happens by chance (default: 0)', integer(0, 1 << 32)),
}


def read(name: str, value: Any, place: str) -> Any:
    """
    Return the value of a setting.

    :param value: text or, from a file, a number, a list or a mapping.
    :param place: where it was found, for the message.
    :raises SettingError: if it cannot be.
    """
    try:
        return SETTINGS[name].read(_as_text(value))
    except FaultError as error:
        raise SettingError(f'{place}: {error}') from error
    except (ValueError, argparse.ArgumentTypeError) as error:
        reason = str(error)
        if 'could not convert' in reason or 'invalid literal' in reason:
            reason = f'{value!r} is not a number'
        raise SettingError(f'{place}: {reason}') from error


def _as_text(value: Any) -> str:
    if isinstance(value, Mapping):
        return ','.join(str(key) if one is True or one is None else f'{key}={one}'
                        for key, one in value.items())
    if isinstance(value, list | tuple):
        return ','.join(map(_as_text, value))
    return '' if value is None else str(value)


def merged(*layers: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings in which later layers count more."""
    result: dict[str, Any] = {}
    for layer in layers:
        for name, value in layer.items():
            if SETTINGS[name].adds and name in result:
                before = result[name]
                value = {**before, **value} if isinstance(value, dict) else before + value
            result[name] = value
    return result


def profile_of(settings: Mapping[str, Any]) -> Profile:
    """Return the profile that settings choose."""
    return PROFILES[settings.get('profile', 'default')]


def properties(
    settings: Mapping[str, Any], address: Address, *, name: str = '', several: bool = False,
) -> IlluminatorProperties:
    """
    Return the light that settings describe.

    :raises SettingError: if they do not go together.
    """
    profile = profile_of(settings)
    limits = Limits(settings.get('min_strobe_period', profile.limits.min_strobe_period),
                    settings.get('max_strobe_period', profile.limits.max_strobe_period))
    modes = settings.get('modes', profile.modes)
    bitmask = 0
    for mode in modes:
        bitmask |= 1 << mode if profile.shifted_bitmask else mode
    try:
        if limits.min_strobe_period > limits.max_strobe_period:
            raise InvalidValue('min_strobe_period is above max_strobe_period')
        thermal = ThermalProperties(**{
            **({'ambient': settings['ambient']} if 'ambient' in settings else {}),
            **settings.get('thermal', {})})
    except ValueError as error:
        raise SettingError(f'light {address}: {error}') from error
    return IlluminatorProperties(
        address=address, name=name, identity=_identity(settings, profile, address, several),
        limits=limits, modes=modes, mode_bitmask=settings.get('mode_bitmask', bitmask),
        status_interval=settings.get('status_interval', 1.0), thermal=thermal,
        time_scale=settings.get('time_scale', 1.0), behaviour=_behaviour(settings, profile),
        normal=_normal(settings, profile), seed=settings.get('seed', 0))


def _normal(settings: Mapping[str, Any], profile: Profile) -> IlluminatorBehaviour:
    behaviour = profile.behaviour
    given = {name: settings[name] for name in Extension._fields if name in settings}
    if given:
        extension = (behaviour.extension or Extension())._replace(**given)
        behaviour = replace(behaviour, extension=extension)
    return behaviour


def _behaviour(settings: Mapping[str, Any], profile: Profile) -> IlluminatorBehaviour:
    behaviour = _normal(settings, profile)
    for fault in settings.get('fault', ()):
        behaviour = FAULTS.add(behaviour, fault)
    return behaviour


def _identity(
    settings: Mapping[str, Any], profile: Profile, address: Address, several: bool,
) -> Identity:
    usual = profile.identity or Identity(
        'illuminator_ros', 'simulator', __version__, '1.0.0',
        f'SIM-{address.system}-{address.component}')
    serial = settings.get('serial_number', usual.serial_number)
    if several and 'serial_number' in settings:
        serial += f'-{address.component}'
    return Identity(
        settings.get('vendor', usual.vendor), settings.get('model', usual.model),
        settings.get('software_version', usual.software_version),
        settings.get('hardware_version', usual.hardware_version), serial)
