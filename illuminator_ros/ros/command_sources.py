# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The sources of commands in ROS: parameters, names, services and values of each."""

from __future__ import annotations

from collections.abc import Callable
import functools
import math

from std_msgs.msg import String
from std_srvs.srv import Trigger

from .diagnostics import Value
from .node import Answer, Entity, RequestService
from .parameters import ParameterError, ParameterSpec, Values
from ..payload.command_sources import DEFAULT, source_name, SourceSettings

SOURCE = Entity(
    'source', String, "only with `sources`: the source that holds the device, `''` for none")
RELEASE = Entity('release', Trigger, 'the source gives the device back; the answer names the '
                 'next holder')
SOURCE_PARAMETERS = (
    ParameterSpec('sources', [],
                  'sources of commands, the highest first; empty = commands have no sources',
                  restricts=True),
    ParameterSpec('source_timeout', 0.0,
                  'silence after which a source loses the device; 0 = never',
                  's', 0.0, 3600.0, restricts=True, changeable=True),
)


def source_settings(values: Values) -> SourceSettings | None:
    """
    Return the sources that :data:`SOURCE_PARAMETERS` give, None if they give none.

    :raises ParameterError: if they are wrong.
    """
    names, timeout = values['sources'], values['source_timeout']
    if not names:
        if timeout:
            raise ParameterError('source_timeout: is given, but sources is empty')
        return None
    for name in names:
        try:
            source_name(name)
        except ValueError as error:
            raise ParameterError(f'sources: {error}') from None
        if names.count(name) > 1:
            raise ParameterError(f'sources: {name!r} is given twice')
    ranked = names if DEFAULT in names else [*names, DEFAULT]
    return SourceSettings(tuple(ranked), timeout or math.inf)


def prefixes(sources: SourceSettings | None) -> dict[str, str]:
    """Return for each source the prefix of the names of its topics and services."""
    return {DEFAULT: ''} | {
        name: f'{name}/' for name in (sources.names if sources else ()) if name != DEFAULT}


def release_services(
    sources: SourceSettings | None, release: Callable[[str, float, Answer], None],
) -> tuple[RequestService, ...]:
    """
    Return the service of each source that gives a device back.

    :param release: takes the source and the time, s.
    """
    def start(source: str, request: Trigger.Request, now: float, answer: Answer) -> None:
        release(source, now, answer)

    return tuple(
        RequestService(RELEASE.of(f'{source}/'), functools.partial(start, source))
        for source in (sources.names if sources else ()))


def holder_values(holder: str | None, since: float, now: float) -> dict[str, Value]:
    """
    Return the source that holds a device for /diagnostics.

    :param holder: '' if none does; None without sources.
    :param since: when the holder changed last, s.
    """
    if holder is None:
        return {}
    return {'holder': holder or 'none', 'held_s': now - since if holder else None}
