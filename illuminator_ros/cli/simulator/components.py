# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The components to simulate, from the command line and a YAML file."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
import contextlib
from dataclasses import dataclass, field
from typing import Any

from ..options import address
from ...mavlink.messages import Address
from ...simulation.settings import Setting, SettingValues
from ...simulation.simulated import SimulatedDevice, SimulatedType

MAX_COMPONENTS = 200

Type = SimulatedType[SimulatedDevice]
Types = Sequence[Type]


class SettingError(ValueError):
    """A setting that does not exist or has a wrong value; the message names it."""


@contextlib.contextmanager
def _place(place: str) -> Iterator[None]:
    """Begin the message of a ValueError with the place of the wrong value."""
    try:
        yield
    except ValueError as error:
        raise SettingError(f'{place}: {error}') from error


@dataclass(frozen=True)
class Listed:
    """One component that the command line or a file lists."""

    kind: Type
    address: Address
    name: str = ''
    settings: SettingValues = field(default_factory=dict)


@dataclass(frozen=True)
class Scenario:
    """
    The content of a file.

    :param common: the settings of all components, by the noun of their type.
    :param listed: the components; of a type that has none, the command line selects them.
    """

    url: str = ''
    common: Mapping[str, SettingValues] = field(default_factory=dict)
    listed: Sequence[Listed] = ()


def load(path: str, types: Types) -> Scenario:
    """
    Read a YAML file.

    :raises SettingError: if it cannot be read, or a setting in it is wrong.
    """
    try:
        import yaml
    except ModuleNotFoundError as error:
        raise SettingError(
            f'{path}: YAML files need PyYAML: pip install pyyaml, or apt install python3-yaml'
        ) from error
    try:
        with open(path, encoding='utf-8') as file:
            return scenario(yaml.safe_load(file), path, types)
    except SettingError:
        raise
    except OSError as error:
        raise SettingError(f'{path}: {error.strerror}') from error
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        # For example, PyYAML raises a plain ValueError for 2026-02-30; a list can contain itself.
        raise SettingError(f'{path}: not YAML: {" ".join(str(error).split())}') from error


def scenario(content: object, path: str, types: Types) -> Scenario:
    """Return the content of a file, checked; SettingError if a setting in it is wrong."""
    if not isinstance(content, Mapping):
        raise SettingError(f'{path}: it has no keys such as {types[0].plural}')
    common = _read(_settings(content, ('url', *(one.plural for one in types)), path, types), types)
    return Scenario(str(content.get('url') or ''), common, [
        one for kind in types for one in _listed(content.get(kind.plural) or [], path, kind)])


def _listed(entries: object, path: str, kind: Type) -> Iterator[Listed]:
    if not isinstance(entries, list) or not all(isinstance(one, Mapping) for one in entries):
        raise SettingError(f'{path}: {kind.plural} is not a list of {kind.plural}')
    for number, one in enumerate(entries, 1):
        place = f'{path}: {kind.noun} {number}'
        with _place(f'{place}: id'):
            where = address(str(one.get('id', '')))
        settings = _read(_settings(one, ('id', 'name'), place, [kind]), [kind])
        yield Listed(kind, where, str(one.get('name', '')), settings[kind.noun])


def _settings(
    content: Mapping[str, object], others: tuple[str, ...], path: str, types: Types,
) -> Iterator[tuple[str, str, str]]:
    """Return place, name and text of each setting; the key ``faults`` is a setting, too."""
    known = dict.fromkeys(name for one in types for name in one.all_settings)
    for key, value in content.items():
        name = 'fault' if key == 'faults' else key
        if name in known and key != 'fault':
            yield f'{path}: {key}', name, _as_text(value)
        elif key not in others:
            raise SettingError(f'{path}: no setting {key!r}; there are '
                               + ', '.join([*others, *known]))


def _read(settings: Iterable[tuple[str, str, str]], types: Types) -> Mapping[str, SettingValues]:
    """
    Return the values of settings for each type that accepts them, by its noun.

    :param settings: place, name and text of each.
    :raises SettingError: if no type accepts one: profiles and faults differ between types.
    """
    result: dict[str, dict[str, object]] = {one.noun: {} for one in types}
    for place, name, text in settings:
        refusals = []
        having = [one for one in types if name in one.all_settings]
        for one in having:
            try:
                result[one.noun][name] = one.all_settings[name].read(text)
            except ValueError as error:
                refusals.append(error)
        if len(refusals) == len(having):
            raise SettingError(f'{place}: {refusals[0]}')
    return result


