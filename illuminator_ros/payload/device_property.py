# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""One property of a device, and the one command that is under way to it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
import math
from typing import Generic, TypeVar

from .attempt import Attempt, Change, CommandedValue, FENCE, Fence, Proof, Served, Target
from .requests import Goal, Request, Result

S = TypeVar('S')
# s in which a command that ended unconfirmed may still take effect.
LATE_TIME = 30.0
# Values whose frames may be under way at once; with more, nothing counts before they have passed.
MAX_VALUES = 128
# Returns what a command sets, and the part of it that each of its requests asks for.
Plan = Callable[[Goal], tuple[Change[S], Mapping[Request, Change[S]]]]


def plan_of(make: Callable[[Goal], Change[S]]) -> Plan[S]:
    """
    Return a plan in which each request asks for the whole command.

    :param make: returns the command of a goal.
    """
    def plan(goal: Goal) -> tuple[Change[S], Mapping[Request, Change[S]]]:
        change = make(goal)
        return change, dict.fromkeys(goal.serves, change)

    return plan


class Property(Generic[S]):
    """
    Moves one property of a device to what is wanted. No I/O; times are s.

    At most one command is under way. :meth:`steer`, :meth:`reported` and :meth:`poll` return the
    requests that have ended.

    :param plan: makes the command of a goal.
    :ivar attempt: the command that is under way, None if there is none.
    :ivar fence_ends_at: until then, s, frames of a command that ended unconfirmed may be under
        way.
    """

    def __init__(self, target: Target, plan: Plan[S]) -> None:
        self.attempt: Attempt[S] | None = None
        self.fence_ends_at = -math.inf
        self._target = target
        self._plan = plan
        # The frames of the last command that were not acknowledged.
        self._frames = 0
        # When a command that has ended was sent last, s.
        self._sent_at = -math.inf
        self._unconfirmed: Change[S] | None = None
        # Until then statuses and frames from before a restart may come, s.
        self._restart_ends_at = -math.inf
        # The values whose frames may be under way, and until when, s.
        self._under_way: dict[CommandedValue, float] = {}

    def steer(
        self, goal: Goal | None, now: float, newest: S | None, gap: float | None,
    ) -> list[Served[S]]:
        """
        Send the command of a goal, unless an equal command is under way.

        :param newest: the newest status, None before the first.
        :param gap: between the last two statuses, None if none has come.
        """
        attempt, ended = self.attempt, list[Served[S]]()
        if attempt is None and goal is None:
            return ended
        is_wanted = attempt is not None and bool(attempt.serves)
        if attempt is not None and is_wanted and goal is not None and goal.gives_way:
            return ended
        if attempt is not None and is_wanted and goal is not None and self._goes_on(attempt, goal):
            _, parts = self._plan(goal) if len(goal.serves) > len(attempt.serves) else (None, {})
            attempt.serve({one: part for one, part in parts.items() if one.since <= attempt.began})
            return ended
        if attempt is not None:
            text = f'superseded by {self._plan(goal)[0].label}' if goal else 'no longer wanted'
            ended = self.withdraw(text, now)
        if goal is not None:
            self._start(goal, now, newest, gap)
        return ended

    @staticmethod
    def _goes_on(attempt: Attempt[S], goal: Goal) -> bool:
        """Return whether the command under way is as good as a new one of the goal."""
        return (attempt.goal.values == goal.values and goal.deadline >= attempt.goal.deadline
                and (attempt.goal.is_final or not goal.is_final))

    def _start(self, goal: Goal, now: float, newest: S | None, gap: float | None) -> None:
        change, parts = self._plan(goal)
        if self._under_way:
            self._under_way = {value: end for value, end in self._under_way.items() if now < end}
        fence = Fence(self.fence_ends_at, self._frames if now < self.fence_ends_at else 0,
                      self._proof(change, goal, now, newest))
        self.attempt = Attempt(self._target, change, goal, parts, now, fence=fence, gap=gap)

    def _proof(
        self, change: Change[S], goal: Goal, now: float, newest: S | None,
    ) -> Proof:
        """
        Return what proves a change though other frames are under way.

        Only a value that has no time to await the end of the fence needs that: one failure would
        lock out a program that sets it each second.
        """
        under_way = self._under_way
        has_others = bool(under_way.keys() - {change.value})
        if goal.deadline > now + FENCE or has_others and (
                change.value in under_way or len(under_way) == MAX_VALUES):
            return Proof.NOTHING
        if newest is not None and change.shown_by(newest) is False:
            return Proof.STATUS if now >= self._restart_ends_at else Proof.ACKNOWLEDGED
        return Proof.NOTHING if has_others else Proof.ACKNOWLEDGED

    def withdraw(self, text: str, now: float) -> list[Served[S]]:
        """Send the command no more; return its open requests."""
        attempt = self.attempt
        if attempt is None:
            return []
        served = attempt.serves
        attempt.withdraw(now)
        self._finish(attempt, now, Result(False, text, superseded=True), is_shown=False)
        return [Served(one, attempt.change, Result(False, text, superseded=True))
                for one in served]

    def fence_until(self, time: float) -> None:
        """Count nothing before a time: other commands that may set the property are under way."""
        self.fence_ends_at = max(self.fence_ends_at, time)

    def note_sent(self, change: Change[S], now: float) -> None:
        """Note that a change was sent without an attempt that awaits its effect."""
        self._unconfirmed, self._sent_at = change, now
        self._frames += 1
        self.fence_until(now + FENCE)

    def reported(self, status: S, gap: float, now: float) -> list[Served[S]]:
        """
        Receive a status that is not older than those before.

        :param gap: since the one before.
        """
        if (self._unconfirmed is not None and now >= self.fence_ends_at
                and self._unconfirmed.shown_by(status)):
            self._unconfirmed = None
        if self.attempt is None:
            return []
        return self._ended(self.attempt, self.attempt.reported(status, gap, now), now)

    def poll(self, now: float) -> list[Served[S]]:
        """Do what is due."""
        if self.attempt is None:
            return []
        return self._ended(self.attempt, self.attempt.poll(now), now)

    def restarted(self, status: S, now: float) -> None:
        """Receive the first status since a restart."""
        self._restart_ends_at = now + FENCE
        if self.attempt is not None:
            self.attempt.restarted(status, now)

    @property
    def due(self) -> float:
        """Return when :meth:`poll` has something to do, s."""
        return self.attempt.due if self.attempt is not None else math.inf

    def _ended(
        self, attempt: Attempt[S], ended: list[Served[S]], now: float,
    ) -> list[Served[S]]:
        """Take the requests that have ended; the attempt is over when none is left."""
        if ended and not attempt.serves:
            last = ended[-1]
            self._finish(attempt, now, last.result, is_shown=last.status is not None)
        return ended

    def _finish(
        self, attempt: Attempt[S], now: float, result: Result, *, is_shown: bool,
    ) -> None:
        """Forget the attempt, and keep what may still be under way of it."""
        self.attempt, self._sent_at = None, attempt.last_sent
        self._unconfirmed = None if result.success or result.refused else attempt.change
        self._frames = attempt.unanswered(is_shown=is_shown)
        # The effect of a command that was withdrawn may come later.
        if result.superseded or self._frames:
            self.fence_until(attempt.last_sent + FENCE)
        if now < self.fence_ends_at and len(self._under_way) < MAX_VALUES:
            self._under_way[attempt.change.value] = self.fence_ends_at

    # Known facts

    @property
    def is_busy(self) -> bool:
        """Whether a command is under way."""
        return self.attempt is not None

    @property
    def sent_at(self) -> float:
        """Return when a command was sent last, s."""
        return self._sent_at if self.attempt is None else self.attempt.last_sent

    def is_under_way(self, change: Change[S]) -> bool:
        """Return whether a command that makes a change is under way."""
        return self.attempt is not None and self.attempt.change == change

    def expects(self, status: S) -> bool:
        """Return whether a status shows the change that is under way."""
        return self.attempt is not None and self.attempt.change.shown_by(status) is True

    def unconfirmed(self, now: float) -> Change[S] | None:
        """Return the change of the last command if it ended unconfirmed and may have an effect."""
        if self._unconfirmed is None or now > self.sent_at + LATE_TIME:
            return None
        return self._unconfirmed
