# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
One command that changes a device: the status decides, the acknowledgement explains.

MAV_RESULT_ACCEPTED says that the command is valid and is executed, not that it is completed
(command protocol). So a change has succeeded when a status that was sent after the command shows
it, and nothing else is a success. Each try carries a request for the status, so that both answers
come in one round trip.

A status counts if it came after an acknowledgement of the command, or after its last try, and
after the fence: where the command before it ended unconfirmed, its frames and answers may still
be under way. Within the fence a status counts only if this command alone can have caused it.
Nothing is concluded from the clock of the device.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
import math
from typing import Generic, NamedTuple, TypeVar

from .requests import Goal, Request, Result
from ..mavlink.command_sender import (
    Command,
    CommandPosition,
    CommandResult,
    CommandSender,
    CommandStatus,
    request_message,
)
from ..mavlink.dialect import MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME, mavlink
from ..mavlink.durations import format_seconds, timing
from ..mavlink.messages import Address, result_name
from ..mavlink.retries import CLOSING, Retries, RetryPolicy

STATUS = RetryPolicy('the request for a status, after one that does not show the change',
                     0.05, 0.25)
REPEAT = RetryPolicy('an automatic OFF that no status shows, and a command that may be '
                     'confused with an earlier one', 0.25, 0.25, 10)
