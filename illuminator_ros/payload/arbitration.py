# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Arbitration: which of several sources may command a device."""

from __future__ import annotations

from collections.abc import Callable, Container, Hashable
from dataclasses import dataclass
from enum import Enum
import math
from typing import Generic, TypeVar

K = TypeVar('K', bound=Hashable)


class Policy(Enum):
    """
    The condition on which a source takes a device from the source that holds it.

    ``hold``: never. ``priority``: when it ranks higher. ``takeover``: always. An overruling source
    takes it under each policy.
    """

    HOLD = 'hold'
    PRIORITY = 'priority'
    TAKEOVER = 'takeover'


class Cause(Enum):
    """The reason why the holder of a device has changed."""

    CLAIM = 'claim'
    RELEASE = 'release'
    SILENCE = 'silence'


@dataclass(frozen=True)
class HolderChanged(Generic[K]):
    """
    The holder of a device has changed.

    :param before: the source that held it, None if none did.
    :param after: the source that holds it now, None if none does.
    """

    before: K | None
    after: K | None
    cause: Cause


class Arbiter(Generic[K]):
    """
    Decides which source holds a device: at each time at most one. No I/O; times are s.

    :meth:`claim`, :meth:`release` and :meth:`poll` return the change of the holder, None if it
    has not changed.

    A source holds the device from its claim until it releases it, is silent for the lease, or
    loses it to another source as the policy says.

    :param rank: returns the rank of a source; the smallest number is the highest rank.
    :param lease: s of silence after which a claim ends, > 0; infinity for never.
    :param overruling: the sources that take the device under each policy.
    :param remembers: whether the claim of a source that does not hold the device is remembered.
        The highest of these gets the device when its holder's claim ends. Without this a source
        must claim again.
    :ivar holder: the source that holds the device, None if none does.
    :ivar since: when the holder changed last, s.
    """

    def __init__(
        self, policy: Policy, rank: Callable[[K], int] = lambda source: 0, *,
        lease: float = math.inf, overruling: Container[K] = (), remembers: bool = False,
    ) -> None:
        self.holder: K | None = None
        self.since = -math.inf
        self._policy = policy
        self._rank = rank
        self._lease = lease
        self._overruling = overruling
        self._remembers = remembers
        # The time of the last claim or renewal of each source that claims the device.
        self._claims: dict[K, float] = {}

    def set_lease(self, lease: float) -> None:
        """Replace the lease, also of the claims that exist."""
        self._lease = lease

    def claim(self, source: K, now: float) -> HolderChanged[K] | None:
        """Take a claim of a source; it is granted if the source is :attr:`holder` afterwards."""
        granted = self.may_hold(source)
        if granted and not self._remembers:
            self._claims.clear()
        if granted or self._remembers:
            self._claims[source] = now
        return self._give(source, Cause.CLAIM, now) if granted else None

    def is_claimed_by(self, source: K) -> bool:
        """Return whether the claim of a source has been taken and has not ended."""
        return source in self._claims

    def renew(self, source: K, now: float) -> None:
        """Note that a source is not silent."""
        if source in self._claims:
            self._claims[source] = now

    def release(self, source: K, now: float) -> HolderChanged[K] | None:
        """End the claim of a source."""
        self._claims.pop(source, None)
        return self._give(self._next(), Cause.RELEASE, now) if source == self.holder else None

    def poll(self, now: float) -> HolderChanged[K] | None:
        """End the claims of the sources that have been silent for the lease."""
        for source, renewed in list(self._claims.items()):
            if now >= renewed + self._lease:
                del self._claims[source]
        if self.holder is None or self.holder in self._claims:
            return None
        return self._give(self._next(), Cause.SILENCE, now)

    @property
    def due(self) -> float:
        """Return when :meth:`poll` is due, infinity if never."""
        return min(self._claims.values(), default=math.inf) + self._lease

    def may_hold(self, source: K) -> bool:
        """Return whether a claim of a source would be granted now."""
        if self.holder in (None, source) or source in self._overruling:
            return True
        assert self.holder is not None
        if self._policy is Policy.PRIORITY:
            return (self.holder not in self._overruling
                    and self._rank(source) < self._rank(self.holder))
        return self._policy is Policy.TAKEOVER

    def _next(self) -> K | None:
        return min(self._claims, key=self._rank, default=None)

    def _give(self, source: K | None, cause: Cause, now: float) -> HolderChanged[K] | None:
        before, self.holder = self.holder, source
        if source == before:
            return None
        self.since = now
        return HolderChanged(before, source, cause)
