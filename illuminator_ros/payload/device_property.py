# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
One property of a device: the value that it should have, and the command that moves it there.

The owner decides which value is desired (one function, ``goal``), hands it to
:meth:`Property.want`, and takes the :class:`Outcome` of each value from
:attr:`Property.outcomes`: nothing is called back.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
import math
from typing import Generic, NamedTuple, TypeVar

from .confirmed_command import (
    Change,
    CommandedValue,
    ConfirmedCommand,
    Desired,
    Done,
    FENCE,
    Result,
    Target,
)
from ..mavlink.component import call_each
from ..mavlink.retries import COMMAND

S = TypeVar('S')
# Callers that may wait for one value.
MAX_CALLERS = 32
# s in which a command that ended unconfirmed may still take effect.
LATE_TIME = 30.0
# Values whose frames may be under way at once; with more, nothing counts before they have passed.
MAX_VALUES = 128


class Caller(NamedTuple):
    """
    One that waits for the outcome of a value.

    :param asked_at: s.
    :param source: of the request, '' where there are none.
    :param is_stream: whether it is one of a stream: a newer one replaces it.
    :param detail: how it was requested, for people.
    """

    done: Done
    asked_at: float
    source: str = ''
    is_stream: bool = False
    detail: str = ''


@dataclass(frozen=True)
class Outcome(Generic[S]):
    """
    The end of a desired value.

    :param status: the status that shows it, None if none does.
    :param callers: who waits for it.
    """

    desired: Desired[S]
    result: Result
    status: S | None = None
    callers: tuple[Caller, ...] = ()


def answer(callers: Iterable[Caller], result: Result, now: float) -> None:
    """Answer callers, even if one of them raises an exception."""
    call_each([caller.done for caller in callers], result, now)


