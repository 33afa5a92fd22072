# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The sources of the commands to one device, by rank: which of them holds it."""

from __future__ import annotations

import math
import re
import reprlib
from typing import NamedTuple

from .arbitration import Arbiter, Cause, HolderChanged, Policy

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

    :raises ValueError: if topics cannot have it; ``cmd`` is the prefix of plain commands.
    """
    if not re.fullmatch(r'[A-Za-z](_?[A-Za-z0-9]){0,63}', text) or text == 'cmd':
        raise ValueError(f'{reprlib.repr(text)} is not a valid name of a source')
    return text


class SourceSettings(NamedTuple):
    """
    The sources of commands.

    :param names: the highest first; :data:`DEFAULT` is one of them.
    :param timeout: s of silence after which a source no longer holds a device; infinity for never.
    """

    names: tuple[str, ...]
    timeout: float = math.inf


class Sources(Arbiter[str]):
    """
    Decides which source holds a device. No I/O.

    A stream claims the device with its first message, a call when it has succeeded. While a call
    is under way, lower sources are refused as if its source held the device.

    :param settings: None if commands have no sources, so that none holds the device.
    :ivar are_ranked: whether one of them may hold the device.
    """

    def __init__(self, settings: SourceSettings | None) -> None:
        self.are_ranked = settings is not None
        ranked = settings or SourceSettings((DEFAULT,))
        super().__init__(
            Policy.PRIORITY, ranked.names.index, lease=ranked.timeout, remembers=True)
        # The sources of the calls under way, once for each call.
        self._calling: list[str] = []

    @property
    def commander(self) -> str | None:
        """Return the highest source that holds the device or has a call under way."""
        if not self.are_ranked:
            return None
        sources = [*self._calling, *([self.holder] if self.holder else [])]
        return min(sources, key=self._rank, default=None)

    def claim(self, source: str, now: float) -> HolderChanged[str] | None:
        """See :meth:`Arbiter.claim`."""
        return super().claim(source, now) if self.are_ranked else None

    def begin_call(self, source: str) -> None:
        """Note that a call of a source is under way."""
        self._calling.append(source)

    @property
    def are_calling(self) -> bool:
        """Whether a call is under way."""
        return bool(self._calling)

    def end_call(
        self, source: str, now: float, *, success: bool,
    ) -> HolderChanged[str] | None:
        """
        Note that a call has ended: it claims the device if it has succeeded.

        It does not if its source has released the device meanwhile.
        """
        if source not in self._calling:
            return None
        self._calling.remove(source)
        return self.claim(source, now) if success else None

    def release(self, source: str, now: float) -> HolderChanged[str] | None:
        """See :meth:`Arbiter.release`; the calls of the source claim the device no more."""
        was_calling = source in self._calling
        self._calling = [one for one in self._calling if one != source]
        change = super().release(source, now)
        if was_calling and self.holder is None:
            change = HolderChanged(source, None, Cause.RELEASE)
        return change

    def refusal(self, source: str) -> str:
        """Return why a source may not command the device, '' if it may."""
        commander = self.commander
        is_lower = commander is not None and self._rank(commander) < self._rank(source)
        return f'held by {commander}' if is_lower else ''

    def takes_over(self, source: str) -> bool:
        """Return whether a request of a source ends those of another one, which is not higher."""
        return self.are_ranked and self.commander != source and not self.refusal(source)

    @property
    def shown_holder(self) -> str | None:
        """Return the holder for snapshots: '' for none, None if commands have no sources."""
        return self.holder or '' if self.are_ranked else None


def describe(change: HolderChanged[str]) -> str:
    """Describe a change of the holder of a device and its cause, for people."""
    reason = _REASONS[change.cause].format(change.before) if change.before else ''
    return f'is held by {change.after or "no source"}{reason}'
