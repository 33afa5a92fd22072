# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The sending side of the MAVLink command protocol; no I/O, and time is passed in.

https://mavlink.io/en/services/command.html: a command is resent, with ``confirmation`` counted
up, until it is acknowledged; MAV_RESULT_IN_PROGRESS lengthens the wait and ends the resending.
An acknowledgement names only the command, so one command of a kind at a time is sent to a
component: a newer one replaces it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
import math
from typing import NamedTuple, TypeVar

from . import messages
from .dialect import mavlink
from .durations import format_seconds, timing
from .errors import InvalidValue
from .messages import Address, Message
from .retries import CLOSING, COMMAND, REJECTED
from .schedule import Schedule

# s between two reports of progress. The specification does not define it; MAVSDK also uses 3 s.
PROGRESS_TIMEOUT = 3.0
# s after a stop of the process in which requests may have waited as long.
OLD_REQUEST_TIME = 1.0
# The most targets whose last round trip, or missing answer, is kept.
MAX_TARGETS = 128
# COMMAND_INT: x and y are degrees * 1e7 in the global frames and metres * 1e4 in the local ones.
GLOBAL_FRAMES = frozenset((0, 3, 5, 6, 10, 11))
DEGREE_SCALE, METRE_SCALE = 1e7, 1e4
# COMMAND_INT: represents NaN in x and y.
INT32_UNSET = 0x7FFFFFFF

K = TypeVar('K')
V = TypeVar('V')


class CommandStatus(Enum):
    """How a command ended. Each command ends in exactly one of these."""

    ANSWERED = 'answered'
    NO_ANSWER = 'no acknowledgement'
    PROGRESS_STOPPED = 'no final acknowledgement'
    OUT_OF_TIME = 'not finished in time'
    LINK_LOST = 'the link was lost'
    CANCELLED = 'cancelled'
    CLOSED = 'closed'


@dataclass(frozen=True)
class CommandPosition:
    """
    The position of a COMMAND_INT.

    :param frame: a MAV_FRAME.
    :param x: latitude, deg, in a global frame; m in a local one. NaN means "not used".
    :param y: longitude, deg, or m; NaN means "not used".
    :param z: altitude, m, as the frame defines it.
    :raises InvalidValue: if x or y does not fit into the message.
    """

    frame: int
    x: float
    y: float
    z: float

    def __post_init__(self) -> None:
        for value in self.x, self.y:
            # NaN is not above it.
            if abs(value) * self._scale > INT32_UNSET:
                raise InvalidValue(
                    f'a position of {self.x:g}, {self.y:g} does not fit COMMAND_INT')

    @property
    def _scale(self) -> float:
        return DEGREE_SCALE if self.frame in GLOBAL_FRAMES else METRE_SCALE

    @property
    def scaled(self) -> tuple[int, int]:
        """Return x and y as COMMAND_INT carries them."""
        return _int32(self.x * self._scale), _int32(self.y * self._scale)


# A kind of commands: see :attr:`Command.key`.
CommandKind = tuple[Address, int, float]


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
    position: CommandPosition | None = None

    @property
    def key(self) -> CommandKind:
        """Return the kind: a command replaces another one of its kind."""
        # As in MAVSDK: requests for two messages do not exclude each other. Either may
        # get the acknowledgement of the other, or of a follow-up: the message is the answer.
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


def request_message(target: Address, message_id: int) -> Command:
    """Return the command that requests one message of a component."""
    return Command(target, mavlink.MAV_CMD_REQUEST_MESSAGE, (float(message_id),))


