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
One command that changes a device: its acknowledgement, and the status that shows the change.

MAV_RESULT_ACCEPTED says that the command is valid and is executed, not that it is completed
(command protocol). So an attempt waits for a status, and requests one if none follows within
:data:`ASK_DELAY`. Only a status that was sent after the command and shows the change makes the
attempt a success. A :class:`LastChange` is sent until a status shows it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
import math
from typing import Generic, NamedTuple, Protocol, TypeVar

from ..mavlink import command_sender
from ..mavlink.dialect import MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME, mavlink
from ..mavlink.messages import Address

# s from the acknowledgement to the status that shows the change.
CONFIRMATION_TIMEOUT = 1.0
# s from the acknowledgement to the first request for the status: many devices send a status by
# themselves, in the next datagram. ASK_INTERVAL, s, separates further requests, since a request or
# its answer may be lost.
ASK_DELAY = 0.001
ASK_INTERVAL = 0.25
# s from a status that may be older than the command to the next request, doubled each time: it may
# have been sent in the same millisecond as the command.
OUTDATED_INTERVAL = 0.001
# s between the commands of a last change, and from a status that is too old for it to the request
# for the next one.
LAST_CHANGE_INTERVAL = 0.1
LAST_CHANGE_ASK_INTERVAL = 0.005
# s by which the statuses of a device without a clock may be late, until that is measured.
UNKNOWN_DELAY = 0.75
# The last delays of statuses, from which the next delay is estimated.
MAX_DELAYS = 8

PERMANENT_RESULTS = frozenset((
    mavlink.MAV_RESULT_DENIED, mavlink.MAV_RESULT_UNSUPPORTED,
    MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME,
    mavlink.MAV_RESULT_COMMAND_LONG_ONLY, mavlink.MAV_RESULT_COMMAND_INT_ONLY))

S = TypeVar('S')
S_contra = TypeVar('S_contra', contravariant=True)


class Target:
    """
    The device that commands go to.

    :param ended: called with the result of each command, after its own ``done``.
    :param kind: a noun for it, such as ``light``.
    :param status_id: the message id of its status, None if no status shows what the commands
        change: then the acknowledgement decides.
    :param status_source: the component that sends the status, if another one executes commands.
    :param needs_status: whether only a status makes a change a success, even if none has ever
        come.
    """

    def __init__(
        self, address: Address, commands: command_sender.CommandSender,
        ended: command_sender.Done = lambda result, now: None, *, kind: str,
        status_id: int | None = None, status_name: str = '',
        status_source: Address | None = None, needs_status: bool = False,
    ) -> None:
        self.address = address
        self.needs_status = needs_status
        self.commands = commands
        self.kind = kind
        self.has_status = status_id is not None
        self.status_name = status_name
        self._status_source = status_source or address
        self._ended = ended
        self._status_id = status_id or 0
        self._status_request: command_sender.Command | None = None
        self._delays: list[float] = []

    def command(self, change: Change[S]) -> command_sender.Command:
        """Return the command that makes a change of the device."""
        return command_sender.Command(
            self.address, change.command, change.params, position=change.position)

    def send(
        self, command: int, params: tuple[float, ...], now: float,
        done: command_sender.Done = lambda result, now: None, *, to: Address | None = None,
    ) -> None:
        """Send a command, to the device or to another component."""
        self.start(command_sender.Command(to or self.address, command, params), now, done)

    def start(
        self, command: command_sender.Command, now: float, done: command_sender.Done, *,
        deadline: float = math.inf, overtake: bool = False,
    ) -> None:
        """Start a command; see :meth:`CommandSender.start`."""
        def ended(result: command_sender.CommandResult, now: float) -> None:
            done(result, now)
            self._ended(result, now)

        self.commands.start(command, now, ended, deadline=deadline, overtake=overtake)

    def request_message(
        self, message_id: int, now: float, done: command_sender.Done = lambda result, now: None, *,
        to: Address | None = None,
    ) -> None:
        """Request one message of the device or of another component."""
        self.send(mavlink.MAV_CMD_REQUEST_MESSAGE, (float(message_id),), now, done, to=to)

    def request_status(self, now: float) -> None:
        """Request the status, unless such a request is under way."""
        if self._status_request is None:
            self._status_request = command_sender.Command(
                self._status_source, mavlink.MAV_CMD_REQUEST_MESSAGE, (float(self._status_id),))
            self.start(self._status_request, now, self._status_answered)

    def cancel_status_request(self, now: float) -> None:
        """Cancel a request for the status, so that a new one is sent at once."""
        if self._status_request is not None:
            self.commands.cancel(self._status_request, now)

    def _status_answered(self, result: command_sender.CommandResult, now: float) -> None:
        self._status_request = None

    def status_delay(self, now: float, *, has_clock: bool) -> float:
        """
        Return by how much a status may be late, s.

        :param has_clock: whether its sending time was computed from a time in the status.
        """
        if has_clock:
            return self.commands.round_trip(self.address).shortest(now)
        return 1.25 * max(self._delays) + 0.05 if self._delays else UNKNOWN_DELAY

    def note_status_delay(self, seconds: float) -> None:
        """Note the time from a command to the first status that showed the change."""
        # A longer time is not a delay of the status: the acknowledgement was late, or this process
        # paused.
        self._delays = [*self._delays[1 - MAX_DELAYS:], min(seconds, CONFIRMATION_TIMEOUT)]


