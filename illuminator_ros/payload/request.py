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
A request to a device: a command, its acknowledgement, and the status that shows the change.

MAV_RESULT_ACCEPTED says that the command is valid and is executed, not that it is completed
(command protocol). So a request waits for a status, and requests one if none follows within
:data:`ASK_DELAY`. Only a status that was sent after the command and shows the change makes the
request a success.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
import math
from typing import Generic, Protocol, TypeVar

from .attempt import Done as Done  # noqa: F401
from .attempt import Result as Result
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
# Requests that may wait for one device.
MAX_WAITING = 32
# The result of a request that was not executed, since another one overtook it.
OVERTAKEN = 'cancelled by a later request'
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
    The device that requests go to.

    :param ended: called with the result of each command, after its own ``done``.
    :param kind: a noun for it, such as ``light``.
    :param status_id: the message id of its status.
    :param status_source: the component that sends the status, if another one executes commands.
    """

    def __init__(
        self, address: Address, commands: command_sender.CommandSender,
        ended: command_sender.Done = lambda result, now: None, *, kind: str, status_id: int,
        status_name: str, status_source: Address | None = None,
    ) -> None:
        self.address = address
        self._status_source = status_source or address
        self.kind = kind
        self.status_name = status_name
        self._commands = commands
        self._ended = ended
        self._status_id = status_id
        self._status_request: command_sender.Command | None = None
        self._delays: list[float] = []

    def send(
        self, command: int, params: tuple[float, ...], now: float,
        done: command_sender.Done = lambda result, now: None, *, deadline: float = math.inf,
        overtake: bool = False, to: Address | None = None,
    ) -> None:
        """Send a command, to the device or to another component; see :class:`CommandSender`."""
        self._start(command_sender.Command(to or self.address, command, params), now, done,
                    deadline=deadline, overtake=overtake)

    def _start(
        self, command: command_sender.Command, now: float, done: command_sender.Done, *,
        deadline: float = math.inf, overtake: bool = False,
    ) -> None:
        def ended(result: command_sender.CommandResult, now: float) -> None:
            done(result, now)
            self._ended(result, now)

        self._commands.start(command, now, ended, deadline=deadline, overtake=overtake)

    def request_message(
        self, message_id: int, now: float, done: command_sender.Done = lambda result, now: None, *,
        to: Address | None = None,
    ) -> None:
        """Request one message of the device or of another component."""
        self.send(mavlink.MAV_CMD_REQUEST_MESSAGE, (float(message_id),), now, done, to=to)

    def request_status(self, now: float, done: command_sender.Done | None = None) -> None:
        """Request the status; without ``done`` only where no such request is under way."""
        if done is not None:
            self.request_message(self._status_id, now, done, to=self._status_source)
        elif self._status_request is None:
            self._status_request = command_sender.Command(
                self._status_source, mavlink.MAV_CMD_REQUEST_MESSAGE, (float(self._status_id),))
            self._start(self._status_request, now, self._status_answered)

    def cancel_status_request(self, now: float) -> None:
        """Cancel a request for the status, so that a new one is sent at once."""
        if self._status_request is not None:
            self._commands.cancel(self._status_request, now)

    def _status_answered(self, result: command_sender.CommandResult, now: float) -> None:
        self._status_request = None

    def shortest_round_trip(self, now: float) -> float:
        """See :meth:`~..mavlink.command_sender.RttEstimator.shortest`."""
        return self._commands.round_trip(self.address).shortest(now)

    @property
    def status_delay(self) -> float:
        """Return by how much a status without a time may be late, s."""
        return 1.25 * max(self._delays) + 0.05 if self._delays else UNKNOWN_DELAY

    def note_status_delay(self, seconds: float) -> None:
        """Note the time from a command to the first status that showed the change."""
        # A longer time is not a delay of the status: the acknowledgement was late, or this process
        # paused.
        self._delays = [*self._delays[1 - MAX_DELAYS:], min(seconds, CONFIRMATION_TIMEOUT)]


@dataclass(slots=True)
class StatusReport(Generic[S]):
    """
    A status that is newer than all before.

    :param sent_by: the latest time at which it can have been sent, s.
    :param has_clock: whether that was computed from a time in the status.
    :param shared_address: whether several devices send from the address.
    :param sender: which of them has sent it, as far as they can be distinguished.
    :param senders: all senders of recent statuses.
    :param span: s for which all statuses must agree so that each device has sent one.
    """

    status: S
    sent_by: float
    has_clock: bool = True
    shared_address: bool = False
    sender: int = 0
    senders: frozenset[int] = frozenset((0,))
    span: float = 0.0


class Change(Protocol[S_contra]):
    """A change of a device."""

    @property
    def command(self) -> int:
        """Return the MAV_CMD that makes it."""

    @property
    def params(self) -> tuple[float, ...]:
        """Return the params of the command."""

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


def at_any_time() -> float:
    """Return the earliest start of a request that need not wait, s."""
    return -math.inf


class Phase(Enum):
    """
    The phase of a request.

    WAITING was not sent; CONFIRMING was acknowledged, and waits for the status.
    """

    WAITING = 'waiting'
    SENT = 'sent'
    CONFIRMING = 'confirming'
    FINISHED = 'finished'


class Step(Enum):
    """An event that moves a request to another phase."""

    SEND = 'send'
    ACKNOWLEDGED = 'acknowledged'
    SEND_AGAIN = 'send again'
    FINISH = 'finish'


TRANSITIONS: dict[tuple[Phase, Step], Phase] = {
    (Phase.WAITING, Step.SEND): Phase.SENT,
    (Phase.WAITING, Step.FINISH): Phase.FINISHED,
    (Phase.SENT, Step.ACKNOWLEDGED): Phase.CONFIRMING,
    (Phase.SENT, Step.SEND_AGAIN): Phase.SENT,
    (Phase.SENT, Step.FINISH): Phase.FINISHED,
    (Phase.CONFIRMING, Step.FINISH): Phase.FINISHED,
}


class Request(Generic[S]):
    """
    A request to change the state of a device.

    :param prepare: returns the change when it is sent: requests before it may affect it.
    :param done: called once, with the result, the change and the status that shows it; None
        stands for a change that was not sent, and for a status that did not come.
    :param deadline: the time by which it ends, s.
    :param is_stream: whether it is one of a stream: a newer one replaces it while it waits.
    :param overtakes: whether its command is sent beside one of its kind that is in progress.
    :param earliest_start: returns the time before which it must not be sent, s; called at each
        poll.
    :param needs_status: whether only a status makes it a success, even if none has ever come.
    :ivar change: the change, None until it is sent.
    """

    def __init__(
        self, target: Target, prepare: Callable[[float], Change[S]],
        done: Callable[[Result, Change[S] | None, S | None, float], None], *, now: float,
        deadline: float, is_stream: bool = False, overtakes: bool = False,
        earliest_start: Callable[[], float] = at_any_time, needs_status: bool = False,
    ) -> None:
        self.phase = Phase.WAITING
        self.deadline = deadline
        self.is_stream = is_stream
        self.overtakes = overtakes
        self.earliest_start = earliest_start
        self._needs_status = needs_status
        self.change: Change[S] | None = None
        self._target = target
        self._prepare = prepare
        self._done = done
        self._submitted = now
        self._sent_at = math.inf
        # How often it must be sent again, since acknowledgements of an earlier command may come.
        self._repeats: int | None = None
        self._was_repeated = False
        self._outcome: command_sender.CommandResult | None = None
        self._before: S | None = None
        self._has_status = False
        self._acknowledged_at = self._confirm_until = self._ask_at = math.inf
        # How a status contradicts, and whether a status may be older than the command.
        self._contradiction = ''
        self._is_outdated = False
        self._outdated_wait = OUTDATED_INTERVAL
        self._shown_by: set[int] = set()
        self._shown_since = math.inf

    @property
    def is_accepted(self) -> bool:
        """Whether the device has accepted, and the status is awaited."""
        return self.phase is Phase.CONFIRMING and self._answer.accepted

    @property
    def _sent(self) -> Change[S]:
        assert self.change is not None
        return self.change

    @property
    def _answer(self) -> command_sender.CommandResult:
        assert self._outcome is not None
        return self._outcome

    def start(self, status: S | None, now: float) -> None:
        """
        Send the command.

        :param status: the newest status, None if there is none.
        """
        self._before = status
        self._has_status = status is not None
        self.change = self._prepare(now)
        self._send(Step.SEND, now)

    def _send(self, step: Step, now: float) -> None:
        self.phase = TRANSITIONS[self.phase, step]
        # A status from before the last repeat may show a change that an earlier command still
        # undoes.
        self._sent_at = now
        change = self._sent
        self._target.send(
            change.command, change.params, now, self._answered, deadline=self.deadline,
            overtake=self.overtakes)

    def _answered(self, outcome: command_sender.CommandResult, now: float) -> None:
        if self.phase is Phase.FINISHED:
            return
        self._outcome = outcome
        accepted = outcome.accepted
        if outcome.status is command_sender.CommandStatus.CANCELLED:
            self.replace(now)
        elif outcome.status is command_sender.CommandStatus.CLOSED:
            self.replace(now, outcome.status.value)
        elif accepted and self._must_repeat(outcome, now):
            self._send(Step.SEND_AGAIN, now)
        elif accepted or outcome.may_answer_earlier(now):
            self.phase = TRANSITIONS[self.phase, Step.ACKNOWLEDGED]
            self._acknowledged_at = now
            self._confirm_until = min(now + CONFIRMATION_TIMEOUT, self.deadline)
            self._ask_at = now + ASK_DELAY
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
                    and earlier.command.params != self._sent.params
                    and outcome.may_answer_earlier(now)):
                self._repeats = earlier.tries
        self._repeats -= 1
        self._was_repeated |= self._repeats >= 0
        return self._repeats >= 0

    def take(self, report: StatusReport[S], now: float) -> None:
        """
        Take a status that is newer than all before.

        A status that was sent before the command does not show its effect: with a late
        acknowledgement, it would even confirm a change that was never made.
        """
        self._has_status = True
        if self.phase is not Phase.CONFIRMING:
            return
        delay = (self._target.shortest_round_trip(now) if report.has_clock
                 else self._target.status_delay)
        change = self._sent
        shown = change.shown_by(report.status)
        if shown is None:
            # Then the acknowledgement decides.
            shown = self.is_accepted
        if (shown and not self._was_repeated and self._before is not None
                and change.shown_by(self._before) is False):
            self._target.note_status_delay(now - self._sent_at)
            self._before = None
        wait = max(delay + ASK_INTERVAL, 2 * report.span)
        self._confirm_until = max(
            self._confirm_until, min(self._acknowledged_at + wait, self.deadline))
        if report.sent_by - delay < self._sent_at:
            self._is_outdated = True
            self._ask_at = min(self._ask_at, now + self._outdated_wait)
            self._outdated_wait *= 2
        elif not shown:
            self._contradiction = f'shows {change.actual(report.status)}'
            if report.shared_address:
                self._contradiction += (f', several {self._target.kind}s '
                                        f'answer as {self._target.address}')
            self._shown_by.clear()
            self._shown_since = math.inf
            if not self.is_accepted and now >= self._acknowledged_at + ASK_INTERVAL:
                self._unconfirmed(now)
        else:
            # Each of several devices that report in turn must show it.
            self._shown_by.add(report.sender)
            self._shown_since = min(self._shown_since, now)
            if report.senders <= self._shown_by and now >= self._shown_since + report.span:
                self._succeed(change.evidence(report.status), now, report.status)

    def poll(self, now: float) -> None:
        """Request the status, or end the request."""
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

    def supersede(self, now: float) -> None:
        """End an accepted change without its confirmation: a newer one replaces it."""
        self._succeed('accepted, superseded', now, superseded=True)

    def fail(self, message: str, now: float) -> None:
        """End without a success, if it has not ended."""
        if self.phase is not Phase.FINISHED:
            self._finish(Result(False, message), now)

    def replace(self, now: float, message: str = OVERTAKEN) -> None:
        """End without a success, if it has not ended: something newer replaces it."""
        if self.phase is not Phase.FINISHED:
            self._finish(Result(False, message, superseded=True), now)

    def _refused(self, now: float) -> None:
        answer = self._answer
        if self._was_repeated and answer.result is None:
            self._end(f'{self._sent.goal} not confirmed: the acknowledgement may belong to an '
                      'earlier command', now)
        else:
            text = answer.describe_failure()
            earlier = answer.earlier
            # No status has decided whose acknowledgement it is.
            if (self.phase is Phase.CONFIRMING and earlier and earlier.is_doubtful
                    and earlier.command.params != self._sent.params):
                text = (f'{self._sent.goal} not confirmed: {answer.describe()}, which may belong '
                        'to an earlier command')
            self._end(text, now, refused=answer.refused,
                      permanent=answer.refused and answer.result in PERMANENT_RESULTS)

    def _unconfirmed(self, now: float) -> None:
        name, kind = self._target.status_name, self._target.kind
        if not self.is_accepted:
            self._refused(now)
            return
        if self._contradiction:
            reason = f'{name} {self._contradiction}'
        elif self._shown_by:
            reason = (f'not each of several {kind}s that answer as {self._target.address} has '
                      f'sent {name}')
        elif self._has_status or self._needs_status:
            reason = (f'no {"later " if self._is_outdated else ""}{name} came within '
                      f'{command_sender.format_seconds(now - self._acknowledged_at)}')
        else:
            self._succeed(f'accepted, not confirmed (the {kind} sends no {name})', now)
            return
        self._end(f'{self._sent.goal} not confirmed: {self._answer.describe()}, but {reason}', now,
                  contradicted=bool(self._contradiction))

    def _succeed(
        self, how: str, now: float, status: S | None = None, *, superseded: bool = False,
    ) -> None:
        answer = self._answer.describe()
        if not self.is_accepted:
            answer = f'the status decides, since {answer} may belong to an earlier command'
        self._end(f'{self._sent.goal}, {how}: {answer}', now, status,
                  success=True, superseded=superseded, note=self._sent.note)

    def _end(
        self, text: str, now: float, status: S | None = None, *, success: bool = False,
        note: str = '', **flags: bool,
    ) -> None:
        timing = self._answer.timing(now - self._submitted)
        self._finish(Result(success, f'{text} ({timing})', note=note, **flags), now, status)

    def _finish(self, result: Result, now: float, status: S | None = None) -> None:
        self.phase = TRANSITIONS[self.phase, Step.FINISH]
        self._done(result, self.change, status, now)


class RequestQueue(Generic[S]):
    """
    The requests of one kind to one device, in the order in which they were made.

    All of them may wait for the same time, so that the first one that waits ends first.
    """

    def __init__(self, target: Target) -> None:
        self._target = target
        self._requests: list[Request[S]] = []
        self._status: S | None = None

    @property
    def current(self) -> Request[S] | None:
        """Return the request that is under way."""
        if not self._requests or self._requests[0].phase is Phase.WAITING:
            return None
        return self._requests[0]

    @property
    def is_confirming(self) -> bool:
        """Whether a request waits for a status."""
        return bool(self._requests) and self._requests[0].phase is Phase.CONFIRMING

    def __len__(self) -> int:
        """Return how many requests are under way or wait."""
        return len(self._requests)

    def has(self, which: Callable[[Request[S]], bool]) -> bool:
        """Return whether a condition holds for a request that is under way or waits."""
        return any(map(which, self._requests))

    def submit(self, request: Request[S], now: float) -> None:
        """
        Send a request, or let it wait: behind the others, or until its earliest start.

        One that overtakes replaces those that do not, and one of a stream replaces those of a
        stream that wait.
        """
        replaced = self._remove(
            lambda one: request.overtakes and not one.overtakes
            or request.is_stream and one.is_stream and one.phase is Phase.WAITING)
        if len(self._requests) < MAX_WAITING:
            self._requests.append(request)
            self._start_next(now)
        else:
            request.fail(f'{MAX_WAITING} requests are waiting for {self._target.kind} '
                         f'{self._target.address} already', now)
        for one in replaced:
            one.replace(now)

    def cancel(
        self, message: str, now: float,
        which: Callable[[Request[S]], bool] = lambda request: True,
    ) -> None:
        """End some requests, by default all, with a message."""
        for request in self._remove(which):
            request.fail(message, now)

    def replace(self, now: float, message: str = OVERTAKEN) -> None:
        """End all requests: a request of another queue, or the end, replaces them."""
        for request in self._remove(lambda request: True):
            request.replace(now, message)

    def _remove(self, which: Callable[[Request[S]], bool]) -> list[Request[S]]:
        removed = [one for one in self._requests if which(one)]
        self._requests = [one for one in self._requests if one not in removed]
        return removed

    def take(self, report: StatusReport[S], now: float) -> None:
        """Take a status that is newer than all before."""
        self._status = report.status
        if self._requests:
            first = self._requests[0]
            first.take(report, now)
            if first.phase is Phase.FINISHED:
                self._start_next(now)

    def poll(self, now: float) -> None:
        """Do what is due, and start the next request."""
        while (late := self._first_waiting) and now >= late.deadline:
            self._requests.remove(late)
            late.fail('not sent: earlier requests took too long', now)
        if self._requests:
            self._requests[0].poll(now)
            self._start_next(now)

    def _start_next(self, now: float) -> None:
        while self._requests:
            first = self._requests[0]
            if first.phase is Phase.FINISHED:
                del self._requests[0]
            elif first.phase is Phase.WAITING and now >= first.earliest_start():
                first.start(self._status, now)
            else:
                break

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""
        if not self._requests:
            return math.inf
        first = self._requests[0]
        if first.phase is Phase.FINISHED:
            return -math.inf
        waiting = self._first_waiting
        deadline = waiting.deadline if waiting else math.inf
        return min(first.earliest_start() if waiting is first else first.next_deadline(), deadline)

    @property
    def _first_waiting(self) -> Request[S] | None:
        requests = self._requests
        if requests and requests[0].phase is Phase.WAITING:
            return requests[0]
        return requests[1] if len(requests) > 1 else None