SLOW_REPEAT = RetryPolicy('an automatic OFF after these', 2.0, 2.0)
# s from the acknowledgement, or the last try, or the end of the fence, to the status that shows
# the change.
CONFIRMATION_TIMEOUT = 1.0
# s after the last frame of an unconfirmed command in which its frames and answers may come.
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
    :param poll: goes on with what is due for the device; the schedule calls it.
    :param status_id: the message id of its status, None if no status shows what the commands
        change: then the acknowledgement decides.
    :param status_source: the component that sends the status, None for the device itself.
    :param needs_status: whether only a status makes a change a success, even if none has ever
        come.
    """

    address: Address
    commands: CommandSender
    kind: str
    poll: Callable[[float], None]
    status_id: int | None = None
    status_name: str = ''
    status_source: Address | None = None
    needs_status: bool = False

    def wake(self, time: float) -> None:
        """Have :attr:`poll` called at a time, s, or before."""
        self.commands.schedule.by(self.poll, time)

    @property
    def status_request(self) -> Command | None:
        """Return the command that requests the status, None if there is no status."""
        return (None if self.status_id is None
                else request_message(self.status_source or self.address, self.status_id))


class Sending(Enum):
    """
    How a command is sent.

    Sending one again that the device has accepted and does not show undoes what another sender
    has changed meanwhile, so that is for a safe state only.
    """

    ONCE = 'once'
    UNTIL_ACKNOWLEDGED = 'until it is acknowledged'
    UNTIL_OBEYED = 'until it is acknowledged, and again while the status does not show it'
    UNTIL_SHOWN = 'until a status shows it, whatever the device answers'
    AT_THE_END = 'the same, faster, as the process ends and cannot await the end of the fence'

    @property
    def insists(self) -> bool:
        """Whether no answer of the device ends it."""
        return self in (Sending.UNTIL_SHOWN, Sending.AT_THE_END)


@dataclass(frozen=True)
class Change(Generic[S]):
    """
    A value of a property of a device, and the command that sets it.

    Two changes are equal if they set the same values.

    :param command: the MAV_CMD that makes it, with ``params`` and ``position``.
    :param label: the state to be reached, for people.
    :param note: a change that was not requested but comes with it, '' if there is none.
    :param sending: how it is sent where nothing insists on it.
    :param shown_by: returns whether a status shows the change; None if it cannot show it.
    :param actual: describes the state that a status shows instead, for people.
    :param evidence: describes how far a status that does not contradict shows the change, for
        people; None for "confirmed".
    """

    command: int
    params: tuple[float, ...]
    label: str
    position: CommandPosition | None = None
    note: str = ''
    sending: Sending = Sending.UNTIL_ACKNOWLEDGED
    shown_by: Callable[[S], bool | None] = field(default=lambda status: None, compare=False)
    actual: Callable[[S], str] = field(default=lambda status: '', compare=False)
    evidence: Callable[[S], str] | None = field(default=None, compare=False)

    @property
    def value(self) -> CommandedValue:
        """Return the values that the command sets."""
        return self.command, self.params, self.position


class Served(NamedTuple, Generic[S]):
    """
    The end of a request by the attempt that served it.

    :param change: the part of the command that the request asked for.
    :param status: the status that shows it, None if none does.
    """

    request: Request
    change: Change[S]
    result: Result
    status: S | None = None


class Proof(Enum):
    """The evidence that proves a command while frames of other commands may be under way."""

    NOTHING = 'nothing'
    STATUS = 'a status that shows it: none of these frames can have caused that'
    ACKNOWLEDGED = ('such a status after an acknowledgement: all these frames set equal values, '
                    'or the status may be from before a restart')


class Fence(NamedTuple):
    """
    The time in which frames of other commands may be under way.

    :param ends_at: s.
    :param frames: of the command before that were not acknowledged.
    :param proof: the evidence that counts before the end all the same.
    """

    ends_at: float = -math.inf
    frames: int = 0
    proof: Proof = Proof.NOTHING


NO_FENCE = Fence()


@dataclass
class Received:
    """
    The answers to a command. No acknowledgement says which try it answers.

    Try, acknowledgement, try, acknowledgement: no frame is under way. Try, try, acknowledgement:
    the first one may have been lost, or it may come later, so the next command meets a fence.

    :param before: acknowledgements that its kind had got before.
    :ivar counted: acknowledgements that are known to be its own.
    :ivar in_step: whether each try, and each frame under way before, was answered before the next
        try, and none twice: then none of them is under way, though none is known to be its own.
    :ivar has_restarted: whether the device has restarted meanwhile.
    """

    before: int
    counted: int = 0
    in_step: bool = True
    has_restarted: bool = False


class Attempt(Generic[S]):
    """
    One command, its acknowledgement, and the statuses since. No I/O; times are s.

    It serves requests, each of which ends by its own values: :meth:`reported` and :meth:`poll`
    return those that have ended. It is over when :attr:`serves` is empty.

    :param change: everything that the command sets.
    :param goal: the values, and how it is sent.
    :param parts: the requests that it serves, and the part of the change that each asked for.
    :param gap: the time between the last two statuses, None if none has ever come.
    :ivar began: when it was sent first.
    """

    def __init__(
        self, target: Target, change: Change[S], goal: Goal, parts: Mapping[Request, Change[S]],
        now: float, *, fence: Fence = NO_FENCE, gap: float | None = None,
    ) -> None:
        self.change = change
        self.goal = goal
        self.began = now
        self._parts: dict[Request, Change[S]] = {}
        self._sending = (Sending.AT_THE_END if goal.is_final else
                         Sending.UNTIL_SHOWN if goal.insists else change.sending)
        self._target = target
        self._fence = fence
        self._gap = gap
        # The end of the command protocol, which explains the result.
        self._outcome: CommandResult | None = None
        # The last status that counts and shows something else.
        self._instead: S | None = None
        self._ends_at = self._repeat_due = math.inf
        self._status_retries = Retries(STATUS, math.inf)
        self._received = Received(self._acknowledgements())
        self.serve(parts)
        self._send(now)

    # The requests

    @property
    def serves(self) -> list[Request]:
        """Return the open requests that it serves."""
        return [one for one in self._parts if one.is_open]

    def serve(self, parts: Mapping[Request, Change[S]]) -> None:
        """Serve requests that were made before the command was sent."""
        for one, change in parts.items():
            one.is_served = True
            self._parts[one] = change

    # The command

    def _send(self, now: float, tried: int = 0) -> None:
        """
        Send the command by the command protocol, which tries again until it is acknowledged.

        Where more tries are due whatever the device answers, each is sent once.
        """
        change, target, sending = self.change, self._target, self._sending
        self._received.in_step &= not tried or self._are_all_answered(tried)
        is_fenced, is_single = now < self._fence.ends_at, sending is Sending.ONCE
        is_repeated = not is_single and (sending.insists or is_fenced or self._is_accepted)
        self._repeat_due = math.inf
        if is_repeated:
            is_slow = sending is Sending.UNTIL_SHOWN and tried >= REPEAT.tries
            policy = (CLOSING if sending is Sending.AT_THE_END else
                      SLOW_REPEAT if is_slow else REPEAT)
            self._repeat_due = now + policy.first
            if is_fenced:
                self._repeat_due = min(self._repeat_due, self._fence.ends_at)
        elif is_fenced:
            self._ends_at = self._fence.ends_at + CONFIRMATION_TIMEOUT
            self._status_retries = Retries(STATUS, self._fence.ends_at, 1)
        self._transmission = target.commands.start(
            Command(target.address, change.command, change.params, position=change.position),
            now, self._answered, deadline=self._limit, retries=0 if is_repeated or is_single
            else None, tried=tried, follow_up=target.status_request)

    @property
    def _limit(self) -> float:
        """Return when it ends even if the device still reports progress."""
        return (math.inf if self._sending.insists
                else min(self.goal.deadline, self.began + PROGRESS_LIMIT))

    @property
    def last_sent(self) -> float:
        """When it was sent last, s."""
        return self._transmission.last_sent

    def unanswered(self, *, is_shown: bool) -> int:
        """
        Return how many tries, or the answers to them, may still be under way.

        :param is_shown: whether a status has shown the change, so that one try has arrived.
        """
        tries = self._transmission.tries
        if self._are_all_answered(tries):
            return 0
        # Else the status may show an earlier try of an equal value.
        has_arrived = is_shown and self._fence.proof is not Proof.ACKNOWLEDGED
        return max(tries - max(self._received.counted, int(has_arrived)), 0)

    def _are_all_answered(self, tries: int) -> bool:
        """Return whether each frame so far was answered before the next one, none twice."""
        got = self._acknowledgements() - self._received.before
        return self._received.in_step and got == self._fence.frames + tries

    def _acknowledgements(self) -> int:
        target = self._target
        return target.commands.answers.get((target.address, self.change.command), 0)

    def restarted(self, status: S, now: float) -> None:
        """
        Send it again: the device has restarted, and nothing from before counts.

        :param status: the first since then.
        """
        self._received.has_restarted = True
        if self._sending is not Sending.ONCE:
            fence, is_hurried = self._fence, self.goal.deadline <= now + FENCE
            may_be_others = now < fence.ends_at and fence.proof is Proof.NOTHING
            self._fence = Fence(now + FENCE, proof=Proof.ACKNOWLEDGED if (
                is_hurried and not may_be_others and self.change.shown_by(status) is False
            ) else Proof.NOTHING)
            self._outcome = self._instead = None
            self._ends_at = math.inf
            self._status_retries.stop()
            self._send(now, self._transmission.tries)

    def withdraw(self, now: float) -> None:
        """Send it no more; its requests stay open."""
        self._target.commands.cancel(self._transmission, now)
        for one in self._parts:
            one.is_served = False

    # The acknowledgement

    @property
    def _is_accepted(self) -> bool:
        return self._outcome is not None and self._outcome.accepted

    def _answered(self, answer: CommandResult, now: float) -> None:
        if answer.status is CommandStatus.ANSWERED:
            # Within the fence it may be the answer to an earlier command. It counts where no call
            # waits for the result: one lost answer would otherwise slow down a stream for ever.
            is_fenced = now < self._fence.ends_at
            if not (is_fenced and self.goal.is_awaited):
                self._received.counted += 1
            if is_fenced or self._outcome is not None and not self._sending.insists:
                return
            if self._outcome is None:
                self._ends_at = now + CONFIRMATION_TIMEOUT
                self._status_retries = Retries(STATUS, now + STATUS.first, 1)
            self._outcome = answer
            if self._target.status_id is None or answer.refused and self._gap is None:
                self._ends_at = now
        elif answer.status is CommandStatus.NO_ANSWER:
            # A single try is followed by others.
            if self._repeat_due == math.inf:
                self._outcome = answer
                self._ends_at = self.last_sent + CONFIRMATION_TIMEOUT
        elif answer.status is not CommandStatus.CANCELLED:
            self._outcome = answer
            self._ends_at = now
        self._target.wake(self.due)

    # The status

    def _counts(self, status: S, now: float) -> bool:
        """Return whether a status was sent after the command, as far as known."""
        transmission, sending, proof = self._transmission, self._sending, self._fence.proof
        if now < self._fence.ends_at:
            if sending is Sending.AT_THE_END:
                return transmission.tries >= ENOUGH_TRIES
            is_enough = proof is Proof.STATUS or (
                proof is Proof.ACKNOWLEDGED and transmission.result is not None)
            return is_enough and self.change.shown_by(status) is True
        if sending is not Sending.ONCE and transmission.first_sent < self._fence.ends_at:
            # This turn is late: the try at the end of the fence is still due.
            return False
        is_answered = transmission.result is not None or self._outcome is not None
        return is_answered or (
            transmission.tries >= ENOUGH_TRIES if sending.insists else transmission.is_last_try)

    def reported(self, status: S, gap: float, now: float) -> list[Served[S]]:
        """
        Receive a status that is not older than those before.

        :param gap: since the one before.
        :return: the requests that have ended.
        """
        self._gap = gap
        if not self._counts(status, now):
            return []
        ended = []
        for one in self.serves:
            part = self._parts[one]
            shown = part.shown_by(status)
            if shown or shown is None and self._is_accepted:
                ended.append(Served(one, part, self._shown(part, status, one, now), status))
                del self._parts[one]
            elif shown is False:
                self._instead = status
        if self._parts and not self._sending.insists:
            if self._outcome is not None and self._outcome.refused:
                return ended + self._expired(now)
            if (self._is_accepted and self._sending is Sending.UNTIL_OBEYED
                    and self._repeat_due == math.inf):
                self._repeat_due = self.last_sent + REPEAT.first
        return ended

    # Time

    def poll(self, now: float) -> list[Served[S]]:
        """Send what is due, or end; return the requests that have ended."""
        if now >= self._end:
            return self._expired(now)
        ended = [self._failed(one, now) for one in self.serves if now >= one.deadline]
        if now >= self._repeat_due:
            self._send(now, self._transmission.tries)
        if self._status_retries.begin_try(now) and (request := self._target.status_request):
            self._target.commands.send_once(request)
        return ended

    @property
    def _end(self) -> float:
        """Return when it ends without success, s."""
        if not self._sending.insists:
            return min(self._ends_at, self._limit)
        is_over = self._outcome is not None and self._outcome.status in ENDS_REPEATING
        return self._ends_at if is_over else math.inf

    @property
    def due(self) -> float:
        """Return when :meth:`poll` has something to do, s."""
        return min(self._end, self._repeat_due, self._status_retries.due,
                   *(one.deadline for one in self.serves))

    # The result

    def _protocol(self) -> CommandResult:
        """Return the end of the command protocol, or how far it has come."""
        transmission = self._transmission
        unfinished = (CommandStatus.NO_ANSWER if transmission.result is None
                      else CommandStatus.OUT_OF_TIME)
        return self._outcome or CommandResult(
            unfinished, transmission.result, progress=transmission.progress)

    def failure(self) -> str:
        """Return why it is not confirmed so far, for people; '' if nothing has come."""
        answer = self._outcome
        if answer is None or answer.refused:
            return '' if answer is None else answer.describe_failure()
        shown = self._shown_instead(self.change)
        return (f'{self.change.label} not confirmed: {answer.describe()}'
                f'{shown and ", but " + shown}')

    def _shown_instead(self, part: Change[S]) -> str:
        if self._instead is None:
            return ''
        return f'{self._target.status_name} shows {part.actual(self._instead)}'

    def _shown(self, part: Change[S], status: S, one: Request, now: float) -> Result:
        answer = self._protocol()
        evidence = (part.evidence(status) if part.evidence else
                    f'confirmed by {self._target.status_name}')
        return self._result(
            f'{part.label}, {evidence}' + (
                ', without an acknowledgement' if answer.result is None
                else f': {result_name(answer.result)}'), one, now, success=True, note=part.note)

    def _expired(self, now: float) -> list[Served[S]]:
        """Return the end of all requests that are left."""
        return [self._failed(one, now) for one in self.serves]

    def _failed(self, one: Request, now: float) -> Served[S]:
        """Return the end of a request that no status shows in time."""
        part = self._parts.pop(one)
        return Served(one, part, self._failed_result(part, one, now))

    def _failed_result(self, part: Change[S], one: Request, now: float) -> Result:
        target, answer, shown = self._target, self._outcome, self._shown_instead(part)
        if answer is None and now < self._fence.ends_at:
            text = ('' if self._received.has_restarted
                    else ': an earlier command may still be under way')
            return self._result(f'{part.label} not confirmed{text}', one, now)
        if answer is None or not (answer.accepted or answer.refused):
            return self._result(
                self._protocol().describe() + (f', and {shown}' if shown else ''), one, now,
                superseded=answer is not None and answer.status is CommandStatus.CLOSED)
        if answer.refused:
            return self._result(answer.describe_failure(), one, now, refused=True,
                                permanent=answer.result in PERMANENT_RESULTS)
        if target.status_id is None:
            return self._result(answer.describe(), one, now, success=True, note=part.note)
        if self._gap is None and not target.needs_status:
            return self._result(
                f'{part.label}, accepted, not confirmed (the {target.kind} sends no '
                f'{target.status_name}): {answer.describe()}', one, now, success=True,
                note=part.note)
        if shown:
            reason = f', but {shown}'
        elif self._gap is not None and self._gap > CONFIRMATION_TIMEOUT:
            reason = f'; its next status is due within {math.ceil(self._gap)} s'
        else:
            reason = (f', but no {target.status_name} came within '
                      f'{format_seconds(CONFIRMATION_TIMEOUT)}')
        return self._result(f'{part.label} not confirmed: {answer.describe()}{reason}', one, now,
                            contradicted=bool(shown))

    def _result(
        self, text: str, one: Request, now: float, *, success: bool = False, note: str = '',
        **flags: bool,
    ) -> Result:
        if self._outcome is not None and self._outcome.status is CommandStatus.CLOSED:
            return Result(False, text, superseded=True)
        if self._received.has_restarted:
            text += f'; the {self._target.kind} restarted meanwhile'
        took = timing(self._transmission.tries, now - one.since)
        return Result(success, f'{text} ({took})', note=note, **flags)
