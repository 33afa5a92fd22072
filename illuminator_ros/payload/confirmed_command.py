# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
One command that changes a device: the status decides, the acknowledgement explains.

MAV_RESULT_ACCEPTED says that the command is valid and is executed, not that it is completed
(command protocol). So a change has succeeded when a status that was sent after the command shows
it, and nothing else is a success. Each try carries a request for the status, so that both answers
come in one round trip.

A status counts if it came after an acknowledgement of the command, or after its last try, and
after the fence: where the command before it was not acknowledged, its frames and answers may
still be under way. Within the fence a status counts only if this command alone can have caused
it. Nothing is concluded from the clock of the device.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
import math
from typing import Generic, NamedTuple, TypeVar

from .requests import Done as Done  # noqa: F401 - gimbals import it from here
from .requests import Result as Result
from ..mavlink.command_sender import (
    Command,
    CommandPosition,
    CommandResult,
    CommandSender,
    CommandStatus,
    format_seconds,
    request_message,
    timing,
)
from ..mavlink.dialect import MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME, mavlink
from ..mavlink.messages import Address, result_name
from ..mavlink.retries import CLOSING, Retries, STATUS, STILL_UNCONFIRMED, UNCONFIRMED

# s from the acknowledgement, or the last try, or the end of the fence, to the status that shows
# the change.
CONFIRMATION_TIMEOUT = 1.0
# s after the last frame of an unacknowledged command in which its frames and answers may come.
FENCE = 1.5
# Tries after which a status counts though none of them was acknowledged, where there is no last.
ENOUGH_TRIES = 3
# s; a command ends after this time even if the device still reports progress.
PROGRESS_LIMIT = 30.0

PERMANENT_RESULTS = frozenset((
    mavlink.MAV_RESULT_DENIED, mavlink.MAV_RESULT_UNSUPPORTED,
    MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME,
    mavlink.MAV_RESULT_COMMAND_LONG_ONLY, mavlink.MAV_RESULT_COMMAND_INT_ONLY))

# The values that a command sets: MAV_CMD, params and position.
CommandedValue = tuple[int, tuple[float, ...], CommandPosition | None]

# The ends of the protocol that end even a command that insists: nothing can be sent any more.
ENDS_REPEATING = frozenset((CommandStatus.CLOSED, CommandStatus.LINK_LOST))

S = TypeVar('S')


class Target(NamedTuple):
    """
    The device that commands go to.

    :param kind: a noun for it, such as ``light``.
    :param status_id: the message id of its status, None if no status shows what the commands
        change: then the acknowledgement decides.
    :param status_source: the component that sends the status, None for the device itself.
    :param needs_status: whether only a status makes a change a success, even if none has ever
        come.
    """

    address: Address
    commands: CommandSender
    kind: str
    status_id: int | None = None
    status_name: str = ''
    status_source: Address | None = None
    needs_status: bool = False

    @property
    def status_request(self) -> Command | None:
        """Return the command that requests the status, None if there is no status."""
        return (None if self.status_id is None
                else request_message(self.status_source or self.address, self.status_id))


@dataclass(frozen=True)
class Change(Generic[S]):
    """
    A value of a property of a device, and the command that sets it.

    Two changes are equal if they set the same values.

    :param command: the MAV_CMD that makes it, with ``params`` and ``position``.
    :param goal: the state to be reached, for people.
    :param note: a change that was not requested but comes with it, '' if there is none.
    :param is_idempotent: whether the command may be sent twice; one that may not is sent once.
    :param is_repeated: whether it is sent again if the device has accepted it and does not show
        it. That undoes what another sender has changed meanwhile, so it is for a safe state only.
    :param shown_by: returns whether a status shows the change; None if it cannot show it.
    :param actual: describes the state that a status shows instead, for people.
    :param evidence: describes how far a status that does not contradict shows the change, for
        people; None for "confirmed".
    """

    command: int
    params: tuple[float, ...]
    goal: str
    position: CommandPosition | None = None
    note: str = ''
    is_idempotent: bool = True
    is_repeated: bool = False
    shown_by: Callable[[S], bool | None] = field(default=lambda status: None, compare=False)
    actual: Callable[[S], str] = field(default=lambda status: '', compare=False)
    evidence: Callable[[S], str] | None = field(default=None, compare=False)


@dataclass(frozen=True)
class Desired(Generic[S]):
    """
    A value that a property should have.

    :param reason: why, for people, '' for a request.
    :param limit: s from the request within which a command ends.
    :param insists: whether it is sent until a status shows it, whatever the device answers.
    :param is_last: whether the process ends, which cannot await the end of the fence: within it a
        status counts after :data:`ENOUGH_TRIES`.
    """

    change: Change[S]
    reason: str = ''
    limit: float = math.inf
    insists: bool = False
    is_last: bool = False

    @property
    def value(self) -> CommandedValue:
        """Return the values that the command sets."""
        return self.change.command, self.change.params, self.change.position

    def equals(self, other: Desired[S]) -> bool:
        """Return whether both set the same value in the same way."""
        return ((self.value, self.insists, self.is_last)
                == (other.value, other.insists, other.is_last))


