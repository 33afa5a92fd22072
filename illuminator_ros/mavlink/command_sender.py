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
from .dialect import mavlink
from .messages import Address, Message

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
# s between the tries of a command while the process ends, which has less than a second.
CLOSING_TIMEOUT = 0.1
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
    CLOSED = 'the bridge is ending'


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
        is_request = self.command == mavlink.MAV_CMD_REQUEST_MESSAGE and self.params
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
    :param is_doubtful: whether acknowledgements with another result than its own may still come:
        its own, if an earlier command's was taken for it, or a copy of an earlier command's.
    """

    command: Command
    result: int | None
    ended_at: float
    tries: int
    elapsed: float
    last_ack_at: float
    is_doubtful: bool


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
        return self.status is CommandStatus.ANSWERED and self.result == mavlink.MAV_RESULT_ACCEPTED

    @property
    def refused(self) -> bool:
        """Whether the target acknowledged with another MAV_RESULT."""
        return self.status is CommandStatus.ANSWERED and self.result != mavlink.MAV_RESULT_ACCEPTED

    def may_answer_earlier(self, now: float) -> bool:
        """
        Return whether the acknowledgement may belong to the earlier command of this kind.

        That is possible if the earlier command got the same result, which may come twice, or none,
        which may still come, or if its own result is doubtful. A status must then decide.

        :param now: when this command was answered.
        """
        return (self.status is CommandStatus.ANSWERED and self.earlier is not None
                and (self.earlier.is_doubtful or self.earlier.result in (None, self.result))
                and now - self.earlier.ended_at <= ACK_LIFETIME)

    def describe(self) -> str:
        """Return the outcome for people, with the name of the MAV_RESULT."""
        if self.status is CommandStatus.ANSWERED and self.result is not None:
            return messages.result_name(self.result)
        last = '' if self.result is None else f', last answer {messages.result_name(self.result)}'
        if self.progress is not None:
            last += f' at {self.progress} %'
        return f'{self.status.value}{last}'

    def describe_failure(self) -> str:
        """Return why it was not accepted, for people."""
        return f'{"refused: " if self.refused else ""}{self.describe()}'

    def timing(self, elapsed: float | None = None) -> str:
        """Return the number of tries and the time taken, or another time (s)."""
        time = format_seconds(self.elapsed if elapsed is None else elapsed)
        return f'{self.tries} {"try" if self.tries == 1 else "tries"}, {time}'

    def __str__(self) -> str:
        return f'{self.describe()} ({self.timing()})'


Done = Callable[[CommandResult, float], None]


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
        self._samples.append((seconds, not self.is_ambiguous(now)))
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

    def is_ambiguous(self, now: float) -> bool:
        """Return whether acknowledgements may belong to an earlier try or be copies."""
        return now < self._ambiguous_until

    def shortest(self, now: float) -> float:
        """
        Return a time after a command within which no answer to it can come, s.

        While the line stays ambiguous its delay may change, so the last unambiguous samples may be
        outdated.

        :return: the lower quartile of the last eight unambiguous samples, or the median of all
            samples if there are none; 0 while acknowledgements are not ambiguous.
        """
        if not self.is_ambiguous(now):
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


class CommandState(Enum):
    """
    The state of a command that has not ended.

    SENT waits for an acknowledgement, BACKOFF to send a rejected command again, IN_PROGRESS for
    the next report of progress. WAITING was not sent, since another of its kind was.
    """

    WAITING = 'waiting'
    SENT = 'sent'
    BACKOFF = 'backoff'
    IN_PROGRESS = 'in progress'


# The state after an acknowledgement. Results that are not here end the command.
TRANSITIONS: dict[tuple[CommandState, int], CommandState] = {
    (CommandState.SENT, mavlink.MAV_RESULT_IN_PROGRESS): CommandState.IN_PROGRESS,
    (CommandState.SENT, mavlink.MAV_RESULT_TEMPORARILY_REJECTED): CommandState.BACKOFF,
    (CommandState.SENT, mavlink.MAV_RESULT_COMMAND_INT_ONLY): CommandState.SENT,
    (CommandState.BACKOFF, mavlink.MAV_RESULT_IN_PROGRESS): CommandState.IN_PROGRESS,
    (CommandState.BACKOFF, mavlink.MAV_RESULT_TEMPORARILY_REJECTED): CommandState.BACKOFF,
    (CommandState.BACKOFF, mavlink.MAV_RESULT_COMMAND_INT_ONLY): CommandState.SENT,
    (CommandState.IN_PROGRESS, mavlink.MAV_RESULT_IN_PROGRESS): CommandState.IN_PROGRESS,
}


@dataclass(eq=False, slots=True)
class _PendingCommand:
    """
    A command that has not ended. Times are s.

    :param deadline: the time by which it ends.
    :param as_int: whether it is sent as COMMAND_INT.
    :param rejected: tries that were answered with a reason to try again: these were not lost.
    :param due: when it is sent again, or ends.
    :param tries_end: the time from which it is not sent again.
    """

    command: Command
    key: Key
    done: Done
    deadline: float
    as_int: bool
    state: CommandState = CommandState.WAITING
    tries: int = 0
    rejected: int = 0
    first_sent: float = 0.0
    last_sent: float = 0.0
    due: float = math.inf
    tries_end: float = math.inf
    result: int | None = None
    progress: int | None = None

    def answers_another_try(self, result: int) -> bool:
        """
        Return whether an acknowledgement is for a try whose answer has no effect.

        A target rejects a try that arrives while it executes an earlier try or a copy of it. It
        may also refuse another COMMAND_LONG after the COMMAND_INT was sent.
        """
        if result == mavlink.MAV_RESULT_COMMAND_INT_ONLY:
            return self.as_int
        return result == mavlink.MAV_RESULT_TEMPORARILY_REJECTED and (
            self.state is CommandState.IN_PROGRESS or self.rejected == self.tries)


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
    _may_send: Callable[[Command | Message], bool] | None = None
    # In the order of sending: the sent command first, then the waiting ones.
    _pending: dict[Address, list[_PendingCommand]] = field(default_factory=dict)
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
        return sum(map(len, self._pending.values()))

    def close(self, now: float, may_send: Callable[[Command | Message], bool]) -> None:
        """
        Send nothing any more that changes a device, since the process ends.

        All other commands end with CLOSED, now or when they are started, and other messages are
        dropped. A command that may still be sent is repeated until it is acknowledged.

        :param may_send: returns whether a command or message may still be sent, in addition to
            requests for messages.
        """
        self._may_send = may_send
        self.timeout = min(self.timeout, CLOSING_TIMEOUT)
        self.end_all(now, CommandStatus.CLOSED, ends=self._is_refused)

    @property
    def refusal(self) -> str:
        """Return why no device may be changed any more, for people; '' if it may be."""
        return '' if self._may_send is None else CommandStatus.CLOSED.value

    def _is_refused(self, sent: Command | Message) -> bool:
        if self._may_send is None:
            return False
        is_request = isinstance(sent, Command) and sent.command == mavlink.MAV_CMD_REQUEST_MESSAGE
        return not (is_request or self._may_send(sent))

    def send(self, message: Message) -> None:
        """Send a message that is not a command from our address."""
        if not self._is_refused(message):
            self.outgoing.append((self.address, message))

    def start(
        self, command: Command, now: float, done: Done = lambda result, now: None, *,
        deadline: float = math.inf, overtake: bool = False,
    ) -> None:
        """
        Send a command, or queue it behind the one of its kind that was sent.

        :param done: called once, with the outcome and the time.
        :param deadline: s, the time by which it ends, even if it is in progress.
        :param overtake: end all commands of its kind that are not in progress, with CANCELLED, and
            send this one at once, even beside a command in progress.
        """
        if self._is_refused(command):
            done(CommandResult(CommandStatus.CLOSED), now)
            return
        if now >= deadline:
            done(CommandResult(CommandStatus.OUT_OF_TIME), now)
            return
        key = command.key
        pending = _PendingCommand(command, key, done, deadline, command.position is not None)
        queue = self._pending.setdefault(command.target, [])
        kind = [other for other in queue if other.key == key] if queue else []
        if not kind or overtake:
            queue.append(pending)
            self._begin(pending, now)
            # End the waiting ones first, so that none is sent in the place of another.
            for other in reversed(kind):
                if other.state is not CommandState.IN_PROGRESS:
                    self._end(other, CommandStatus.CANCELLED, now)
        elif sum(other.state is CommandState.WAITING for other in kind) >= MAX_WAITING:
            done(CommandResult(CommandStatus.REFUSED_LOCALLY), now)
        else:
            queue.append(pending)

    def cancel(self, command: Command, now: float) -> None:
        """End a command that was started with CANCELLED, if it has not ended."""
        self.end_all(now, CommandStatus.CANCELLED, command.target, lambda one: one is command)

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
        if not messages.target_of(ack).includes(self.address):
            return
        self.unanswering.pop(source, None)
        is_expected = False
        for pending in self._pending.get(source, ()):
            if (pending.command.command == ack.command
                    and pending.state is not CommandState.WAITING):
                is_expected = True
                # A rejection belongs not to a command in progress but to a command sent beside it.
                if not pending.answers_another_try(ack.result):
                    self._answered(pending, ack, now)
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

    def _answered(self, pending: _PendingCommand, ack: messages.CommandAck, now: float) -> None:
        if pending.tries == 1 and pending.result is None:
            # An acknowledgement after a resend may be of either try and is not measured (RFC
            # 6298).
            self._estimator(pending.command.target).add(now - pending.last_sent, now)
        pending.result = ack.result
        state = TRANSITIONS.get((pending.state, ack.result))
        if state is CommandState.IN_PROGRESS:
            pending.progress = ack.progress if ack.progress <= 100 else None
            pending.due = now + PROGRESS_TIMEOUT
        elif state is CommandState.BACKOFF:
            first, last = REJECTED_BACKOFF
            pending.due = now + min(first * 2 ** min(pending.rejected, 8), last)
            pending.rejected += 1
            if pending.due >= min(pending.tries_end, pending.deadline):
                # The target may be busy with a try that was never answered.
                self._end(pending, CommandStatus.ANSWERED if pending.rejected == pending.tries
                          else CommandStatus.OUT_OF_TIME, now)
                return
        elif state is CommandState.SENT and now < min(pending.tries_end, pending.deadline):
            pending.as_int = True
            pending.rejected += 1
            self._transmit(pending, now)
        else:
            self._end(pending, CommandStatus.ANSWERED, now)
            return
        pending.state = state

    def poll(self, now: float) -> None:
        """Resend or end what is due."""
        for queue in list(self._pending.values()):
            for pending in list(queue):
                if pending in queue and now >= min(pending.due, pending.deadline):
                    self._overdue(pending, now)

    def _overdue(self, pending: _PendingCommand, now: float) -> None:
        if now >= pending.deadline:
            unanswered = pending.state is CommandState.SENT and not pending.rejected
            self._end(pending, CommandStatus.NO_ANSWER if unanswered
                      else CommandStatus.OUT_OF_TIME, now)
        elif pending.state is CommandState.IN_PROGRESS:
            self._end(pending, CommandStatus.PROGRESS_STOPPED, now)
        elif self._may_send is None and (
                pending.tries - pending.rejected > self.retries or now >= pending.tries_end):
            self._end(pending, CommandStatus.NO_ANSWER, now)
        else:
            pending.state = CommandState.SENT
            self._estimator(pending.command.target).expect_ambiguous(now)
            self._transmit(pending, now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do, infinity if never."""
        due = math.inf
        for queue in self._pending.values():
            for pending in queue:
                due = min(due, pending.due, pending.deadline)
        return due

    def end_all(
        self, now: float, status: CommandStatus, target: Address | None = None,
        ends: Callable[[Command], bool] = lambda command: True,
    ) -> None:
        """
        End commands that were started, to one target or to all.

        :param ends: returns whether a command ends.
        """
        ended = [pending for queue in self._pending.values() for pending in queue
                 if (target is None or pending.command.target == target)
                 and ends(pending.command)]
        # End the sent command last, so that no waiting one is sent in its place.
        for pending in reversed(ended):
            self._end(pending, status, now)

    def stop_resending(
        self, now: float, target: Address, which: Callable[[Command], bool],
    ) -> None:
        """
        Resend no more of some commands to a target, which may still answer them.

        Those that wait for another command of their kind end with CANCELLED.
        """
        for pending in list(self._pending.get(target, ())):
            if which(pending.command):
                pending.tries_end = min(pending.tries_end, now)
                if pending.state is CommandState.WAITING:
                    self._end(pending, CommandStatus.CANCELLED, now)

    def _begin(self, pending: _PendingCommand, now: float) -> None:
        pending.state = CommandState.SENT
        pending.first_sent = now
        pending.tries_end = now + self.timeout * (self.retries + 1)
        self._transmit(pending, now)

    def _transmit(self, pending: _PendingCommand, now: float) -> None:
        command = pending.command
        self.outgoing.append((self.address, command.message(pending.tries, pending.as_int)))
        pending.tries += 1
        self.counters.sent += 1
        self.counters.resent += pending.tries > 1
        pending.last_sent = now
        timeout = self.round_trip(command.target).timeout(self.timeout)
        lost = pending.tries - pending.rejected - 1
        if lost > 0:
            timeout = min(timeout * 2 ** min(lost, 16), self.timeout)
        pending.due = now + timeout

    def _end(self, pending: _PendingCommand, status: CommandStatus, now: float) -> None:
        command, key = pending.command, pending.key
        queue = self._pending.get(command.target, [])
        if pending not in queue:
            return
        queue.remove(pending)
        if not queue:
            del self._pending[command.target]
        if pending.state is CommandState.WAITING:
            pending.done(CommandResult(status), now)
            return
        result = CommandResult(
            status, pending.result, pending.tries, now - pending.first_sent, pending.progress,
            self._earlier.pop(key, None))
        answered = status is CommandStatus.ANSWERED
        if not answered:
            self._estimator(command.target).expect_ambiguous(now)
        while self._earlier and now > (
                oldest := next(iter(self._earlier.values()))).ended_at + ACK_LIFETIME:
            del self._earlier[oldest.command.key]
        is_measure = answered and pending.tries > 1 and not pending.rejected
        between = pending.last_sent - pending.first_sent
        self._earlier[key] = EarlierCommand(
            command, pending.result if answered else None, now, pending.tries, result.elapsed,
            now + between / 2 if is_measure else math.inf,
            self.round_trip(command.target).is_ambiguous(now))
        if status is CommandStatus.NO_ANSWER:
            self.counters.unanswered += 1
            self.unanswering[command.target] = None
            if len(self.unanswering) > MAX_TARGETS:
                del self.unanswering[next(iter(self.unanswering))]
        # The next poll ends those whose deadline has passed.
        following = [one for one in queue if one.key == key and now < one.deadline]
        if following and following[0].state is CommandState.WAITING:
            self._begin(following[0], now)
        pending.done(result, now)


def _int32(value: float) -> int:
    return INT32_UNSET if math.isnan(value) else round(value)