@dataclass
class StatusReport(Generic[S]):
    """
    A status that is newer than all before.

    :param sent_by: the latest time at which it can have been sent, s.
    :param has_clock: whether that was computed from a time in the status.
    :param shared_address: whether several devices send from the address; then no status confirms
        a change.
    """

    status: S
    sent_by: float
    has_clock: bool = True
    shared_address: bool = False


class Change(Protocol[S_contra]):
    """A value of a property of a device, and the command that sets it."""

    @property
    def command(self) -> int:
        """Return the MAV_CMD that makes it."""

    @property
    def params(self) -> tuple[float, ...]:
        """Return the params of the command."""

    @property
    def position(self) -> command_sender.Position | None:
        """Return the position of the command, which makes it a COMMAND_INT; None for none."""

    @property
    def goal(self) -> str:
        """Describe the state to be reached, for people."""

    @property
    def note(self) -> str:
        """Describe a change that was not requested but comes with it, '' if there is none."""

    def shown_by(self, status: S_contra) -> bool | None:
        """Return whether a status shows the change; None if it cannot show it."""

    def evidence(self, status: S_contra) -> str:
        """Describe how far a status that does not contradict shows the change, for people."""

    def actual(self, status: S_contra) -> str:
        """Describe the state that a status shows instead, for people."""


class Result(NamedTuple):
    """
    The outcome of a request.

    :param success: whether the device accepted it and, if it sends a status, shows it.
    :param message: the outcome for people.
    :param refused: whether the device answered with another result than ACCEPTED.
    :param permanent: whether the same request will fail again.
    :param contradicted: whether the device accepted it and then showed something else.
    :param superseded: whether a newer request replaced it.
    :param note: a change that was not asked for but came with it, for people, '' if none.
    """

    success: bool
    message: str
    refused: bool = False
    permanent: bool = False
    contradicted: bool = False
    superseded: bool = False
    note: str = ''


Done = Callable[[Result, float], None]


class Phase(Enum):
    """The phase of an attempt: SENT waits for the acknowledgement, CONFIRMING for the status."""

    SENT = 'sent'
    CONFIRMING = 'confirming'
    FINISHED = 'finished'


class Step(Enum):
    """An event that moves an attempt to another phase."""

    ACKNOWLEDGED = 'acknowledged'
    SEND_AGAIN = 'send again'
    FINISH = 'finish'


TRANSITIONS: dict[tuple[Phase, Step], Phase] = {
    (Phase.SENT, Step.ACKNOWLEDGED): Phase.CONFIRMING,
    (Phase.SENT, Step.SEND_AGAIN): Phase.SENT,
    (Phase.SENT, Step.FINISH): Phase.FINISHED,
    (Phase.CONFIRMING, Step.FINISH): Phase.FINISHED,
}


class Verdict(Enum):
    """The relation of a status to a change."""

    SHOWN = 'shown'
    CONTRADICTED = 'contradicted'
    OUTDATED = 'may be older than the command'