class CommandResult(NamedTuple):
    """
    The one outcome of a command.

    :param result: the last MAV_RESULT received, None if there was none.
    :param tries: how often it was sent.
    :param elapsed: s, from the first sending.
    :param progress: %, the last that was reported, None where unknown.
    :param reason: for people: why the sender was closed, or what may have kept the target from an
        answer; '' if that is not known.
    """

    status: CommandStatus
    result: int | None = None
    tries: int = 0
    elapsed: float = 0.0
    progress: int | None = None
    reason: str = ''

    @property
    def accepted(self) -> bool:
        """Whether the target acknowledged with MAV_RESULT_ACCEPTED."""
        return self.status is CommandStatus.ANSWERED and self.result == mavlink.MAV_RESULT_ACCEPTED

    @property
    def refused(self) -> bool:
        """Whether the target acknowledged with another MAV_RESULT."""
        return self.status is CommandStatus.ANSWERED and self.result != mavlink.MAV_RESULT_ACCEPTED

    def describe(self) -> str:
        """Return the outcome for people, with the name of the MAV_RESULT."""
        if self.status is CommandStatus.ANSWERED and self.result is not None:
            return messages.result_name(self.result)
        last = '' if self.result is None else f', last answer {messages.result_name(self.result)}'
        if self.progress is not None:
            last += f' at {self.progress} %'
        if self.status is CommandStatus.CLOSED and self.reason:
            return f'{self.reason}{last}'
        unheard = self.status is CommandStatus.NO_ANSWER and self.reason
        return f'{self.status.value}{f" ({unheard})" if unheard else ""}{last}'

    def describe_failure(self) -> str:
        """Return why it was not accepted, for people."""
        return f'{"refused: " if self.refused else ""}{self.describe()}'

    def __str__(self) -> str:
        return f'{self.describe()} ({timing(self.tries, self.elapsed)})'


CommandDone = Callable[[CommandResult, float], None]


class CommandState(Enum):
    """
    The state of a command that has not ended.

    SENT waits for an acknowledgement, BACKOFF to send a rejected command again, IN_PROGRESS for
    the next report of progress.
    """

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


@dataclass
class Transmission:
    """
    A command that is being sent.

    :param done: called once, with the outcome and the time.
    :param deadline: s, the time by which it ends.
    :param retries: resends of an unacknowledged try.
    :param as_int: whether it is sent as COMMAND_INT.
    :param follow_up: a request that each try carries, None for none.
    :ivar tries: how often it was sent.
    :ivar last_sent: when it was sent last, s.
    """

    command: Command
    done: CommandDone
    deadline: float
    retries: int
    as_int: bool
    follow_up: Command | None
    state: CommandState = CommandState.SENT
    tries: int = 0
    # The tries that use up no retry: the tries of a command before it, and tries with an answer
    # that is not final.
    rejected: int = 0
    first_sent: float = -math.inf
    last_sent: float = -math.inf
    due: float = math.inf
    result: int | None = None
    progress: int | None = None

    @property
    def is_last_try(self) -> bool:
        """Whether no further try is sent unless an acknowledgement asks for it."""
        return self.state is CommandState.SENT and (
            self.tries - self.rejected > self.retries or self.due >= self.deadline)


@dataclass
class CommandCounters:
    """Totals over all targets."""

    sent: int = 0
    resent: int = 0
    unanswered: int = 0


