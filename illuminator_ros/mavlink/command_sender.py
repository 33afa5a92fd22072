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
The sending side of the MAVLink command protocol; no I/O, and time is passed in.

https://mavlink.io/en/services/command.html: a command is resent, with ``confirmation`` counted
up, until it is acknowledged; MAV_RESULT_IN_PROGRESS lengthens the wait and ends the resending.
An acknowledgement names only the command, so one command of a kind at a time is sent to a
component, and the others wait.
"""

from __future__ import annotations

import bisect
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
import math
from typing import NamedTuple

from . import messages
from .messages import Address, MavResult, Message

# s between two reports of progress. The specification does not define it; MAVSDK also uses 3 s.
PROGRESS_TIMEOUT = 3.0
# s between tries of a command that was temporarily rejected: the first, doubling up to the last.
REJECTED_BACKOFF = (0.1, 0.8)
# Commands of one kind that may wait for one target. More are refused, so memory is bounded.
MAX_WAITING = 32
# s. A shorter time-out is unsafe on a 57,600 baud line, where another frame may be on the wire for
# 49 ms before our command and another before the answer.
MIN_TIMEOUT = 0.2
# The most round-trip times of one target, and the most targets with round-trip times.
MAX_SAMPLES = 64
MAX_TARGETS = 128
# With fewer samples than this the given time-out is used.
MIN_SAMPLES = 4
# s for which an acknowledgement, or a copy of it, may be under way.
ACK_LIFETIME = 5.0
# COMMAND_INT: x and y are degrees * 1e7 in the global frames and metres * 1e4 in the local ones.
GLOBAL_FRAMES = frozenset((0, 3, 5, 6, 10, 11))
DEGREE_SCALE, METRE_SCALE = 1e7, 1e4
# COMMAND_INT: represents NaN in x and y.
INT32_UNSET = 0x7FFFFFFF


class CommandStatus(Enum):
    """How a command ended. Each command ends in exactly one of these."""

    ANSWERED = 'answered'
    NO_ANSWER = 'no acknowledgement'
    PROGRESS_STOPPED = 'no final acknowledgement'
    OUT_OF_TIME = 'not finished in time'
    LINK_LOST = 'the link was lost'
    CANCELLED = 'cancelled'
    REFUSED_LOCALLY = 'too many commands are waiting for this component'


@dataclass(frozen=True)
class Position:
    """
    The position of a COMMAND_INT.

    :param frame: a MAV_FRAME.
    :param x: latitude, deg, in a global frame; m in a local one. NaN means "not used".
    :param y: longitude, deg, or m; NaN means "not used".
    :param z: altitude, m, as the frame defines it.
    :raises ValueError: if x or y does not fit into the message.
    """

    frame: int
    x: float
    y: float
    z: float

    def __post_init__(self) -> None:
        for value in self.scaled:
            if not -0x80000000 <= value <= INT32_UNSET:
                raise ValueError(f'a position of {self.x:g}, {self.y:g} does not fit COMMAND_INT')

    @property
    def scaled(self) -> tuple[int, int]:
        """Return x and y as COMMAND_INT carries them."""
        scale = DEGREE_SCALE if self.frame in GLOBAL_FRAMES else METRE_SCALE
        return _int32(self.x * scale), _int32(self.y * scale)


# A kind of commands: see :attr:`Command.key`.
Key = tuple[Address, int, float]


class Command(NamedTuple):
    """
    A command to one component.

    :param command: a MAV_CMD.
    :param params: param1 to param7, or to param4 where there is a position.
    :param unset: the value of the params that are not given: 0 or NaN, as the command defines.
    :param position: makes it a COMMAND_INT.
    """

    target: Address
    command: int
    params: tuple[float, ...] = ()
    unset: float = 0.0
    position: Position | None = None

    @property
    def key(self) -> Key:
        """Return the kind: commands of one kind wait for each other."""
        # As in MAVSDK: a request for one message must not wait for a request for another.
        is_request = self.command == messages.MavCmd.REQUEST_MESSAGE and self.params
        return self.target, self.command, self.params[0] if is_request else 0.0

    def message(self, tries: int, as_int: bool) -> Message:
        """Return the message of a try, counted from 0, as COMMAND_LONG or COMMAND_INT."""
        p1, p2, p3, p4, p5, p6, p7 = (
            *self.params, *(self.unset,) * (7 - len(self.params)))
        if self.position:
            (x, y), z, frame = self.position.scaled, self.position.z, self.position.frame
        elif as_int:
            # MAV_FRAME_GLOBAL: the command has no position.
            x, y, z, frame = _int32(p5), _int32(p6), p7, 0
        else:
            return messages.CommandLong(
                *self.target, self.command, min(tries, 255), p1, p2, p3, p4, p5, p6, p7)
        return messages.CommandInt(
            *self.target, frame, self.command, 0, 0, p1, p2, p3, p4, x, y, z)


class EarlierCommand(NamedTuple):
    """
    The last command of the same kind, and how it ended.

    :param result: its MAV_RESULT, None if there was no answer.
    :param ended_at: s, on the clock of the calls.
    :param tries: how often it was sent.
    :param elapsed: s, from the first sending to the end.
    :param last_ack_at: from then on an acknowledgement answers the last try, so that ``elapsed``
        was the round trip of the first; infinity where it was not one.
    """

    command: Command
    result: int | None
    ended_at: float
    tries: int = 1
    elapsed: float = 0.0
    last_ack_at: float = math.inf


class CommandResult(NamedTuple):
    """
    The one outcome of a command.

    :param result: the last MAV_RESULT received, None if there was none.
    :param tries: how often it was sent.
    :param elapsed: s, from the first sending.
    :param progress: %, the last that was reported, None where unknown.
    :param earlier: the command of the same kind that had ended before this one was answered,
        None if there was none. See :meth:`may_answer_earlier`.
    """

    status: CommandStatus
    result: int | None = None
    tries: int = 0
    elapsed: float = 0.0
    progress: int | None = None
    earlier: EarlierCommand | None = None

    @property
    def accepted(self) -> bool:
        """Whether the target acknowledged with MAV_RESULT_ACCEPTED."""
        return self.status is CommandStatus.ANSWERED and self.result == MavResult.ACCEPTED

    def may_answer_earlier(self, now: float) -> bool:
        """
        Return whether the acknowledgement may belong to the earlier command of this kind.

        That is possible if the earlier command got the same result, which may come twice, or none,
        which may still come. A status must then decide.

        :param now: when this command was answered.
        """
        return (self.status is CommandStatus.ANSWERED and self.earlier is not None
                and self.earlier.result in (None, self.result)
                and now - self.earlier.ended_at <= ACK_LIFETIME)

    def describe(self) -> str:
        """Return the outcome for people, with the name of the MAV_RESULT."""
        if self.status is CommandStatus.ANSWERED and self.result is not None:
            return messages.result_name(self.result)
        last = '' if self.result is None else f', last answer {messages.result_name(self.result)}'
        if self.progress is not None:
            last += f' at {self.progress} %'
        return f'{self.status.value}{last}'

    def timing(self, elapsed: float | None = None) -> str:
        """Return the number of tries and the time taken, or another time (s)."""
        time = format_seconds(self.elapsed if elapsed is None else elapsed)
        return f'{plural(self.tries, "try", "tries")}, {time}'

    def __str__(self) -> str:
        return f'{self.describe()} ({self.timing()})'


Done = Callable[[CommandResult, float], None]


def plural(number: int, one: str, many: str) -> str:
    """Return ``1 try`` or ``3 tries``."""
    return f'{number} {one if number == 1 else many}'


def format_seconds(seconds: float) -> str:
    """Return a duration for people: ms below a second, else s."""
    return f'{seconds * 1000:.0f} ms' if seconds < 0.9995 else f'{seconds:.2f} s'


class RttEstimator:
    """The last :data:`MAX_SAMPLES` round-trip times of one target, s."""

    def __init__(self) -> None:
        self._ambiguous_until = -math.inf
        # Each sample, and whether it is unambiguous.
        self._samples: list[tuple[float, bool]] = []
        self._sorted: list[float] = []

    def __len__(self) -> int:
        return len(self._sorted)

    def add(self, seconds: float, now: float) -> None:
        """Add a sample, s."""
        self._samples.append((seconds, now >= self._ambiguous_until))
        bisect.insort(self._sorted, seconds)
        if len(self._samples) > MAX_SAMPLES:
            del self._sorted[bisect.bisect_left(self._sorted, self._samples.pop(0)[0])]

    def expect_ambiguous(self, now: float) -> None:
        """Note that acknowledgements may belong to an earlier try or be copies from now on."""
        self._ambiguous_until = now + ACK_LIFETIME

    def quantile(self, share: float) -> float | None:
        """Return the round-trip time that this share (0..1) does not exceed, None if unknown."""
        if not self._sorted:
            return None
        return self._sorted[min(int(share * len(self._sorted)), len(self._sorted) - 1)]

    def shortest(self, now: float) -> float:
        """
        Return a time after a command within which no answer to it can come, s.

        While the line stays ambiguous its delay may change, so the last unambiguous samples may be
        outdated.

        :return: the lower quartile of the last eight unambiguous samples, or the median of all
            samples if there are none; 0 while acknowledgements are not ambiguous.
        """
        if now >= self._ambiguous_until:
            return 0.0
        unambiguous = sorted([seconds for seconds, known in self._samples if known][-8:])
        return unambiguous[len(unambiguous) // 4] if unambiguous else self.quantile(0.5) or 0.0

    def timeout(self, longest: float) -> float:
        """
        Return the wait for an acknowledgement, s: four times the 95th percentile, bounded.

        :param longest: s; the wait while fewer than :data:`MIN_SAMPLES` samples are known.
        """
        slow = self.quantile(0.95)
        if slow is None or len(self._sorted) < MIN_SAMPLES:
            return longest
        return min(max(4 * slow, MIN_TIMEOUT), longest)


class RequestState(Enum):
    """
    The state of a command that has not ended.

    SENT waits for an acknowledgement, BACKOFF to send a rejected command again, IN_PROGRESS for
    the next report of progress. WAITING was not sent, since another of its kind was.
    """

    # Enum.__hash__ is a call in Python for each lookup in the table of transitions.
    __hash__ = object.__hash__

    WAITING = 'waiting'
    SENT = 'sent'
    BACKOFF = 'backoff'
    IN_PROGRESS = 'in progress'


# The state after an acknowledgement. Results that are not here end the command.
TRANSITIONS: dict[tuple[RequestState, int], RequestState] = {
    (RequestState.SENT, MavResult.IN_PROGRESS): RequestState.IN_PROGRESS,
    (RequestState.SENT, MavResult.TEMPORARILY_REJECTED): RequestState.BACKOFF,
    (RequestState.SENT, MavResult.COMMAND_INT_ONLY): RequestState.SENT,
    (RequestState.BACKOFF, MavResult.IN_PROGRESS): RequestState.IN_PROGRESS,
    (RequestState.BACKOFF, MavResult.TEMPORARILY_REJECTED): RequestState.BACKOFF,
    (RequestState.BACKOFF, MavResult.COMMAND_INT_ONLY): RequestState.SENT,
    (RequestState.IN_PROGRESS, MavResult.IN_PROGRESS): RequestState.IN_PROGRESS,
}


@dataclass(eq=False, slots=True)
class _Request:
    command: Command
    key: Key
    done: Done
    limit: float
    state: RequestState = RequestState.WAITING
    as_int: bool = False
    tries: int = 0
    # Tries that were answered with a reason to try again: these were not lost.
    rejected: int = 0
    first_sent: float = 0.0
    last_sent: float = 0.0
    due: float = math.inf
    deadline: float = math.inf
    result: int | None = None
    progress: int | None = None

    def answers_another_try(self, result: int) -> bool:
        """
        Return whether an acknowledgement is for a try whose answer has no effect.

        A target rejects a try that arrives while it executes an earlier try or a copy of it. It
        may also refuse another COMMAND_LONG after the COMMAND_INT was sent.
        """
        if result == MavResult.COMMAND_INT_ONLY:
            return self.as_int
        return result == MavResult.TEMPORARILY_REJECTED and (
            self.state is RequestState.IN_PROGRESS or self.rejected == self.tries)


@dataclass
class CommandCounters:
    """Totals over all targets."""

    sent: int = 0
    resent: int = 0
    unanswered: int = 0


@dataclass
class CommandSender:
    """
    Sends commands to any number of components, in parallel across them.

    :param address: our own address, which acknowledgements are matched against.
    :param timeout: s, > 0: the longest wait for the acknowledgement of one try.
    :param retries: resends after the first try, >= 0.
    :ivar outgoing: messages to send, each with the address that sends it.
    :ivar unanswering: the targets whose last command got no acknowledgement, at most
        :data:`MAX_TARGETS`.
    :raises ValueError: if ``timeout`` or ``retries`` is out of its range.
    """

    address: Address
    timeout: float = 0.5
    retries: int = 3
    outgoing: deque[tuple[Address, Message]] = field(default_factory=deque)
    counters: CommandCounters = field(default_factory=CommandCounters)
    unanswering: dict[Address, None] = field(default_factory=dict)
    # In the order of sending: the sent request first, then the waiting ones.
    _requests: dict[Address, list[_Request]] = field(default_factory=dict)
    # In the order of their ends; those that ended more than ACK_LIFETIME ago do not matter.
    _earlier: dict[Key, EarlierCommand] = field(default_factory=dict)
    _round_trips: dict[Address, RttEstimator] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not (math.isfinite(self.timeout) and self.timeout > 0):
            raise ValueError(f'timeout {self.timeout} s is not above 0')
        if self.retries < 0:
            raise ValueError(f'retries {self.retries} is below 0')

    def __len__(self) -> int:
        """Return how many commands have not ended."""
        return sum(map(len, self._requests.values()))

    def send(self, message: Message) -> None:
        """Send a message that is not a command from our address."""
        self.outgoing.append((self.address, message))

    def start(
        self, command: Command, now: float, done: Done = lambda result, now: None, *,
        limit: float = math.inf, overtake: bool = False,
    ) -> None:
        """
        Send a command, or queue it behind the one of its kind that was sent.

        :param done: called once, with the outcome and the time.
        :param limit: the time by which it ends, even if it is in progress.
        :param overtake: end all commands of its kind that are not in progress, with CANCELLED, and
            send this one at once, even beside a command in progress.
        """
        if now >= limit:
            done(CommandResult(CommandStatus.OUT_OF_TIME), now)
            return
        key = command.key
        request = _Request(command, key, done, limit, as_int=command.position is not None)
        requests = self._requests.setdefault(command.target, [])
        kind = [other for other in requests if other.key == key] if requests else []
        if not kind or overtake:
            requests.append(request)
            self._begin(request, now)
            # End the waiting ones first, so that none is sent in the place of another.
            for other in reversed(kind):
                if other.state is not RequestState.IN_PROGRESS:
                    self._end(other, CommandStatus.CANCELLED, now)
        elif sum(other.state is RequestState.WAITING for other in kind) >= MAX_WAITING:
            done(CommandResult(CommandStatus.REFUSED_LOCALLY), now)
        else:
            requests.append(request)

    def cancel(self, command: Command, now: float) -> None:
        """End a command that was started with CANCELLED, if it has not ended."""
        for request in list(self._requests.get(command.target, ())):
            if request.command is command:
                self._end(request, CommandStatus.CANCELLED, now)

    def round_trip(self, target: Address) -> RttEstimator:
        """Return the round-trip times of a target's acknowledgements."""
        estimator = self._round_trips.get(target)
        return RttEstimator() if estimator is None else estimator

    def _estimator(self, target: Address) -> RttEstimator:
        """Return the estimator of a target; a new one replaces the one not used for longest."""
        estimator = self._round_trips.pop(target, None)
        if estimator is None:
            estimator = RttEstimator()
            if len(self._round_trips) >= MAX_TARGETS:
                del self._round_trips[next(iter(self._round_trips))]
        self._round_trips[target] = estimator
        return estimator

    def acknowledge(self, source: Address, ack: messages.CommandAck, now: float) -> None:
        """
        Receive a COMMAND_ACK.

        It counts if its source and command match a command that was sent, and if its target is our
        address or 0, since the extension fields may be missing. It answers the oldest of several
        commands, but progress belongs to the command in progress.
        """
        ours = self.address
        if (ack.target_system not in (0, ours.system)
                or ack.target_component not in (0, ours.component)):
            return
        self.unanswering.pop(source, None)
        is_expected = False
        for request in self._requests.get(source, ()):
            if (request.command.command == ack.command
                    and request.state is not RequestState.WAITING):
                is_expected = True
                # A rejection belongs not to a command in progress but to a command sent beside it.
                if not request.answers_another_try(ack.result):
                    self._answered(request, ack, now)
                    return
        if not is_expected and source in self._round_trips:
            self._estimator(source).expect_ambiguous(now)
            self._measure_resent(source, ack.command, now)

    def _measure_resent(self, source: Address, command: int, now: float) -> None:
        """
        Take the round trip of a command whose last try is acknowledged as late as the first was.

        An earlier acknowledgement may be a copy. Without this, each command would be sent twice
        for ever where a line has become slower than the wait for one try, since a resent command
        is not measured.
        """
        for key, earlier in self._earlier.items():
            if key[:2] == (source, command) and now >= earlier.last_ack_at:
                self._earlier[key] = earlier._replace(last_ack_at=math.inf)
                self._estimator(source).add(earlier.elapsed, now)
                return

    def _answered(self, request: _Request, ack: messages.CommandAck, now: float) -> None:
        if request.tries == 1 and request.result is None:
            # An acknowledgement after a resend may be of either try and is not measured (RFC
            # 6298).
            self._estimator(request.command.target).add(now - request.last_sent, now)
        request.result = ack.result
        state = TRANSITIONS.get((request.state, ack.result))
        if state is RequestState.IN_PROGRESS:
            request.progress = ack.progress if ack.progress <= 100 else None
            request.due = now + PROGRESS_TIMEOUT
        elif state is RequestState.BACKOFF:
            first, last = REJECTED_BACKOFF
            request.due = now + min(first * 2 ** min(request.rejected, 8), last)
            request.rejected += 1
            if request.due >= min(request.deadline, request.limit):
                # The target may be busy with a try that was never answered.
                self._end(request, CommandStatus.ANSWERED if request.rejected == request.tries
                          else CommandStatus.OUT_OF_TIME, now)
                return
        elif state is RequestState.SENT and now < request.limit:
            request.as_int = True
            request.rejected += 1
            self._transmit(request, now)
        else:
            self._end(request, CommandStatus.ANSWERED, now)
            return
        request.state = state

    def poll(self, now: float) -> None:
        """Resend or end what is due."""
        for requests in list(self._requests.values()):
            for request in list(requests):
                if request in requests and now >= min(request.due, request.limit):
                    self._overdue(request, now)

    def _overdue(self, request: _Request, now: float) -> None:
        if now >= request.limit:
            unanswered = request.state is RequestState.SENT and not request.rejected
            self._end(request, CommandStatus.NO_ANSWER if unanswered
                      else CommandStatus.OUT_OF_TIME, now)
        elif request.state is RequestState.IN_PROGRESS:
            self._end(request, CommandStatus.PROGRESS_STOPPED, now)
        elif request.tries - request.rejected > self.retries or now >= request.deadline:
            self._end(request, CommandStatus.NO_ANSWER, now)
        else:
            request.state = RequestState.SENT
            self._estimator(request.command.target).expect_ambiguous(now)
            self._transmit(request, now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do, infinity if never."""
        due = math.inf
        for requests in self._requests.values():
            for request in requests:
                due = min(due, request.due, request.limit)
        return due

    def end_all(
        self, now: float, status: CommandStatus, target: Address | None = None,
        ends: Callable[[Command], bool] = lambda command: True,
    ) -> None:
        """
        End commands that were started, to one target or to all.

        :param ends: returns whether a command ends.
        """
        requests = [request for one in self._requests.values() for request in one
                    if (target is None or request.command.target == target)
                    and ends(request.command)]
        # End the sent request last, so that no waiting one is sent in its place.
        for request in reversed(requests):
            self._end(request, status, now)

    def _begin(self, request: _Request, now: float) -> None:
        request.state = RequestState.SENT
        request.first_sent = now
        request.deadline = now + self.timeout * (self.retries + 1)
        self._transmit(request, now)

    def _transmit(self, request: _Request, now: float) -> None:
        command = request.command
        self.send(command.message(request.tries, request.as_int))
        request.tries += 1
        self.counters.sent += 1
        self.counters.resent += request.tries > 1
        request.last_sent = now
        timeout = self.round_trip(command.target).timeout(self.timeout)
        lost = request.tries - request.rejected - 1
        if lost > 0:
            timeout = min(timeout * 2 ** min(lost, 16), self.timeout)
        request.due = now + timeout

    def _end(self, request: _Request, status: CommandStatus, now: float) -> None:
        command, key = request.command, request.key
        requests = self._requests.get(command.target, [])
        if request not in requests:
            return
        requests.remove(request)
        if not requests:
            del self._requests[command.target]
        if request.state is RequestState.WAITING:
            request.done(CommandResult(status), now)
            return
        result = CommandResult(
            status, request.result, request.tries, now - request.first_sent, request.progress,
            self._earlier.pop(key, None))
        answered = status is CommandStatus.ANSWERED
        while self._earlier and now > (
                oldest := next(iter(self._earlier.values()))).ended_at + ACK_LIFETIME:
            del self._earlier[oldest.command.key]
        is_measure = answered and request.tries > 1 and not request.rejected
        between = request.last_sent - request.first_sent
        self._earlier[key] = EarlierCommand(
            command, request.result if answered else None, now, request.tries, result.elapsed,
            now + between / 2 if is_measure else math.inf)
        if status is CommandStatus.NO_ANSWER:
            self.counters.unanswered += 1
            self.unanswering[command.target] = None
            if len(self.unanswering) > MAX_TARGETS:
                del self.unanswering[next(iter(self.unanswering))]
        late = self._send_next(key, now) if requests else []
        request.done(result, now)
        for other in late:
            other.done(CommandResult(CommandStatus.OUT_OF_TIME), now)

    def _send_next(self, key: Key, now: float) -> list[_Request]:
        """Send the next command of a kind; return those whose limit has passed."""
        late = []
        requests = self._requests[key[0]]
        for request in [one for one in requests if one.key == key]:
            if request.state is not RequestState.WAITING:
                break
            if now < request.limit:
                self._begin(request, now)
                break
            requests.remove(request)
            late.append(request)
        if not requests:
            del self._requests[key[0]]
        return late


def _int32(value: float) -> int:
    return INT32_UNSET if math.isnan(value) else round(value)
