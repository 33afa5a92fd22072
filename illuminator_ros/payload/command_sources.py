# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The sources of the commands to one device, by rank: which of them holds it."""

from __future__ import annotations

import math
import re
import reprlib
from typing import NamedTuple

from .arbitration import Cause, HolderChanged
from ..mavlink.errors import InvalidValue

# The source of a request that names none.
DEFAULT = 'default'
# The reasons why a source no longer holds a device.
_REASONS = {
    Cause.CLAIM: ', which has taken it from {}',
    Cause.RELEASE: ': {} has released it',
    Cause.SILENCE: ': {} was silent for source_timeout',
}


def source_name(text: str) -> str:
    """
    Return the name of a source.

    :raises InvalidValue: if topics cannot have it; ``cmd`` is the prefix of plain commands.
    """
    if not re.fullmatch(r'[A-Za-z](_?[A-Za-z0-9]){0,63}', text) or text == 'cmd':
        raise InvalidValue(f'{reprlib.repr(text)} is not a valid name of a source')
    return text


class SourceSettings(NamedTuple):
    """
    The sources of commands.

    :param names: the highest first; :data:`DEFAULT` is one of them.
    :param timeout: s of silence after which a source no longer holds a device; infinity for never.
    """

    names: tuple[str, ...]
    timeout: float = math.inf


def describe(change: HolderChanged[str]) -> str:
    """Describe a change of the holder of a device and its cause, for people."""
    reason = _REASONS[change.cause].format(change.before) if change.before else ''
    return f'is held by {change.after or "no source"}{reason}'
