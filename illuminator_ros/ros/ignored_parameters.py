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

    @property
    def has_wildcard(self) -> bool:
        return not _WILDCARDS.keys().isdisjoint(self.parts)

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
    that resemble one of ours count there.

    :param nodes: those that exist at the start.
    :param restrictions: names of parameters that must not be ignored.
    :param of_further_node: returns the parameters of a node that is made later, given its name
        without namespace; None if no node may have that name.
    :raises ParameterError: if a restriction is ignored, a connection URL is misspelt or given for
        a wrong one of our nodes, or a file cannot be read. A section may be for the node of
        another process with the same file: if it has restrictions, a section for one of our nodes
        by its name must have them, too; its connection URL is that of another link.
    """
    known = {node.get_fully_qualified_name(): frozenset(node.list_parameters([], 0).names)
             for node in nodes}
    namespace, ours = nodes[0].get_namespace().rstrip('/'), {node.get_name() for node in nodes}
    all_names = frozenset().union(*known.values())
    warnings: dict[str, None] = {}
    sections = [*_sections(arguments)]
    restricted_here = frozenset().union(*(
        section.names for section in sections
        if not section.has_wildcard and any(map(section.matches, known))))
    for section in sections:
        found = [names for node, names in known.items() if section.matches(node)]
        last = ''.join(section.parts[-1:])
        further = of_further_node(last)
        if further is not None and section.matches(f'{namespace}/{last}'):
            found.append(_OF_RCLPY | further)
        if not found:
            here = f'the name here is {", ".join(known)}'
            lost = restrictions & section.names - (
                restricted_here if section.is_file else frozenset())
            if lost:
                raise ParameterError(
                    f'{section.place} {section.pattern} matches no node; {here}, where '
                    f'{", ".join(sorted(lost))} would have no effect')
            warnings[f'{section.place} {section.pattern} matches no node and is ignored; '
                     f'{here}'] = None
            continue
        declared = frozenset().union(*found)
        is_shared = (section.is_file and section.has_wildcard
                     and declared.isdisjoint(section.names - _OF_RCLPY))
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


def _sections(arguments: Sequence[str]) -> Iterator[_Section]:
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
