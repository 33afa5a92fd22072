# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Warnings on parameters that are given, and have no effect."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
import difflib
from pathlib import Path
import re
from typing import NamedTuple

from rclpy.node import Node
import yaml

from .parameters import ParameterError

# Parameters that each node of rclpy has.
_OF_RCLPY = frozenset({'use_sim_time', 'start_type_description_service'})
# Characters of a name that are compared with the names of parameters.
COMPARED = 100
# With this name misspelt, a node would use its default link.
_URL = 'connection_url'
# Patterns for wildcards in a name of a parameter file (rcl_yaml_param_parser).
_WILDCARDS = {'*': '/[^/]+', '**': '(/[^/]+)*'}


class _Section(NamedTuple):
    """
    Parameters that are given for the nodes whose name matches a pattern.

    :param place: of the section, for people.
    :param parts: of the pattern, which are between slashes.
    :param is_file: whether other processes may use it, too.
    """

    place: str
    parts: tuple[str, ...]
    names: Set[str]
    is_file: bool

    @property
    def pattern(self) -> str:
        return '/'.join(self.parts)

    def matches(self, node: str) -> bool:
        return re.fullmatch(''.join(
            _WILDCARDS.get(part, '/' + re.escape(part)) for part in self.parts), node) is not None


def did_you_mean(name: str, names: Iterable[str]) -> str:
    """Return a question that follows the refusal of an unknown name; '' if it resembles none."""
    return _suggestion(_closest(name, names, 0.75))


def _closest(name: str, names: Iterable[str], likeness: float) -> str:
    # The comparison with a long name takes long, and none of ours is long.
    found = difflib.get_close_matches(name[:COMPARED], [*names], 1, likeness)
    return found[0] if found else ''


def _suggestion(close: str) -> str:
    return f'; did you mean {close!r}?' if close else ''


def ignored_parameters(
    arguments: Sequence[str], nodes: Sequence[Node], restrictions: Set[str],
    of_further_node: Callable[[str], Set[str] | None] = lambda name: None,
) -> list[str]:
    """
    Return a warning for each given section that matches no node, and parameter without effect.

    A section with a wildcard that has no parameter of ours is meant for other nodes: only names
    that resemble one of ours count there. A file with another section that matches a node is for
    several processes, whose sections need no warning unless they restrict something.

    :param nodes: those that exist at the start.
    :param restrictions: names of parameters that must not be ignored.
    :param of_further_node: returns the parameters of a node that is made later, given its name
        without namespace; None if no node may have that name.
    :raises ParameterError: if a restriction is ignored that is not in a file for several
        processes, a connection URL is misspelt or given for a wrong one of our nodes, or a file
        cannot be read.
    """
    known = {node.get_fully_qualified_name(): frozenset(node.list_parameters([], 0).names)
             for node in nodes}
    namespace, ours = nodes[0].get_namespace().rstrip('/'), {node.get_name() for node in nodes}
    all_names = frozenset().union(*known.values())
    warnings: dict[str, None] = {}

    def declared_for(section: _Section) -> Set[str] | None:
        """Return the parameters of the nodes that a section matches, None if it matches none."""
        found = [names for node, names in known.items() if section.matches(node)]
        last = ''.join(section.parts[-1:])
        further = of_further_node(last)
        if further is not None and section.matches(f'{namespace}/{last}'):
            found.append(_OF_RCLPY | further)
        return frozenset().union(*found) if found else None

    def is_for_others(section: _Section, declared: Set[str]) -> bool:
        return (section.is_file and not _WILDCARDS.keys().isdisjoint(section.parts)
                and declared.isdisjoint(section.names - _OF_RCLPY))

    sections = [(section, declared_for(section)) for section in given_sections(arguments)]
    our_files = {section.place for section, declared in sections
                 if section.is_file and declared is not None
                 and not is_for_others(section, declared)}
    for section, declared in sections:
        if declared is None:
            lost = ', '.join(sorted(restrictions & section.names))
            where, here = f'{section.place} {section.pattern} matches no node', ', '.join(known)
            is_ours = section.place in our_files
            if lost and not is_ours:
                raise ParameterError(
                    f'{where}; the name here is {here}, where {lost} would have no effect')
            if lost or not is_ours:
                warnings[f'{where} and is ignored{lost and f", with its {lost}"}; the name here '
                         f'is {here}'] = None
            continue
        is_shared = is_for_others(section, declared)
        for name in sorted(section.names - declared):
            # A file may nest the node's name below ros__parameters instead of above it.
            head, _, rest = name.partition('.')
            is_nested = head in ours or of_further_node(head) is not None
            close = _closest(rest if is_nested else name, all_names, 0.9 if is_shared else 0.75)
            reason = 'is unknown' + _suggestion(close)
            if close == name:
                owners = (node for node, names in known.items() if name in names)
                reason = f'is given for {section.pattern}, but is a parameter of {next(owners)}'
            if close in restrictions or close == _URL:
                raise ParameterError(f'{name} {reason}')
            if close or not is_shared:
                warnings[f'parameter {name!r} is ignored: it {reason}'] = None
    return list(warnings)


def given_sections(arguments: Sequence[str]) -> Iterator[_Section]:
    """Return the parameters that arguments give, by section."""
    for option, value in zip(arguments, arguments[1:], strict=False):
        if option in ('-p', '--param'):
            node, colon, name = value.partition(':=')[0].rpartition(':')
            yield _Section(f'-p {value}: the name', (node if colon else '**',), {name}, False)
        elif option == '--params-file':
            # As rcl reads it: UTF-8 or UTF-16, several documents, and no types but its own.
            try:
                contents = list(yaml.load_all(Path(value).read_bytes(), yaml.BaseLoader))
            except (OSError, ValueError, yaml.YAMLError) as error:
                reason = ' '.join(str(error).split())
                raise ParameterError(f'file {value}: {reason}') from error
            for content in contents:
                for parts, parameters in _nodes(content):
                    yield _Section(f'{value}: the section', parts, set(_names(parameters)), True)


def _nodes(content: object) -> Iterator[tuple[tuple[str, ...], object]]:
    """Return the name of each node in a parameter file, in parts, and its parameters."""
    for key, below in content.items() if isinstance(content, Mapping) else ():
        if key == 'ros__parameters':
            yield (), below
        else:
            parts = tuple(part for part in str(key).split('/') if part)
            yield from (((*parts, *rest), parameters) for rest, parameters in _nodes(below))


def _names(parameters: object, prefix: str = '') -> Iterator[str]:
    """Return the names of parameters, which may be nested."""
    for key, below in parameters.items() if isinstance(parameters, Mapping) else ():
        if isinstance(below, Mapping):
            yield from _names(below, f'{prefix}{key}.')
        else:
            yield f'{prefix}{key}'