class Evidence(Generic[S]):
    """
    The statuses since a command, compared with its change.

    :param before: the newest status when the command was sent, None if there was none.
    :ivar sent_at: only a status that was sent later than this time, s, is evidence.
    :ivar was_repeated: whether a status may show an earlier command of the attempt.
    :ivar delay: by how much the last status may have been late, s.
    :ivar contradiction: why the last status does not confirm the change, '' if it does.
    :ivar is_outdated: whether a status may have been older than the command.
    """

    def __init__(self, target: Target, change: Change[S], before: S | None = None) -> None:
        self.sent_at = math.inf
        self.was_repeated = False
        self.delay = 0.0
        self.contradiction = ''
        self.is_outdated = False
        self._target = target
        self._change = change
        self._differs_before = before is not None and change.shown_by(before) is False

    def judge(self, report: StatusReport[S], now: float, *, is_accepted: bool) -> Verdict:
        """
        Compare a status that has just come.

        :param is_accepted: whether the device has accepted the command, which decides where the
            status cannot show the change.
        """
        target, change = self._target, self._change
        self.delay = target.status_delay(now, has_clock=report.has_clock)
        shown = change.shown_by(report.status)
        if shown is None:
            shown = is_accepted
        if shown and self._differs_before and not self.was_repeated:
            self._differs_before = False
            target.note_status_delay(now - self.sent_at)
        if report.sent_by - self.delay < self.sent_at:
            # With a late acknowledgement, a status from before the command would even confirm a
            # change that was never made.
            self.is_outdated = True
            return Verdict.OUTDATED
        reasons = [] if shown else [
            f'{target.status_name} shows {change.actual(report.status)}']
        if report.shared_address:
            reasons.append(f'several {target.kind}s answer as {target.address}')
        self.contradiction = ', '.join(reasons)
        return Verdict.CONTRADICTED if reasons else Verdict.SHOWN


