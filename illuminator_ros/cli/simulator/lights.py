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

"""Which lights are simulated: from the command line and a YAML file."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .settings import merged, profile_of, properties, read, SettingError, SETTINGS
from ..options import address
from ...illuminator.simulated_properties import IlluminatorProperties
from ...mavlink.messages import Address

MAX_LIGHTS = 200
# The keys of a file beside the settings, and those of one of its lights.
FILE_KEYS = ('url', 'lights')
LIGHT_KEYS = ('id', 'name')


@dataclass
class Scenario:
    """
    What a file asks for.

    :param common: settings of all lights.
    :param lights: address, name and settings of each; none leaves it to the command line.
    """

    url: str = ''
    common: dict[str, Any] = field(default_factory=dict)
    lights: list[tuple[Address, str, dict[str, Any]]] = field(default_factory=list)


def load(path: str) -> Scenario:
    """
    Read a YAML file.

    :raises SettingError: if it cannot be read, or says what cannot be.
    """
    try:
        import yaml
    except ModuleNotFoundError as error:
        raise SettingError(
            f'{path}: YAML files need PyYAML: pip install pyyaml, or apt install python3-yaml'
        ) from error
    try:
        content = yaml.safe_load(Path(path).read_text())
    except OSError as error:
        raise SettingError(f'{path}: {error.strerror}') from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise SettingError(f'{path}: no YAML: {" ".join(str(error).split())}') from error
    return scenario(content, path)


def scenario(content: Any, path: str) -> Scenario:
    """Return what the content of a file asks for."""
    if not isinstance(content, Mapping):
        raise SettingError(f'{path}: it has no keys such as lights')
    listed = content.get('lights') or []
    if not isinstance(listed, list) or not all(isinstance(one, Mapping) for one in listed):
        raise SettingError(f'{path}: lights is no list of lights')
    result = Scenario(str(content.get('url') or ''), _settings(content, FILE_KEYS, path))
    for number, one in enumerate(listed, 1):
        place = f'{path}: light {number}'
        try:
            source = address(str(one.get('id', '')))
        except ValueError as error:
            raise SettingError(f'{place}: id: {error}') from error
        result.lights.append(
            (source, str(one.get('name', '')), _settings(one, LIGHT_KEYS, place)))
    return result


def _settings(content: Mapping[Any, Any], others: tuple[str, ...], place: str) -> dict[str, Any]:
    known = {**{name: name for name in SETTINGS}, 'faults': 'fault'}
    result = {}
    for key, value in content.items():
        if key in others:
            continue
        if key not in known:
            raise SettingError(f'{place}: no setting {key!r}; there are '
                               + ', '.join([*others, *SETTINGS]))
        result[known[key]] = read(known[key], value, f'{place}: {key}')
    return result


def _given(options: argparse.Namespace) -> dict[str, Any]:
    """Return the settings that the command line gives to all lights."""
    return {name: value for name in SETTINGS if name != 'fault'
            and (value := getattr(options, name)) is not None}


def _named(text: str) -> tuple[Address, str]:
    where, _, name = text.partition('=')
    try:
        return address(where), name
    except ValueError as error:
        raise SettingError(f'--light {text}: {error}') from error


def lights(options: argparse.Namespace, file: Scenario) -> list[IlluminatorProperties]:
    """
    Return the lights that command line and file describe.

    :raises SettingError: if what they say does not go together.
    """
    given = _given(options)
    listed = [(*_named(text), dict[str, Any]()) for text in options.light or ()] or file.lights
    counted = [f'--{name.replace("_", "-")}' for name in ('count', 'system_id', 'component_id')
               if getattr(options, name) is not None]
    if listed and counted:
        raise SettingError(f'{counted[0]} is for lights that neither --light nor a file lists')
    if not listed:
        listed = _counted(options, merged(file.common, given))
    if len(listed) > MAX_LIGHTS:
        raise SettingError(f'{len(listed)} lights are more than {MAX_LIGHTS}')
    sources = [source for source, _, _ in listed]
    if twice := {str(one) for one in sources if sources.count(one) > 1}:
        raise SettingError(f'there are two lights {", ".join(sorted(twice))}')
    faults = _faults(options.fault or (), listed)
    return [
        properties(merged(file.common, own, given, {'fault': faults[source]}), source,
                   name=name, several=len(listed) > 1 and 'serial_number' not in own)
        for source, name, own in listed]


def _counted(
    options: argparse.Namespace, settings: Mapping[str, Any],
) -> list[tuple[Address, str, dict[str, Any]]]:
    profile = profile_of(settings)
    system = options.system_id or profile.address.system
    first = profile.address.component if options.component_id is None else options.component_id
    count = options.count or 1
    last = first + count - 1
    if last > 255:
        raise SettingError(f'--count {count} from component id {first} reaches {last}; '
                           'component ids end at 255')
    return [(Address(system, component), '', {}) for component in range(first, last + 1)]


def _faults(
    texts: Any, listed: list[tuple[Address, str, dict[str, Any]]],
) -> dict[Address, tuple[str, ...]]:
    """Return the faults of each light; ``LIGHT:`` in front of one gives it to that only."""
    result: dict[Address, tuple[str, ...]] = {source: () for source, _, _ in listed}
    for text in texts:
        selected, colon, fault = text.rpartition(':')
        found = [source for source, name, _ in listed
                 if not colon or selected in (str(source), name)]
        if not found:
            raise SettingError(f'--fault {text}: there is no light {selected!r}')
        for source in found:
            result[source] += read('fault', fault, '--fault')
    return result