class Property(Generic[S]):
    """
    Moves one property of a device to its desired value. No I/O; times are s.

    At most one command is under way. A caller of another value replaces it, and its callers are
    answered "superseded". A caller of the same value waits for the next command, since nothing
    that was sent before it asked may confirm its request.

    :ivar desired: the value that is wanted and not yet reached or given up; None if there is none.
    :ivar command: the command that moves it there.
    :ivar outcomes: of the values that have ended, for the owner to take.
    :ivar newest: the newest status, None before the first.
    :ivar newest_at: when it came, s.
    :ivar fence: until then the frames of a command that was not acknowledged may be under way, s.
    """

    def __init__(self, target: Target) -> None:
        self.desired: Desired[S] | None = None
        self.command: ConfirmedCommand[S] | None = None
        self.outcomes: deque[Outcome[S]] = deque()
        self.newest: S | None = None
        self.newest_at = self.fence = -math.inf
        self._target = target
        self._gap: float | None = None
        # When the last command began, and when a command that has ended was sent last, s.
        self._began_at = self._sent_at = -math.inf
        self._callers: list[Caller] = []
        self._next_callers: list[Caller] = []
        self._unconfirmed: Change[S] | None = None
        # The values whose frames may be under way, and until when, s.
        self._under_way: dict[CommandedValue, float] = {}

    def want(self, desired: Desired[S], now: float, caller: Caller | None = None) -> None:
        """Move the property to a value; callable again with the same one."""
        before = self.desired
        if before is not None and before.equals(desired):
            if caller is not None:
                self._join(caller)
            return
        if before is not None:
            self.cancel(desired.reason or f'superseded by {desired.change.goal}', now,
                        superseded=True)
        self._start(desired, [caller] if caller else [], now)

    def _join(self, caller: Caller) -> None:
        """Keep a caller for the next command of the same value, unless this one has just begun."""
        assert self.desired is not None
        if caller.is_stream:
            older = tuple(one for one in self._next_callers if one.is_stream)
            self._next_callers = [one for one in self._next_callers if not one.is_stream]
            self.outcomes.append(Outcome(self.desired, Result(
                False, f'superseded by {self.desired.change.goal}', superseded=True), None, older))
        elif len(self._callers) + len(self._next_callers) >= MAX_CALLERS:
            self.outcomes.append(Outcome(self.desired, Result(
                False, f'{MAX_CALLERS} requests are waiting for {self._target.kind} '
                f'{self._target.address} already'), None, (caller,)))
            return
        if caller.asked_at > self._began_at or caller.is_stream:
            self._next_callers.append(caller)
        else:
            self._callers.append(caller)

    def _start(self, desired: Desired[S], callers: list[Caller], now: float) -> None:
        asked_at = callers[0].asked_at if callers else now
        if self._under_way:
            self._under_way = {value: end for value, end in self._under_way.items() if now < end}
        self.desired, self._callers, self._began_at = desired, callers, now
        self.command = ConfirmedCommand(
            self._target, desired, now, asked_at=asked_at, fence=self.fence,
            is_sole_cause=self._is_sole_cause(desired),
            is_awaited=not all(one.is_stream for one in callers), gap=self._gap)

    def _is_sole_cause(self, desired: Desired[S]) -> bool:
        """
        Return whether a status that shows a change proves it though other frames are under way.

        It does if the newest status does not show it, and no other value has been sent between
        an equal one and this one. Only a value that has no time to await the end of the fence
        needs that: a program that sets it each second would be locked out by one failure.
        """
        if desired.limit > FENCE:
            return False
        under_way = self._under_way
        has_others = bool(under_way.keys() - {desired.value})
        if has_others and (desired.value in under_way or len(under_way) == MAX_VALUES):
            return False
        return self.newest is not None and desired.change.shown_by(self.newest) is False

    def fence_until(self, fence: float) -> None:
        """Count nothing before a time: other commands that may set the property are under way."""
        self.fence = max(self.fence, fence)

    def note_sent(self, change: Change[S], now: float) -> None:
        """Note that a change was sent without a command that awaits its effect."""
        self._unconfirmed, self._sent_at = change, now
        self.fence_until(now + FENCE)

    def cancel(self, message: str, now: float, *, superseded: bool = False) -> None:
        """Give up the desired value, and send its command no more."""
        if self.command is not None:
            self.command.withdraw(now)
            self._end(Result(False, message, superseded=superseded), None, now, goes_on=False)

    def reported(self, status: S, now: float) -> None:
        """Take a status that is not older than those before."""
        self._gap = now - self.newest_at if self.newest is not None else 0.0
        self.newest, self.newest_at = status, now
        if (self._unconfirmed is not None and now >= self.fence
                and self._unconfirmed.shown_by(status)):
            self._unconfirmed = None
        if self.command is not None:
            result = self.command.reported(status, self._gap, now)
            if result is not None:
                self._end(result, status if result.success else None, now)

    def restarted(self, status: S, now: float) -> None:
        """Take the first status after a restart of the device, which confirms nothing."""
        self.newest, self.newest_at = status, now
        if self.command is not None:
            self.command.restarted(now)

    def poll(self, now: float) -> None:
        """Do what is due."""
        if self.command is not None and (result := self.command.poll(now)) is not None:
            self._end(result, None, now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""
        if self.outcomes:
            return -math.inf
        return self.command.next_deadline() if self.command is not None else math.inf

    def _end(
        self, result: Result, status: S | None, now: float, *, goes_on: bool = True,
    ) -> None:
        """End the command; go on for those who have asked for its value since it was sent."""
        command, desired = self.command, self.desired
        assert command is not None and desired is not None
        callers, waiting = self._callers, self._next_callers
        self.command, self.desired, self._callers, self._next_callers = None, None, [], []
        self._sent_at = command.last_sent
        is_settled = result.success or result.refused
        self._unconfirmed = None if is_settled else desired.change
        # A superseded command may have got the acknowledgement of an earlier command.
        if command.is_under_way or result.superseded:
            self.fence_until(command.last_sent + FENCE)
        if now < self.fence and len(self._under_way) < MAX_VALUES:
            self._under_way[desired.value] = self.fence
        # The others have no time to wait for an acknowledgement of another command.
        in_time = [one for one in waiting
                   if goes_on and now + COMMAND.first <= one.asked_at + desired.limit]
        callers += [one for one in waiting if one not in in_time]
        if in_time:
            self._start(desired, in_time, now)
        self.outcomes.append(Outcome(desired, result, status, tuple(callers)))

    # Known facts

    @property
    def sent_at(self) -> float:
        """Return when a command was sent last, s."""
        return self._sent_at if self.command is None else self.command.last_sent

    def expects(self, status: S) -> bool:
        """Return whether a status shows the change that is under way."""
        return self.desired is not None and self.desired.change.shown_by(status) is True

    def unconfirmed(self, now: float) -> Change[S] | None:
        """Return the change of the last command if it ended unconfirmed and may have an effect."""
        return self._unconfirmed if now <= self.sent_at + LATE_TIME else None
