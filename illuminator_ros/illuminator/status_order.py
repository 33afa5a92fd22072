# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The order of the statuses of one light: which are late, and when the light has restarted."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from enum import Enum
import math

from .model import Mode, Status

WRAP_MS = 1 << 32
# s by which the uptime of a restarted light may exceed the time since the status before.
BOOT_SLACK = 5.0
# s after a restart in which no light starts again: statuses that overtake each other, or come from
# two lights with one address, would show a restart each, and each is followed by requests.
BOOT_TIME = 1.0
# s with only lower uptimes after which the light has restarted.
LOWER_TIME = 3.0
# After a loss the light has restarted if its uptime has advanced by less than this share of it.
RUNNING_SHARE = 0.5
# s in which a second path may deliver a copy of a status, and how many of them are remembered.
COPY_TIME = 5.0
MAX_COPIES = 256
# A state that goes back and forth so often within this time, s, is reported, until it has been
# calm for as long.
MAX_RETURNS = 4
CALM_TIME = 10.0
MAX_STATES = 4


class Order(Enum):
    """The place of a status among those before."""

    NEWEST = 'newest'
    LATE = 'late'
    RESTARTED = 'the first since a restart'


class StatusOrder:
    """
    Orders the statuses of one light by their uptime; times are s.

    Nothing else is concluded from the uptime, which may stand still, run slow, or count seconds.

    :ivar newest: the newest status, None before the first, and ``newest_at``, when it came.
    :ivar gap: the time between the last two statuses that were not late, None before the first.
    :ivar restarts: how often the light has restarted.
    """

    def __init__(self) -> None:
        self.newest: Status | None = None
        self.newest_at = -math.inf
        self.gap: float | None = None
        self.restarts = 0
        self._lower_since = math.inf
        self._restarted_at = -math.inf
        self._was_lost = False
        # The statuses that have come lately, the newest last, and when each came last, s.
        self._recent: dict[Status, float] = {}

    def lost(self) -> None:
        """Note that the light was lost: it may have restarted."""
        self._was_lost = True

    def add(self, status: Status, now: float, is_expected: Callable[[Status], bool]) -> Order:
        """
        Return the place of a status that has come.

        :param is_expected: returns whether a status shows what a command under way changes.
        """
        order = self._compare(status, now)
        if order is Order.LATE or (
                order is Order.NEWEST and self._is_copy(status, now) and not is_expected(status)):
            return Order.LATE
        if order is Order.RESTARTED:
            self.restarts += 1
            self._restarted_at = now
            self._recent.clear()
        self.gap = 0.0 if self.newest is None else now - self.newest_at
        self.newest, self.newest_at = status, now
        self._lower_since, self._was_lost = math.inf, False
        self._recent.pop(status, None)
        self._recent[status] = now
        if len(self._recent) > MAX_COPIES:
            del self._recent[next(iter(self._recent))]
        return order

    def _compare(self, status: Status, now: float) -> Order:
        newest = self.newest
        if newest is None:
            return Order.NEWEST
        elapsed = now - self.newest_at
        # The counter wraps.
        ahead_ms = (status.uptime_ms - newest.uptime_ms + WRAP_MS // 2) % WRAP_MS - WRAP_MS // 2
        if self._was_lost:
            has_run = ahead_ms >= 1000 * RUNNING_SHARE * elapsed
            return Order.NEWEST if has_run else Order.RESTARTED
        if ahead_ms >= 0:
            return Order.NEWEST
        self._lower_since = min(self._lower_since, now)
        has_booted = (status.uptime_ms <= 1000 * (elapsed + BOOT_SLACK)
                      and now >= self._restarted_at + BOOT_TIME)
        if has_booted or now >= self._lower_since + LOWER_TIME:
            return Order.RESTARTED
        return Order.LATE

    def _is_copy(self, status: Status, now: float) -> bool:
        """Return whether a status has come before and contradicts the newest."""
        if now - self._recent.get(status, -math.inf) > COPY_TIME:
            return False
        return self.newest is not None and not status.shows_the_state_of(self.newest)


class ChangingStates:
    """
    Detects a state that goes back and forth without a command of ours; times are s.

    Several lights with one address cause that, or another controller.

    :ivar are_changing: whether the state goes back and forth.
    :ivar until: the time until which it counts as changing; infinity while it does not.
    """

    def __init__(self) -> None:
        self.are_changing = False
        self.until = math.inf
        self._states: deque[Status] = deque(maxlen=MAX_STATES)
        self._returns: deque[float] = deque(maxlen=MAX_RETURNS)

    def reset(self) -> None:
        """Forget all states: the light was lost, or it has been calm for long enough."""
        self.are_changing, self.until = False, math.inf
        self._states.clear()
        self._returns.clear()

    def add(self, status: Status, now: float, *, is_commanded: bool) -> bool:
        """
        Take a status that counts.

        :param is_commanded: whether a command of ours may have changed the light.
        :return: whether it shows that the state has begun to go back and forth.
        """
        were_changing = self.are_changing
        # Under external sync the output follows another signal, and heat dims.
        if status.is_dimmed or status.mode is Mode.EXTERNAL_SYNC:
            return False
        if is_commanded and not were_changing:
            self._states.clear()
        if self._states and status.shows_the_state_of(self._states[-1]):
            return False
        known = [*filter(status.shows_the_state_of, self._states)]
        if known:
            self._states.remove(known[0])
            self._returns.append(now)
            if were_changing or (
                    len(self._returns) == MAX_RETURNS and now <= self._returns[0] + CALM_TIME):
                self.are_changing, self.until = True, now + CALM_TIME
        self._states.append(status)
        return self.are_changing and not were_changing