@dataclass(eq=False)
class CommandSender:
    """
    Sends commands to any number of components, in parallel across them.

    :param address: our own address, which acknowledgements are matched against.
    :param timeout: s, > 0: the wait for the acknowledgement of the first try.
    :param retries: resends after the first try, >= 0.
    :param clock_fault: returns why a target may ignore our signed frames, for people; '' in
        general.
    :ivar outgoing: messages to send, each with the address that sends it.
    :ivar schedule: of the parts that send by it, which the link calls again.
    :ivar unanswering: the targets whose last command got no acknowledgement, at most
        :data:`MAX_TARGETS`.
    :ivar refusal: why no device may be changed any more, for people; '' if it may be.
    :ivar round_trips: the last round-trip time of each target, s, at most :data:`MAX_TARGETS`.
    :ivar answers: how many acknowledgements, but those of progress, each kind of command got
        lately, by target and MAV_CMD, at most :data:`MAX_TARGETS`.
    :raises InvalidValue: if ``timeout`` or ``retries`` is out of its range.
    """

    address: Address
    timeout: float = COMMAND.first
    retries: int = int(COMMAND.tries) - 1
    clock_fault: Callable[[], str] = str
    outgoing: deque[tuple[Address, Message]] = field(default_factory=deque)
    schedule: Schedule = field(default_factory=Schedule)
    counters: CommandCounters = field(default_factory=CommandCounters)
    unanswering: dict[Address, None] = field(default_factory=dict)
    round_trips: dict[Address, float] = field(default_factory=dict)
    answers: dict[tuple[Address, int], int] = field(default_factory=dict)
    refusal: str = ''
    _may_send: Callable[[Command | Message], bool] | None = None
    _pending: dict[CommandKind, Transmission] = field(default_factory=dict)
    # For how long the process was stopped, and until when, s.
    _stall: tuple[float, float] = 0.0, -math.inf

    def __post_init__(self) -> None:
        if not (math.isfinite(self.timeout) and self.timeout > 0):
            raise InvalidValue(f'timeout {self.timeout} s is not above 0')
        if self.retries < 0:
            raise InvalidValue(f'retries {self.retries} is below 0')

    def __len__(self) -> int:
        """Return how many commands have not ended."""
        return len(self._pending)

    def close(
        self, now: float, may_send: Callable[[Command | Message], bool], reason: str,
    ) -> None:
        """
        Send nothing any more that changes a device, since the process ends.

        All other commands end with CLOSED, now or when they are started, and other messages are
        dropped. A command that may still be sent is repeated until it is acknowledged.

        :param may_send: returns whether a command or message may still be sent, in addition to
            requests for messages.
        :param reason: why, for people.
        """
        self._may_send, self.refusal = may_send, reason
        for pending in list(self._pending.values()):
            if self._is_refused(pending.command):
                self._end(pending, CommandStatus.CLOSED, now)

    def stalled(self, seconds: float, now: float) -> None:
        """Note that the process was stopped: requests that come now may be as old, s."""
        self._stall = seconds, now

    def lateness(self, now: float) -> str:
        """Return why a request that comes now may be late, for people; '' if it is not."""
        seconds, at = self._stall
        if now >= at + OLD_REQUEST_TIME:
            return ''
        return (f'the request may be {format_seconds(seconds)} old, since this process was '
                'stopped as long; repeat it')

    def _is_refused(self, sent: Command | Message) -> bool:
        if self._may_send is None:
            return False
        is_request = isinstance(sent, Command) and sent.command == mavlink.MAV_CMD_REQUEST_MESSAGE
        return not (is_request or self._may_send(sent))

    def send(self, message: Message) -> None:
        """Send a message that is not a command from our address."""
        if not self._is_refused(message):
            self.outgoing.append((self.address, message))

    def send_once(self, command: Command) -> None:
        """Send a command once; its acknowledgement has no receiver."""
        self.outgoing.append((self.address, command.message(0, command.position is not None)))

    def start(
        self, command: Command, now: float, done: CommandDone = lambda result, now: None, *,
        deadline: float = math.inf, retries: int | None = None, tried: int = 0,
        follow_up: Command | None = None,
    ) -> Transmission:
        """
        Send a command, in the place of the one of its kind, which ends with CANCELLED.

        :param done: called once, with the outcome and the time.
        :param deadline: s, the time by which it ends, even if it is in progress.
        :param retries: as of the sender, or others.
        :param tried: how often it was sent before, which ``confirmation`` counts.
        :param follow_up: a request that is sent with each try.
        """
        transmission = Transmission(
            command, done, deadline, self.retries if retries is None else retries,
            command.position is not None, follow_up)
        if self._is_refused(command):
            done(CommandResult(CommandStatus.CLOSED, reason=self.refusal), now)
        elif now >= deadline:
            done(CommandResult(CommandStatus.OUT_OF_TIME), now)
        else:
            key = command.key
            if older := self._pending.get(key):
                self._end(older, CommandStatus.CANCELLED, now)
            self._pending[key] = transmission
            _keep(self.answers, key[:2], self.answers.get(key[:2], 0))
            transmission.first_sent = now
            transmission.tries = transmission.rejected = tried
            self._transmit(transmission, now)
        return transmission

    def cancel(self, transmission: Transmission, now: float) -> None:
        """End a command with CANCELLED, if it has not ended."""
        self._end(transmission, CommandStatus.CANCELLED, now)

    def acknowledge(self, source: Address, ack: messages.CommandAck, now: float) -> bool:
        """
        Receive a COMMAND_ACK.

        It counts if its source and command match a command that was sent, and if its target is our
        address or 0, since the extension fields may be missing.

        :return: whether it is for our address.
        """
        if not messages.target_of(ack).includes(self.address):
            return False
        self.unanswering.pop(source, None)
        key = source, ack.command
        if key in self.answers and ack.result != mavlink.MAV_RESULT_IN_PROGRESS:
            self.answers[key] += 1
        for pending in self._pending.values():
            if pending.command.command == ack.command and pending.command.target == source:
                self._answered(pending, ack, now)
                break
        return True

    def _answered(self, pending: Transmission, ack: messages.CommandAck, now: float) -> None:
        if (pending.state is CommandState.IN_PROGRESS
                and ack.result == mavlink.MAV_RESULT_TEMPORARILY_REJECTED):
            # The target rejects an earlier resend, since it executes the try before that.
            return
        if pending.result is None:
            _keep(self.round_trips, pending.command.target, now - pending.last_sent)
        pending.result = ack.result
        state = TRANSITIONS.get((pending.state, ack.result))
        if state is CommandState.IN_PROGRESS:
            pending.progress = ack.progress if ack.progress <= 100 else None
            self._wait_until(pending, now + PROGRESS_TIMEOUT)
        elif state is CommandState.BACKOFF:
            pending.rejected += 1
            self._wait_until(pending, now + REJECTED.wait(pending.rejected))
            # s from the first try of a command to its end without an acknowledgement.
            patience = sum(map(self._wait, range(self.retries + 1)))
            if pending.due >= min(pending.first_sent + patience, pending.deadline):
                self._end(pending, CommandStatus.ANSWERED, now)
                return
        elif state is CommandState.SENT and not pending.as_int:
            pending.as_int = True
            pending.rejected += 1
            self._transmit(pending, now)
        else:
            self._end(pending, CommandStatus.ANSWERED, now)
            return
        pending.state = state

    def _wait(self, resends: int) -> float:
        """Return the wait for an acknowledgement after so many resends, s."""
        if self._may_send is not None:
            return min(self.timeout, CLOSING.first)
        return COMMAND._replace(first=self.timeout).wait(max(resends, 0) + 1)

    def poll(self, now: float) -> None:
        """Resend or end what is due."""
        for pending in list(self._pending.values()):
            if now >= min(pending.due, pending.deadline):
                self._overdue(pending, now)
        self.schedule.at(self.poll, min(
            (min(one.due, one.deadline) for one in self._pending.values()), default=math.inf))

    def _overdue(self, pending: Transmission, now: float) -> None:
        if now >= pending.deadline:
            unanswered = pending.state is CommandState.SENT and pending.result is None
            self._end(pending, CommandStatus.NO_ANSWER if unanswered
                      else CommandStatus.OUT_OF_TIME, now)
        elif pending.state is CommandState.IN_PROGRESS:
            self._end(pending, CommandStatus.PROGRESS_STOPPED, now)
        elif pending.is_last_try and self._may_send is None:
            self._end(pending, CommandStatus.NO_ANSWER, now)
        else:
            pending.state = CommandState.SENT
            self._transmit(pending, now)

    def end_all(
        self, now: float, status: CommandStatus, target: Address | None = None,
    ) -> None:
        """End all commands, or those to one target."""
        for pending in list(self._pending.values()):
            if target is None or pending.command.target == target:
                self._end(pending, status, now)

    def _transmit(self, pending: Transmission, now: float) -> None:
        self.outgoing.append(
            (self.address, pending.command.message(pending.tries, pending.as_int)))
        if pending.follow_up is not None:
            self.send_once(pending.follow_up)
        self._wait_until(pending, now + self._wait(pending.tries - pending.rejected))
        pending.tries += 1
        self.counters.sent += 1
        self.counters.resent += pending.tries > 1
        pending.last_sent = now

    def _wait_until(self, pending: Transmission, due: float) -> None:
        pending.due = due
        self.schedule.by(self.poll, min(due, pending.deadline))

    def _end(self, pending: Transmission, status: CommandStatus, now: float) -> None:
        key = pending.command.key
        if self._pending.get(key) is not pending:
            return
        del self._pending[key]
        if status is CommandStatus.NO_ANSWER:
            self.counters.unanswered += 1
            _keep(self.unanswering, pending.command.target, None)
        pending.done(CommandResult(
            status, pending.result, pending.tries, now - pending.first_sent, pending.progress,
            self.refusal or self.clock_fault()), now)


def _keep(values: dict[K, V], target: K, value: V) -> None:
    """Keep a value of a target; drop the one not renewed for longest if there are too many."""
    values.pop(target, None)
    values[target] = value
    if len(values) > MAX_TARGETS:
        del values[next(iter(values))]


def _int32(value: float) -> int:
    return INT32_UNSET if math.isnan(value) else round(value)
