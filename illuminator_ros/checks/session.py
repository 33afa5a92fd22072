# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
A session with one device: commands, acknowledgements, and a record of all messages. No I/O.

Its coroutines take no real time in a run against a simulated device.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
import math
from typing import ClassVar, NamedTuple, TypeVar

from .components import Components
from .coroutines import CoroutineRunner
from .outcomes import DeviceLost, Failed, Skipped
from .record import History, Record
from ..mavlink import messages
from ..mavlink.command_sender import Command
from ..mavlink.component import Endpoint, HeartbeatTimer
from ..mavlink.dialect import line_of, mavlink
from ..mavlink.frame import Frame
from ..mavlink.messages import (
    Address,
    command_name,
    CommandAck,
    ComponentInformationBasic,
    Heartbeat,
    Message,
    result_name,
)
from ..payload.identity import Identity

M = TypeVar('M', bound=Message)

# s
ACK_TIMEOUT = 3.0
PROGRESS_LIMIT = 15.0
MESSAGE_TIMEOUT = 1.0
# s after a final acknowledgement, so that a duplicate is not assigned to the next command.
SETTLE_TIME = 0.05
# s; the time for which an answer that must not come is awaited.
NO_ANSWER_TIME = 0.75
LOST_TIMEOUT = 5.0
REJECTION_PAUSE = 0.5
DISCOVERY_INTERVAL = 1.0

ATTEMPTS = 4
# After so many commands without any acknowledgement each is sent once, and its answer awaited for
# MESSAGE_TIMEOUT: with a device that receives nothing a run would take 40 minutes.
UNANSWERED = 4
REJECTIONS = 20
# The most acknowledgements of one command that are kept.
MAX_ACKS = 400


class Ack(NamedTuple):
    """
    A COMMAND_ACK.

    :param at: when it was received, s.
    :param target: its target fields; 0/0 if the device leaves them empty.
    """

    at: float
    result: int
    progress: int
    target: Address


@dataclass
class Transaction:
    """
    One command with its acknowledgements.

    :param expected: whether every device must acknowledge this command.
    :ivar rejections: how often it was rejected temporarily without another result.
    :ivar sent: time of each attempt, s.
    :ivar lines: the lines of the session's log about this command.
    """

    command: int
    params: tuple[float, ...]
    expected: bool
    rejections: int = 0
    sent: list[float] = field(default_factory=list)
    acks: list[Ack] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        """Return the command and its parameters."""
        return ' '.join([command_name(self.command), *(f'{param:g}' for param in self.params)])

    @property
    def finals(self) -> list[Ack]:
        """Return the acknowledgements that do not report progress."""
        return [ack for ack in self.acks if ack.result != mavlink.MAV_RESULT_IN_PROGRESS]

    @property
    def result(self) -> int | None:
        """Return the latest result, None if there is none."""
        return self.finals[-1].result if self.finals else None

    @property
    def accepted(self) -> bool:
        """Whether the command was accepted."""
        return self.result == mavlink.MAV_RESULT_ACCEPTED

    @property
    def answer(self) -> str:
        """Return the name of the result."""
        return 'no acknowledgement' if self.result is None else result_name(self.result)

    def expect(self, *, accepted: bool) -> None:
        """Raise Failed unless the command was accepted, or not accepted, as expected."""
        if self.accepted is not accepted:
            raise self.failure()

    def failure(self, reason: str = '') -> Failed:
        """Return a failure of this command, by default with its result."""
        return Failed(f'{self.text}: {reason or self.answer}', self.lines)


@dataclass(frozen=True)
class Conditions:
    """
    The conditions of a run.

    :param address: ours.
    :param target: the address of the device; None selects the first that is heard.
    :param options: the values of the options of the command line that only this payload has.
    :param checksum_errors: returns how many frames with a wrong checksum the link has dropped.
    :param utc: returns the time, s since 1970.
    """

    address: Address
    target: Address | None = None
    options: Mapping[str, float] = field(default_factory=dict)
    checksum_errors: Callable[[], int] = lambda: 0
    utc: Callable[[], float] = lambda: 0.0


