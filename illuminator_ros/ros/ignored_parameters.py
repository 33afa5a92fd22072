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

"""Warnings on parameters that are given, and have no effect."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence, Set
import difflib
from pathlib import Path
import re

from rclpy.node import Node
import yaml

from .parameters import given_parameters, ParameterError

# Parameters that each node of rclpy has.
_OF_RCLPY = {'use_sim_time', 'start_type_description_service'}
# Patterns for wildcards in a name of a parameter file (rcl_yaml_param_parser).
_WILDCARDS = {'*': '/[^/]+', '**': '(/[^/]+)*'}


def unknown_parameters(
    nodes: Sequence[Node], arguments: Sequence[str], restrictions: Set[str],
) -> list[str]:
    """
    Return a warning for each parameter that is given and unknown.

    A section with a wildcard that has no parameter of ours is meant for other nodes: its
    parameters are unknown only if they resemble one of ours.

    :param nodes: those that exist at the start.
    :param restrictions: names of parameters that must not be missed because they are misspelt.
    :raises ParameterError: if one of them is misspelt.
    """
    known = {name for node in nodes for name in node.list_parameters([], 0).names}
    given = dict.fromkeys(name for node in nodes for name in given_parameters(node))
    others = {name.partition('.')[0] for _, section, values in _files(arguments)
              if not _WILDCARDS.keys().isdisjoint(section) and known.isdisjoint(values - _OF_RCLPY)
              for name in values}
    warnings = []
    for name in given:
        if name in known:
            continue
        # A file may nest the node's name below ros__parameters instead of above it.
        bare = name.removeprefix(f'{nodes[0].get_name()}.')
        close = difflib.get_close_matches(bare, known, 1, 0.75)
        is_ours = name.partition('.')[0] not in {*others, 'qos_overrides'}
        # Another node may have a parameter with a similar name.
        if not restrictions.isdisjoint(
                close if is_ours else difflib.get_close_matches(bare, known, 1, 0.9)):
            raise ParameterError(f'{name} is unknown; did you mean {close[0]!r}?')
        if is_ours or close:
            warnings.append(_unknown(name, close))
    return warnings


def ignored_parameters(node: Node, first: Node) -> list[str]:
    """Return a warning for each parameter that is given for a further node and has no effect."""
    return [
        *overruled_parameters(node, first),
        *(_unknown(name, difflib.get_close_matches(
            name, node.list_parameters([], 0).names, 1, 0.75))
          for name in given_parameters(node)
          if not any(one.has_parameter(name) for one in (node, first))
          and name not in given_parameters(first))]


def overruled_parameters(
    node: Node, first: Node, restrictions: Set[str] = frozenset(),
) -> list[str]:
    """
    Return a warning for each parameter of the first node that is given otherwise for another.

    :param restrictions: names of parameters that must not be ignored.
    :raises ParameterError: if one of them is given otherwise.
    """
    warnings = []
    for name, parameter in given_parameters(node).items():
        if node.has_parameter(name) or not first.has_parameter(name):
            continue
        applied = given_parameters(first).get(name) or first.get_parameter_or(name)
        # None is an empty list.
        if parameter.value in (None, applied.value):
            continue
        text = f'the value of {first.get_fully_qualified_name()} applies'
        if name in restrictions:
            raise ParameterError(
                f'{name}: is given for {node.get_fully_qualified_name()}, but {text}')
        warnings.append(f'parameter {name!r} is ignored here: {text}')
    return warnings


def _unknown(name: str, close: Sequence[str]) -> str:
    hint = f'; did you mean {close[0]!r}?' if close else ''
    return f'parameter {name!r} is unknown and ignored{hint}'


def ignored_sections(
    arguments: Sequence[str], names: Sequence[str], may_name: Callable[[str], bool],
) -> list[str]:
    """
    Return a warning for each section of a parameter file, or prefix, that matches no node.

    The prefix of ``-p spot:brightness:=40`` matches only a node ``/spot``, without namespace.

    :param names: fully qualified, of the nodes that exist.
    :param may_name: whether a node that is made later may have a name, without namespace.
    """
    namespace = names[0].rpartition('/')[0]
    warnings = []
    sections = [(f'{path}: the section', section) for path, section, _ in _files(arguments)]
    prefixes = [(f'-p {rule}: the name', (prefix,)) for rule, prefix in _prefixes(arguments)]
    for place, section in [*sections, *prefixes]:
        *_, last = section
        later = [f'{namespace}/{last}'] if may_name(last) else []
        pattern = ''.join(_WILDCARDS.get(part, '/' + re.escape(part)) for part in section)
        if not any(re.fullmatch(pattern, name) for name in (*names, *later)):
            warnings.append(f'{place} {"/".join(section)} matches no node and is ignored; the '
                            f'name here is {", ".join(names)}')
    return warnings


def _prefixes(arguments: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Return rule and node of each parameter that the command line gives for one node."""
    for option, rule in zip(arguments, arguments[1:], strict=False):
        node, colon, _ = rule.partition(':=')[0].partition(':')
        if option in ('-p', '--param') and colon:
            yield rule, node


def _files(arguments: Sequence[str]) -> Iterator[tuple[str, tuple[str, ...], Set[str]]]:
    """
    Return path, name in parts and parameters of each section of the parameter files.

    :raises ParameterError: if a file cannot be read.
    """
    for option, path in zip(arguments, arguments[1:], strict=False):
        if option == '--params-file':
            # As rcl reads it: UTF-8 or UTF-16, several documents, and no types but its own.
            try:
                contents = list(yaml.load_all(Path(path).read_bytes(), yaml.BaseLoader))
            except (OSError, ValueError, yaml.YAMLError) as error:
                reason = ' '.join(str(error).split())
                raise ParameterError(f'file {path}: {reason}') from error
            for content in contents:
                yield from ((path, *section) for section in _sections(content))


def _sections(content: object) -> Iterator[tuple[tuple[str, ...], Set[str]]]:
    for key, below in content.items() if isinstance(content, Mapping) else ():
        if key == 'ros__parameters':
            yield (), below.keys() if isinstance(below, Mapping) else set()
        else:
            parts = [part for part in str(key).split('/') if part]
            yield from (((*parts, *rest), values) for rest, values in _sections(below))