class Attempt(Generic[S]):
    """
    One command of a change, and its confirmation.

    It has 16 fields: the change with its limits, and a time for each step until the confirmation.

    :param ended: called once, with the result and the status that shows the change, None if none
        did; not called after :meth:`abandon`.
    :param wanted_at: when the change was first wanted, s.
    :param deadline: the time by which the attempt ends, s.
    :param overtake: whether the command is sent beside one of its kind that is in progress.
    :param before: the newest status, None if there is none.
    """

    def __init__(
        self, target: Target, change: Change[S],
        ended: Callable[[Result, S | None, float], None], *, wanted_at: float, deadline: float,
        overtake: bool, before: S | None,
    ) -> None:
        self.phase = Phase.SENT
        self.change = change
        self._target = target
        self._ended = ended
        self._wanted_at = wanted_at
        self._deadline = deadline
        self._command = target.command(change)
        self._evidence = Evidence(target, change, before)
        self._has_status = before is not None
        # How often it must be sent again, since acknowledgements of an earlier command may come.
        self._repeats: int | None = None
        self._outcome: command_sender.CommandResult | None = None
        self._acknowledged_at = self._confirm_until = self._ask_at = math.inf
        self._outdated_wait = OUTDATED_INTERVAL
        self._overtake = overtake

    @property
    def is_accepted(self) -> bool:
        """Whether the device has accepted, and the status is awaited."""
        return self.phase is Phase.CONFIRMING and self._answer.accepted

    @property
    def _answer(self) -> command_sender.CommandResult:
        assert self._outcome is not None
        return self._outcome

    def send(self, now: float) -> None:
        """Send the command."""
        # A status from before the last repeat may show a change that an earlier command still
        # undoes.
        self._evidence.sent_at = now
        self._target.start(self._command, now, self._answered, deadline=self._deadline,
                           overtake=self._overtake)

    def stop_resending(self, now: float) -> None:
        """Resend the command no more; it may still be answered."""
        self._target.commands.stop_resending(
            now, self._target.address, lambda command: command is self._command)

    def end_command(self, now: float, status: command_sender.CommandStatus) -> None:
        """End the command if it is not acknowledged yet."""
        self._target.commands.end_all(
            now, status, self._target.address, lambda command: command is self._command)

    def abandon(self) -> None:
        """End without a result."""
        if self.phase is not Phase.FINISHED:
            self.phase = TRANSITIONS[self.phase, Step.FINISH]

    def _answered(self, outcome: command_sender.CommandResult, now: float) -> None:
        if self.phase is Phase.FINISHED:
            return
        self._outcome = outcome
        accepted = outcome.accepted
        if outcome.status is command_sender.CommandStatus.CLOSED:
            self._finish(Result(False, outcome.status.value, superseded=True), None, now)
        elif accepted and self._must_repeat(outcome, now):
            self.phase = TRANSITIONS[self.phase, Step.SEND_AGAIN]
            self.send(now)
        elif self._target.has_status and (accepted or outcome.may_answer_earlier(now)):
            self.phase = TRANSITIONS[self.phase, Step.ACKNOWLEDGED]
            self._acknowledged_at = now
            self._confirm_until = min(now + CONFIRMATION_TIMEOUT, self._deadline)
            self._ask_at = now + ASK_DELAY
        elif accepted:
            self._end(outcome.describe(), now, success=True)
        else:
            self._refused(now)

    def _must_repeat(self, outcome: command_sender.CommandResult, now: float) -> bool:
        """
        Return whether the acknowledgement may belong to an earlier, unacknowledged command.

        The earlier command may be executed only now and undo this one, and this one may be lost.
        So this one is sent until there are more acknowledgements than tries of the earlier
        command.
        """
        if self._repeats is None:
            earlier = outcome.earlier
            self._repeats = 0
            if (earlier is not None and earlier.result is None
                    and earlier.command != self._command
                    and outcome.may_answer_earlier(now)):
                self._repeats = earlier.tries
        self._repeats -= 1
        self._evidence.was_repeated |= self._repeats >= 0
        return self._repeats >= 0

    def reported(self, report: StatusReport[S], now: float) -> None:
        """Take a status that is newer than all before."""
        self._has_status = True
        if self.phase is not Phase.CONFIRMING:
            return
        verdict = self._evidence.judge(report, now, is_accepted=self.is_accepted)
        self._confirm_until = max(self._confirm_until, min(
            self._acknowledged_at + self._evidence.delay + ASK_INTERVAL, self._deadline))
        if verdict is Verdict.SHOWN:
            self._succeed(self.change.evidence(report.status), now, report.status)
        elif verdict is Verdict.OUTDATED:
            self._ask_at = min(self._ask_at, now + self._outdated_wait)
            self._outdated_wait *= 2
        elif not self.is_accepted and now >= self._acknowledged_at + ASK_INTERVAL:
            self._unconfirmed(now)

    def poll(self, now: float) -> None:
        """Request the status, or end."""
        if self.phase is not Phase.CONFIRMING:
            return
        if now >= self._confirm_until:
            self._unconfirmed(now)
        elif now >= self._ask_at:
            self._ask_at = now + ASK_INTERVAL
            self._target.request_status(now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""
        return (min(self._confirm_until, self._ask_at) if self.phase is Phase.CONFIRMING
                else math.inf)

    # The end

    def _refused(self, now: float) -> None:
        answer, goal = self._answer, self.change.goal
        if self._evidence.was_repeated and answer.result is None:
            self._end(f'{goal} not confirmed: the acknowledgement may belong to an earlier '
                      'command', now)
            return
        text, earlier = answer.describe_failure(), answer.earlier
        # No status has decided whose acknowledgement it is.
        if (self.phase is Phase.CONFIRMING and earlier and earlier.is_doubtful
                and earlier.command != self._command):
            text = (f'{goal} not confirmed: {answer.describe()}, which may belong to an earlier '
                    'command')
        self._end(text, now, refused=answer.refused,
                  permanent=answer.refused and answer.result in PERMANENT_RESULTS)

    def _unconfirmed(self, now: float) -> None:
        target, evidence = self._target, self._evidence
        if not self.is_accepted:
            self._refused(now)
        elif not (self._has_status or target.needs_status):
            self._succeed(f'accepted, not confirmed (the {target.kind} sends no '
                          f'{target.status_name})', now)
        else:
            reason = evidence.contradiction or (
                f'no {"later " if evidence.is_outdated else ""}{target.status_name} came within '
                f'{command_sender.format_seconds(now - self._acknowledged_at)}')
            self._end(f'{self.change.goal} not confirmed: {self._answer.describe()}, but {reason}',
                      now, contradicted=bool(evidence.contradiction))

    def _succeed(self, how: str, now: float, status: S | None = None) -> None:
        answer = self._answer.describe()
        if not self.is_accepted:
            answer = f'the status decides, since {answer} may belong to an earlier command'
        self._end(f'{self.change.goal}, {how}: {answer}', now, status, success=True,
                  note=self.change.note)

    def _end(
        self, text: str, now: float, status: S | None = None, *, success: bool = False,
        note: str = '', **flags: bool,
    ) -> None:
        timing = self._answer.timing(now - self._wanted_at)
        self._finish(Result(success, f'{text} ({timing})', note=note, **flags), status, now)

    def _finish(self, result: Result, status: S | None, now: float) -> None:
        self.phase = TRANSITIONS[self.phase, Step.FINISH]
        self._ended(result, status, now)


class LastChange(Generic[S]):
    """
    The last change of a device before the process ends. No I/O; times are s.

    It is made again whenever the device does not have it. Unlike an :class:`Attempt` it needs no
    acknowledgement: no later command of ours can undo it. Only a status that was sent after the
    first try shows it.

    :param report: called with a failure that is not permanent when the first command is sent and
        when one has failed, and with a success or a permanent failure when no other command is
        necessary.
    :param counts_from: the time until which an earlier command may still reach the device and undo
        the change: only a later status shows it.
    """

    def __init__(
        self, target: Target, change: Change[S], report: Done, *, counts_from: float = -math.inf,
    ) -> None:
        self._target = target
        self._change = change
        self._report = report
        self._counts_from = counts_from
        self._begun_at = math.inf
        self._evidence = Evidence(target, change)
        self._send_due = self._ask_due = -math.inf
        self._is_under_way = self._is_confirmed = False

    def _answered(self, outcome: command_sender.CommandResult, now: float) -> None:
        self._is_under_way = False
        if self._is_confirmed:
            return
        text = f'{outcome.describe_failure()} ({outcome.timing()})'
        is_permanent = outcome.refused and outcome.result in PERMANENT_RESULTS
        if is_permanent:
            self._send_due = self._ask_due = math.inf
        elif outcome.accepted:
            self._ask_due = now
            text = f'{self._change.goal} not confirmed: {outcome}'
        self._report(Result(False, text, permanent=is_permanent), now)

    def reported(self, report: StatusReport[S], now: float) -> None:
        """Take a status that is newer than all before."""
        verdict = self._evidence.judge(report, now, is_accepted=False)
        if verdict is Verdict.OUTDATED:
            self._ask_due = min(self._ask_due, now + LAST_CHANGE_ASK_INTERVAL)
        elif verdict is Verdict.CONTRADICTED and self._is_confirmed:
            self._is_confirmed = False
            self._send_due = now
            self._report(Result(False, self._evidence.contradiction), now)
        elif verdict is Verdict.SHOWN and not self._is_confirmed:
            self._is_confirmed = True
            self._send_due = self._ask_due = math.inf
            took = command_sender.format_seconds(now - self._begun_at)
            self._report(Result(True, (
                f'{self._change.goal}, {self._change.evidence(report.status)} ({took})')), now)

    def poll(self, now: float) -> None:
        """Send the command or ask for a status, if that is due; the device must be connected."""
        if self._begun_at == math.inf:
            self._begun_at = now
            self._evidence.sent_at = max(now, self._counts_from)
            self._report(Result(False, ''), now)
        if now >= self._send_due:
            self._send_due = now + LAST_CHANGE_INTERVAL
            if not self._is_under_way:
                self._is_under_way = True
                self._target.start(
                    self._target.command(self._change), now, self._answered, overtake=True)
        if now >= self._ask_due:
            self._ask_due = now + LAST_CHANGE_INTERVAL
            self._target.request_status(now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""
        return min(self._send_due, self._ask_due)