class Session(Endpoint):
    """
    Sends commands to one device and records its messages; the argument of each check.

    A payload derives a session with the operations of its devices. This is an endpoint, not a
    payload of a component: it must see the messages from system id 0 and every acknowledgement,
    which a component handles or drops.

    :cvar messages: the classes of messages that it receives.
    :cvar mav_type: MAV_TYPE of the device, None for any.
    :cvar component: the component id that alone identifies a device, see :class:`Components`.
    :cvar discovery: a message that is requested of all components until the device is found.
    :ivar consent: whether the operator has agreed to the checks that need consent.
    :ivar danger: why the run was stopped, '' if it was not; see :meth:`danger_of`.
    :ivar runner: runs the coroutines.
    :ivar idle_until: end of the time in which the session only listened, s.
    :ivar transactions: all commands.
    """

    messages: Sequence[type[Message]] = (Heartbeat, CommandAck)
    mav_type: ClassVar[int | None] = None
    component: ClassVar[int | None] = None
    discovery: ClassVar[type[Message] | None] = None

    def __init__(self, conditions: Conditions) -> None:
        super().__init__()
        self.address = conditions.address
        self.conditions = conditions
        self.consent = False
        self.danger = ''
        self.components = Components(self.address, conditions.target, self.component)
        self.record = Record(self.messages)
        self.runner = CoroutineRunner(self.schedule)
        self.idle_until = -math.inf
        self.transactions: History[Transaction] = History()
        self._latest: dict[int, Transaction] = {}
        self._heartbeat = HeartbeatTimer(self.address, mavlink.MAV_TYPE_GCS, self.outgoing,
                                         self.schedule)

    # A payload overrides these

    def is_device(self, message: Message) -> bool:
        """Return whether a message identifies its sender as a device of this payload."""
        return isinstance(message, Heartbeat) and self.mav_type in (None, message.type)

    def is_part(self, source: Address) -> bool:
        """Return whether a component is a part of the device, which sends messages for it."""
        return False

    def describe(self, message: Message) -> str:
        """Return a message as text in one line."""
        if not isinstance(message, CommandAck):
            return line_of(message)
        target = messages.target_of(message)
        progress = message.result == mavlink.MAV_RESULT_IN_PROGRESS
        return (f'COMMAND_ACK {command_name(message.command)}: {result_name(message.result)}'
                + (f', progress {message.progress}' if progress else '')
                + (f' to {target}' if any(target) else ''))

    def danger_of(self, message: Message) -> str:
        """
        Return why the run must stop at once, '' if a message of the device shows no reason.

        Then :meth:`restore` must bring the device to a safe state.
        """
        return ''

    async def save(self) -> str | None:
        """Save the state of the device; return it as text, None if the device reports none."""
        return ''

    async def restore(self) -> list[str]:
        """Restore the saved state; return the names of the values that still differ from it."""
        return []

    # The endpoint

    def link_opened(self, now: float) -> None:
        """See :meth:`Endpoint.link_opened`."""
        self._heartbeat.send(now)

    def link_closed(self, now: float, reason: str) -> None:
        """See :meth:`Endpoint.link_closed`."""
        self._heartbeat.stop()

    def inspect(self, frame: Frame, cls: type[Message]) -> None:
        """See :class:`Endpoint`."""
        if self.components.is_device(frame.source):
            self.record.inspect(frame, cls)

    def receive(self, source: Address, message: Message, now: float) -> None:
        """See :meth:`Endpoint.receive`."""
        self.runner.now = now
        is_device = self.components.hear(source, now, identifies=self.is_device(message))
        if is_device or self.is_part(source) and not isinstance(message, Heartbeat | CommandAck):
            line = self.record.note('<', ('' if is_device else f'from {source}: ')
                                    + self.describe(message), now)
            self.record.add(message, now)
            if isinstance(message, CommandAck) and (
                    one := self._latest.get(message.command)) and len(one.acks) < MAX_ACKS:
                one.acks.append(Ack(
                    now, message.result, message.progress, messages.target_of(message)))
                one.lines.append(line)
            if not self.danger and (danger := self.danger_of(message)):
                self.danger = danger
                # Restoring is stopped, too.
                self.runner.restoring = False
                self.runner.interrupt(now)
        self.runner.advance(now)

    # The record

    @property
    def now(self) -> float:
        """Return the time of the latest message or poll, s."""
        return self.runner.now

    @property
    def device(self) -> Address:
        """Return the address of the device, which must have been heard."""
        return self.components.device

    @property
    def identity(self) -> str:
        """Return the names that the device has sent, '' if there are none."""
        received = self.received(ComponentInformationBasic)
        one = Identity.from_message(received[-1][1]) if received else Identity()
        return ', '.join(filter(None, (one.vendor, one.model, one.serial_number)))

    def received(self, cls: type[M]) -> History[tuple[float, M]]:
        """Return the messages of a class that the device has sent, with their times, s."""
        return self.record.received(cls)

    def idle(self, cls: type[M]) -> list[tuple[float, M]]:
        """Return the messages that the device sent before the session sent a command."""
        return [(at, one) for at, one in self.received(cls) if at <= self.idle_until]

    def check_presence(self) -> None:
        """
        Check that the device still sends.

        :raises DeviceLost: if it has stopped.
        """
        if self.now - self.components.last_heard > LOST_TIMEOUT:
            raise DeviceLost

    def send(self, message: Message, source: Address | None = None, text: str = '') -> str:
        """
        Send a message from an address, by default the session's; return its line in the log.

        :param text: the message in the log, '' for that of :meth:`describe`.
        """
        self.outgoing.append((source or self.address, message))
        return self.record.note('>', (text or self.describe(message))
                                + (f' from {source}' if source else ''), self.now)

    # For coroutines

    async def until(self, condition: Callable[[], object], timeout: float) -> bool:
        """See :meth:`CoroutineRunner.until`."""
        return await self.runner.until(condition, timeout)

    async def sleep(self, seconds: float) -> None:
        """See :meth:`CoroutineRunner.sleep`."""
        await self.runner.sleep(seconds)

    async def find(self, timeout: float, listen: float) -> None:
        """
        Wait for the device, and request its discovery message if there is one; then only listen.

        :param timeout: s to wait for the device.
        :param listen: s to listen; :attr:`idle_until` is their end.
        """
        end, components = self.now + timeout, self.components
        while components.found is None and self.now < end:
            if self.discovery is not None:
                self._send(Transaction(
                    mavlink.MAV_CMD_REQUEST_MESSAGE, (self.discovery.id,), False), Address(0, 0))
            await self.until(lambda: components.found, min(DISCOVERY_INTERVAL, end - self.now))
        if components.found is not None:
            await self.sleep(listen)
            self.idle_until = self.now

    async def receive_more(
        self, cls: type[M], timeout: float, count: int = 1,
    ) -> list[tuple[float, M]]:
        """Return the messages of a class that come within ``timeout`` s, or until the count-th."""
        received = self.received(cls)
        before = received.total
        await self.until(lambda: received.total >= before + count, timeout)
        return received.since(before)

    async def ask(
        self, cls: type[M], *, as_int: bool = False,
    ) -> tuple[Transaction, M | None]:
        """Request a message once; return the command, and the message if it comes."""
        received = self.received(cls)
        before = received.total
        one = await self.command(mavlink.MAV_CMD_REQUEST_MESSAGE, cls.id, as_int=as_int)
        has_come = (one.accepted or one.result is None) and await self.until(
            lambda: received.total > before, MESSAGE_TIMEOUT)
        return one, received[-1][1] if has_come else None

    async def request(self, cls: type[M]) -> M | None:
        """Request a message until it comes; return it, None if it does not come."""
        for _ in range(ATTEMPTS):
            one, message = await self.ask(cls)
            if message is not None or not (one.accepted or one.result is None):
                return message
        return None

    async def required(self, cls: type[M]) -> M:
        """Request a message and return it; raise Skipped if it does not come."""
        message = await self.request(cls)
        if message is None:
            raise Skipped(f'no {cls.msgname} was received')
        return message

    async def command(
        self, command: int, *params: float, as_int: bool = False, confirmation: int = 0,
        target: Address | None = None, source: Address | None = None, is_foreign: bool = False,
    ) -> Transaction:
        """
        Send a command; repeat it while it is not acknowledged or is temporarily rejected.

        :param as_int: whether it is sent as COMMAND_INT.
        :param target: None for the device.
        :param source: the address that sends it, None for the session's.
        :param is_foreign: whether the device must not answer it, so that it is sent once.
        :raises DeviceLost: if the device has stopped sending.
        """
        is_deaf = len(self.transactions) >= UNANSWERED and not any(
            one.acks for one in self.transactions)
        attempts, timeout = (1, NO_ANSWER_TIME) if is_foreign else (
            1, MESSAGE_TIMEOUT) if is_deaf else (ATTEMPTS, ACK_TIMEOUT)
        # A device that has rejected a command temporarily so often is not waited for again.
        is_stuck = is_foreign or any(one.rejections == REJECTIONS for one in self.transactions)
        for rejections in range(1, 2 if is_stuck else REJECTIONS + 1):
            # Separate requirements cover COMMAND_INT and other addresses.
            one = self._latest[command] = Transaction(
                command, params, expected=not as_int and target is None and source is None)
            self.transactions.append(one)
            for attempt in range(attempts):
                self._send(one, target or self.device, confirmation + attempt, as_int=as_int,
                           source=source)
                if await self._answered(one, timeout):
                    break
                self.check_presence()
            if one.result != mavlink.MAV_RESULT_TEMPORARILY_REJECTED:
                break
            one.rejections = rejections
            await self.sleep(REJECTION_PAUSE)
        return one

    def _send(
        self, one: Transaction, target: Address, confirmation: int = 0, *, as_int: bool = False,
        source: Address | None = None,
    ) -> None:
        message = Command(target, one.command, (*map(float, one.params),)).message(
            confirmation, as_int)
        one.sent.append(self.now)
        one.lines.append(self.send(
            message, source, f'{message.get_type()} to {target}: {one.text}'
            + (f', confirmation {confirmation}' if confirmation else '')))

    async def _answered(self, one: Transaction, timeout: float) -> bool:
        """Wait for the result of an attempt; return whether the device has received it."""
        before = len(one.acks)
        if not await self.until(lambda: len(one.acks) > before, timeout):
            return False
        # After a report of progress the command must not be sent again.
        await self.until(lambda: one.finals, PROGRESS_LIMIT)
        # A late acknowledgement must not be assigned to the next command.
        if len(one.sent) > 1:
            await self.until(lambda: len(one.finals) >= len(one.sent), ACK_TIMEOUT)
        await self.sleep(SETTLE_TIME)
        return True