def _as_text(value: object) -> str:
    if isinstance(value, Mapping):
        return ','.join(str(key) if one is True or one is None else f'{key}={one}'
                        for key, one in value.items())
    if isinstance(value, list | tuple):
        return ','.join(map(_as_text, value))
    return '' if value is None else str(value)


def components(
    options: argparse.Namespace, file: Scenario, types: Types,
) -> list[SimulatedDevice]:
    """
    Return the devices of the components that command line and file describe.

    :raises SettingError: if they contradict each other, or an option is wrong.
    """
    given = _read((
        (f'argument {_option(name)}', name, text) for name in dict.fromkeys(
            name for one in types for name in one.all_settings)
        if name != 'fault' and (text := getattr(options, name)) is not None), types)
    listed = [one for kind in types for one in _of_type(options, file, kind, given[kind.noun])]
    if len(listed) > MAX_COMPONENTS:
        raise SettingError(f'{len(listed)} {types[0].plural} are more than {MAX_COMPONENTS}')
    addresses = Counter(str(one.address) for one in listed)
    if twice := [where for where, count in sorted(addresses.items()) if count > 1]:
        raise SettingError(f'two {types[0].plural} have the address {", ".join(twice)}')
    faults = _faults(options.fault or (), listed, types[0].noun)
    kinds = Counter(one.kind.noun for one in listed)
    result = []
    for one in listed:
        noun, known = one.kind.noun, one.kind.all_settings
        settings = _merged(known, file.common.get(noun, {}), one.settings, given[noun],
                           {'fault': faults[one.address]})
        if kinds[noun] > 1:
            # The texts that a component shares with others become distinct.
            settings = {name: f'{value}-{one.address.component}'
                        if known[name].distinct and name not in one.settings else value
                        for name, value in settings.items()}
        with _place(f'{noun} {one.address}'):
            result.append(one.kind.make(settings, one.address, one.name))
    return result


def _option(name: str) -> str:
    return f'--{name.replace("_", "-")}'


def _of_type(
    options: argparse.Namespace, file: Scenario, kind: Type, given: SettingValues,
) -> Sequence[Listed]:
    named = getattr(options, kind.noun)
    listed = ([_named(kind, text) for text in named] if named else
              [one for one in file.listed if one.kind is kind])
    counted = [_option(name) for name in ('count', 'system_id', 'component_id')
               if getattr(options, name) is not None]
    if listed and counted:
        raise SettingError(f'{counted[0]} is for {kind.plural} that neither --{kind.noun} nor a '
                           'file lists')
    if listed:
        return listed
    default = kind.address({**file.common.get(kind.noun, {}), **given})
    system = options.system_id or default.system
    first = default.component if options.component_id is None else options.component_id
    last = first + (options.count or 1) - 1
    if last > 255:
        raise SettingError(f'--count {options.count} from component id {first} reaches {last}; '
                           'component ids end at 255')
    return [Listed(kind, Address(system, component)) for component in range(first, last + 1)]


def _named(kind: Type, text: str) -> Listed:
    where, _, name = text.partition('=')
    with _place(f'--{kind.noun} {text}'):
        return Listed(kind, address(where), name)


def _faults(
    texts: Sequence[str], listed: Sequence[Listed], noun: str,
) -> dict[Address, tuple[str, ...]]:
    """Return the faults of each component; ``NAME:`` in front of a fault selects one."""
    result: dict[Address, tuple[str, ...]] = {one.address: () for one in listed}
    for text in texts:
        selected, colon, names = text.rpartition(':')
        found = [one for one in listed
                 if not colon or selected in (str(one.address), one.name)]
        if not found:
            hint = (f'; commas separate the faults of one {noun}: repeat --fault for another one'
                    if ',' in selected else '')
            raise SettingError(f'--fault {text}: there is no {noun} {selected!r}{hint}')
        kinds = list({one.kind.noun: one.kind for one in found}.values())
        for name in names.split(','):
            read = _read([('--fault', 'fault', name)], kinds)
            for one in found:
                result[one.address] += read[one.kind.noun].get('fault', ())
    return result


def _merged(settings: Mapping[str, Setting], *layers: SettingValues) -> SettingValues:
    """Return the values of several layers; later layers take precedence."""
    result: dict[str, Any] = {}
    for layer in layers:
        for name, value in layer.items():
            if settings[name].adds and name in result:
                before = result[name]
                value = {**before, **value} if isinstance(value, dict) else before + value
            result[name] = value
    return result
