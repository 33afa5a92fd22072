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

"""
Desired and reported state: one :class:`Reconciler` moves one property of a device.

Rules yield the value that a property should have (:class:`Desired`), ranked in a table
(:func:`decide`). The reconciler sends a command while that value and the reported one differ, and
answers each waiting caller once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
import contextlib
from dataclasses import dataclass
import math
from typing import Generic, TypeVar

from .attempt import Attempt, Change, Done, Phase, Result, StatusReport, Target
from ..mavlink.command_sender import CommandStatus

S = TypeVar('S')
F_contra = TypeVar('F_contra', contravariant=True)
# s; an attempt ends after this time even if the device still reports progress.
PROGRESS_LIMIT = 30.0
# Callers that may wait for one value.
MAX_CALLERS = 32


@dataclass(frozen=True)
class Desired(Generic[S]):
    """
    A value that a property should have.

    :param reason: for people.
    :param since: from when on it is desired, s; may be in the future.
    :param limit: s that an attempt may take.
    """

    change: Change[S]
    reason: str = ''
    since: float = -math.inf
    limit: float = PROGRESS_LIMIT


@dataclass(frozen=True)
class Sent(Generic[S]):
    """
    A change that was sent.

    :param at: when, s.
    :param before: the newest status then, None if there was none.
    """

    change: Change[S]
    at: float
    before: S | None


# A function of what is known of a device and of the time that yields a desired value, or None.
Rule = Callable[[F_contra, float], Desired[S] | None]


def decide(rules: Iterable[Rule[F_contra, S]], facts: F_contra, now: float,
           ) -> tuple[Desired[S] | None, float]:
    """
    Return what the first rule in force desires, and when the decision may change by itself, s.

    :param rules: the highest first; a value that is desired later is not in force yet.
    """
    due = math.inf
    for rule in rules:
        desired = rule(facts, now)
        if desired is not None:
            if desired.since <= now:
                return desired, due
            due = min(due, desired.since)
    return None, due


class _Callers:
    """Those who wait for the outcome of one value."""

    def __init__(self) -> None:
        self._requests: list[Done] = []
        # The newest of a stream.
        self._stream: Done | None = None

    def add(self, done: Done, *, is_stream: bool) -> Done | None:
        """Add one; return one that must be answered now: an older of a stream, or one too many."""
        if is_stream:
            older, self._stream = self._stream, done
            return older
        if len(self._requests) >= MAX_CALLERS:
            return done
        self._requests.append(done)
        return None

    def answer(self, result: Result, now: float) -> None:
        """Answer all, even if one of them raises."""
        with contextlib.ExitStack() as answers:
            for done in (*self._requests, *([self._stream] if self._stream else [])):
                answers.callback(done, result, now)


class Reconciler(Generic[S]):
    """
    Moves one property of a device to its desired value. No I/O; times are s.

    One command is under way at a time. A newer desired value replaces an older one, whose callers
    are answered "superseded"; an equal one shares the command and its outcome.

    :param ended: called before the callers, with a desired value, its result, the status that
        shows it, and the time, when an attempt has ended or the value is wanted no longer.
    :param earliest: returns the time before which a change must not be sent, s.
    :param overtakes: returns whether a change is sent although another one by the same command is
        not acknowledged.
    :ivar desired: the value that is wanted and not yet reached or given up; None if there is none.
    :ivar last_sent: the change that was sent last, None before the first.
    """

    def __init__(
        self, target: Target,
        ended: Callable[[Desired[S], Result, S | None, float], None] = lambda *ended: None, *,
        earliest: Callable[[Change[S]], float] = lambda change: -math.inf,
        overtakes: Callable[[Change[S]], bool] = lambda change: False,
    ) -> None:
        self.desired: Desired[S] | None = None
        self.last_sent: Sent[S] | None = None
        self._target = target
        self._ended = ended
        self._earliest = earliest
        self._overtakes = overtakes
        self._callers = _Callers()
        self._wanted_at = -math.inf
        self._attempt: Attempt[S] | None = None
        # Whether the attempt is for an earlier value.
        self._is_replaced = False
        self._status: S | None = None

    @property
    def under_way(self) -> Change[S] | None:
        """Return the change that was sent and is not confirmed, None if there is none."""
        return self._attempt.change if self._attempt else None

    @property
    def is_busy(self) -> bool:
        """Whether a value is wanted or a command is under way."""
        return self.desired is not None or self._attempt is not None

    @property
    def is_waiting(self) -> bool:
        """Whether the desired value was not sent yet."""
        return self.desired is not None and (self._attempt is None or self._is_replaced)

    @property
    def is_accepted(self) -> bool:
        """Whether the device has accepted the desired value and has not shown it."""
        return self._attempt is not None and self._attempt.is_accepted and not self._is_replaced

    def may_set(self, which: Callable[[Change[S]], bool]) -> bool:
        """Return whether a change is desired or under way for which a condition holds."""
        return (self.desired is not None and which(self.desired.change)
                or self._attempt is not None and which(self._attempt.change))

    def want(
        self, desired: Desired[S], now: float, done: Done | None = None, *,
        is_stream: bool = False,
    ) -> None:
        """
        Move the property to a value; callable again with the same one.

        :param done: called once with the result.
        :param is_stream: whether the caller is one of a stream: a newer one replaces it.
        """
        result = Result(
            False, desired.reason or f'superseded by {desired.change.goal}', superseded=True)
        replaced = self._replace(desired, now)
        self.desired = desired
        refused = done and self._callers.add(done, is_stream=is_stream)
        self._advance(now)
        # The last step, since an answer may make the caller want another value.
        replaced.answer(result, now)
        if refused:
            refused(result if is_stream else Result(
                False, f'{MAX_CALLERS} requests are waiting for {self._target.kind} '
                f'{self._target.address} already'), now)

    def _replace(self, newer: Desired[S], now: float) -> _Callers:
        """Give up the desired value if another one is wanted; return its callers."""
        before, callers = self.desired, _Callers()
        if before is None or _differ(before.change, newer.change):
            callers, self._callers = self._callers, callers
            self._wanted_at = now
            if self._attempt is not None:
                self._is_replaced = True
                self._attempt.stop_resending(now)
            if before is not None:
                self._ended(before, Result(False, '', superseded=True), None, now)
        return callers

    def cancel(self, message: str, now: float, *, superseded: bool = False) -> None:
        """Give up the desired value, and resend no command."""
        self._end_attempt(now)
        if self.desired is not None:
            self._finish(Result(False, message, superseded=superseded), None, now)

    def stop(self, message: str, now: float) -> None:
        """Send nothing more for the desired value; a command under way may still succeed."""
        if self.is_waiting:
            self.cancel(message, now)
        elif self._attempt is not None:
            self._attempt.stop_resending(now)

    def lost(self, message: str, now: float) -> None:
        """Send nothing more for the desired value: the device is lost and may restart."""
        if self.is_waiting:
            self.cancel(message, now)
        if self._attempt is not None:
            self._attempt.end_command(now, CommandStatus.NO_ANSWER)

    def reported(self, report: StatusReport[S], now: float) -> None:
        """Take a status that is newer than all before."""
        self._status = report.status
        if self._attempt is not None:
            self._attempt.reported(report, now)
        self._advance(now)

    def poll(self, now: float) -> None:
        """Do what is due."""
        if self._attempt is not None:
            self._attempt.poll(now)
        self._advance(now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""
        due = self._attempt.next_deadline() if self._attempt else math.inf
        if self.desired is not None and self.is_waiting:
            due = min(due, self._wanted_at + self.desired.limit, self._ready_at(self.desired))
        return due

    def _ready_at(self, desired: Desired[S]) -> float:
        """Return when the desired value can be sent, s."""
        attempt = self._attempt
        # An acknowledgement names its command, so it cannot answer another command.
        if (attempt and attempt.phase is Phase.SENT
                and attempt.change.command == desired.change.command
                and not self._overtakes(desired.change)):
            return math.inf
        return self._earliest(desired.change)

    def _advance(self, now: float) -> None:
        """Send the desired value if it can be sent."""
        desired = self.desired
        if desired is None or not self.is_waiting:
            return
        deadline = self._wanted_at + desired.limit
        if now >= deadline:
            self._finish(
                Result(False, 'not sent: the command before it has not ended'), None, now)
        elif now >= self._ready_at(desired):
            before, self._is_replaced = self._attempt, False
            attempt = self._attempt = Attempt(
                self._target, desired.change, self._attempt_ended, wanted_at=self._wanted_at,
                deadline=deadline, overtake=self._overtakes(desired.change), before=self._status)
            if before is not None:
                before.abandon()
            self.last_sent = Sent(desired.change, now, self._status)
            attempt.send(now)

    def _attempt_ended(self, result: Result, status: S | None, now: float) -> None:
        self._attempt = None
        was_replaced, self._is_replaced = self._is_replaced, False
        # The next poll sends the newer value, unless the link was lost.
        if not was_replaced:
            self._finish(result, status, now)

    def _end_attempt(self, now: float) -> None:
        attempt, self._attempt, self._is_replaced = self._attempt, None, False
        if attempt is not None:
            attempt.abandon()
            attempt.end_command(now, CommandStatus.CANCELLED)

    def _finish(self, result: Result, status: S | None, now: float) -> None:
        desired, self.desired = self.desired, None
        callers, self._callers = self._callers, _Callers()
        assert desired is not None
        self._ended(desired, result, status, now)
        callers.answer(result, now)


def _differ(one: Change[S], other: Change[S]) -> bool:
    return ((one.command, one.params, one.position)
            != (other.command, other.params, other.position))