class ConfirmedCommand(Generic[S]):
    """
    One command, its acknowledgement, and the statuses since. No I/O; times are s.

    :meth:`reported` and :meth:`poll` return the result when the command has ended, else None.

    :param asked_at: when the value was requested.
    :param fence: the time before which frames of other commands may be under way.
    :param is_sole_cause: whether none of these can have caused a status that shows the change.
    :param is_awaited: whether a call waits for the result.
    :param gap: the time between the last two statuses, None if none has ever come.
    """

    def __init__(
        self, target: Target, desired: Desired[S], now: float, *, asked_at: float,
        fence: float = -math.inf, is_sole_cause: bool = False, is_awaited: bool = False,
        gap: float | None = None,
    ) -> None:
        self._desired = desired
        self._target = target
        self._asked_at = asked_at
        self._fence = fence
        self._is_sole_cause = is_sole_cause
        self._is_awaited = is_awaited
        self._gap = gap
        # The end of the command protocol, which explains the outcome.
        self._answer: CommandResult | None = None
        # The last status that counts and shows something else.
        self._instead: S | None = None
        self._ends_at = self._repeat_due = math.inf
        self._requests = Retries(STATUS, math.inf)
        self._acknowledged = 0
        self._has_restarted = False
        self._send(now)

    # The command

    def _send(self, now: float, tried: int = 0) -> None:
        """
        Send the command by the command protocol, which tries again until it is acknowledged.

        Where more tries are due whatever the device answers, each is sent once.
        """
        change, target, insists = self._desired.change, self._target, self._desired.insists
        is_fenced = now < self._fence
        is_repeated = change.is_idempotent and (insists or is_fenced or self._is_accepted)
        self._repeat_due = math.inf
        if is_repeated:
            is_slow = insists and tried >= UNCONFIRMED.tries
            policy = (CLOSING if self._desired.is_last else
                      STILL_UNCONFIRMED if is_slow else UNCONFIRMED)
            self._repeat_due = now + policy.first
            if is_fenced:
                self._repeat_due = min(self._repeat_due, self._fence)
        elif is_fenced:
            self._ends_at = self._fence + CONFIRMATION_TIMEOUT
            self._requests = Retries(STATUS, self._fence, 1)
        self._sending = target.commands.start(
            Command(target.address, change.command, change.params, position=change.position),
            now, self._answered, deadline=self._limit,
            retries=0 if is_repeated or not change.is_idempotent else None,
            tried=tried, follow_up=target.status_request)

    @property
    def _limit(self) -> float:
        """Return when it ends even if the device still reports progress."""
        longest = math.inf if self._desired.insists else PROGRESS_LIMIT
        return self._asked_at + min(self._desired.limit, longest)

    @property
    def is_under_way(self) -> bool:
        """Whether a try, or the answer to it, may be under way: not each was acknowledged."""
        return self._sending.tries > self._acknowledged

    @property
    def last_sent(self) -> float:
        """When it was sent last, s."""
        return self._sending.last_sent

    def restarted(self, now: float) -> None:
        """Send it again: the device has restarted, and nothing from before counts."""
        self._has_restarted = True
        if self._desired.change.is_idempotent:
            self._fence, self._is_sole_cause = now + FENCE, False
            self._answer = self._instead = None
            self._ends_at = math.inf
            self._requests.stop()
            self._send(now, self._sending.tries)

    def withdraw(self, now: float) -> None:
        """Send it no more."""
        self._target.commands.cancel(self._sending, now)

    # The acknowledgement

    @property
    def _is_accepted(self) -> bool:
        return self._answer is not None and self._answer.accepted

    def _answered(self, answer: CommandResult, now: float) -> None:
        if answer.status is CommandStatus.ANSWERED:
            # Within the fence it may be the answer to an earlier command. It counts where no call
            # waits for the result: one lost answer would otherwise slow down a stream for ever.
            is_fenced = now < self._fence
            if not (is_fenced and self._is_awaited):
                self._acknowledged += 1
            if is_fenced or self._answer is not None and not self._desired.insists:
                return
            if self._answer is None:
                self._ends_at = now + CONFIRMATION_TIMEOUT
                self._requests = Retries(STATUS, now + STATUS.first, 1)
            self._answer = answer
            if self._target.status_id is None or answer.refused and self._gap is None:
                self._ends_at = now
        elif answer.status is CommandStatus.NO_ANSWER:
            # A single try is followed by others.
            if self._repeat_due == math.inf:
                self._answer = answer
                self._ends_at = self.last_sent + CONFIRMATION_TIMEOUT
        elif answer.status is not CommandStatus.CANCELLED:
            self._answer = answer
            self._ends_at = now

    # The status

    def _counts(self, now: float) -> bool:
        """Return whether a status that comes now was sent after the command, as far as known."""
        sending, desired = self._sending, self._desired
        if now < self._fence:
            return desired.is_last and sending.tries >= ENOUGH_TRIES
        is_answered = sending.result is not None or self._answer is not None
        return is_answered or (
            sending.tries >= ENOUGH_TRIES if desired.insists else sending.is_last_try)

    def reported(self, status: S, gap: float, now: float) -> Result | None:
        """
        Take a status that is not older than those before.

        :param gap: since the one before.
        """
        self._gap = gap
        change = self._desired.change
        shown = change.shown_by(status)
        if not (self._counts(now) or shown and self._is_sole_cause and now < self._fence):
            return None
        if shown or shown is None and self._is_accepted:
            answer = self._protocol()
            evidence = (change.evidence(status) if change.evidence else
                        f'confirmed by {self._target.status_name}')
            return self._result(f'{change.goal}, {evidence}' + (
                ', without an acknowledgement' if answer.result is None
                else f': {result_name(answer.result)}'), now, success=True)
        if shown is False:
            self._instead = status
        if self._desired.insists:
            return None
        if self._answer is not None and self._answer.refused:
            return self._expired(now)
        if self._is_accepted and change.is_repeated and self._repeat_due == math.inf:
            self._repeat_due = self.last_sent + UNCONFIRMED.first
        return None

    # Time

    def poll(self, now: float) -> Result | None:
        """Send what is due, or end."""
        if now >= self._end:
            return self._expired(now)
        if now >= self._repeat_due:
            self._send(now, self._sending.tries)
        if self._requests.begin_try(now) and (request := self._target.status_request):
            self._target.commands.send_once(request)
        return None

    @property
    def _end(self) -> float:
        """Return when it ends without success, s."""
        if not self._desired.insists:
            return min(self._ends_at, self._limit)
        is_over = self._answer is not None and self._answer.status in ENDS_REPEATING
        return self._ends_at if is_over else math.inf

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""
        return min(self._end, self._repeat_due, self._requests.due)

    # The result

    def _protocol(self) -> CommandResult:
        """Return the end of the command protocol, or how far it has come."""
        sending = self._sending
        unfinished = (CommandStatus.NO_ANSWER if sending.result is None
                      else CommandStatus.OUT_OF_TIME)
        return self._answer or CommandResult(
            unfinished, sending.result, progress=sending.progress)

    def failure(self) -> str:
        """Return why it is not confirmed so far, for people; '' if nothing has come."""
        answer = self._answer
        if answer is None or answer.refused:
            return '' if answer is None else answer.describe_failure()
        shown = self._shown_instead()
        return (f'{self._desired.change.goal} not confirmed: {answer.describe()}'
                f'{shown and ", but " + shown}')

    def _shown_instead(self) -> str:
        if self._instead is None:
            return ''
        return f'{self._target.status_name} shows {self._desired.change.actual(self._instead)}'

    def _expired(self, now: float) -> Result:
        change, target, answer = self._desired.change, self._target, self._answer
        shown = self._shown_instead()
        if answer is None and now < self._fence:
            text = 'an earlier command may still be under way'
            return self._result(f'{change.goal} not confirmed: {text}', now)
        if answer is None or not (answer.accepted or answer.refused):
            return self._result(
                self._protocol().describe() + (f', and {shown}' if shown else ''), now,
                superseded=answer is not None and answer.status is CommandStatus.CLOSED)
        if answer.refused:
            return self._result(answer.describe_failure(), now, refused=True,
                                permanent=answer.result in PERMANENT_RESULTS)
        if target.status_id is None:
            return self._result(answer.describe(), now, success=True)
        if self._gap is None and not target.needs_status:
            return self._result(
                f'{change.goal}, accepted, not confirmed (the {target.kind} sends no '
                f'{target.status_name}): {answer.describe()}', now, success=True)
        if shown:
            reason = f', but {shown}'
        elif self._gap is not None and self._gap > CONFIRMATION_TIMEOUT:
            reason = f'; its next status is due within {math.ceil(self._gap)} s'
        else:
            reason = (f', but no {target.status_name} came within '
                      f'{format_seconds(CONFIRMATION_TIMEOUT)}')
        return self._result(f'{change.goal} not confirmed: {answer.describe()}{reason}', now,
                            contradicted=bool(shown))

    def _result(
        self, text: str, now: float, *, success: bool = False, **flags: bool,
    ) -> Result:
        if self._answer is not None and self._answer.status is CommandStatus.CLOSED:
            return Result(False, text, superseded=True)
        if self._has_restarted:
            text += f'; the {self._target.kind} restarted meanwhile'
        took = timing(self._sending.tries, now - self._asked_at)
        note = self._desired.change.note if success else ''
        return Result(success, f'{text} ({took})', note=note, **flags)
