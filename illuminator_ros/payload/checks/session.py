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
A session with one device: commands, acknowledgements, and a record of all messages. No I/O.

Its coroutines wait for conditions and times. There is no event loop: time is an argument, so that
a run against a simulated device takes no real time.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Coroutine, Generator, Iterable, Sequence
from dataclasses import astuple, dataclass, field
import math
from typing import cast, NamedTuple, TypeVar

from ..identity import Identity
from ...mavlink import messages
from ...mavlink.component import Endpoint, HeartbeatTimer
from ...mavlink.dialect import base_size, mavlink
from ...mavlink.frame import Frame
from ...mavlink.messages import (
    Address,
    command_name,
    CommandAck,
    Message,
    result_name,
)

T = TypeVar('T')
M = TypeVar('M', bound=Message)

# s
ACK_TIMEOUT = 3.0
PROGRESS_LIMIT = 15.0
MESSAGE_TIMEOUT = 1.0
# s after a final acknowledgement, so that a duplicate is not assigned to the next command.
SETTLE_TIME = 0.05
# s; the time for which an answer that must not come is awaited.
NO_ANSWER_TIME = 0.7
LOST_TIMEOUT = 5.0
REJECTION_PAUSE = 0.5
DISCOVERY_INTERVAL = 1.0

ATTEMPTS = 4
# After so many commands without any acknowledgement each is sent once, and its answer awaited for
# MESSAGE_TIMEOUT: with a device that receives nothing a run would take 40 minutes.
UNANSWERED = 4
REJECTIONS = 20
# The most entries that are kept of each record, and acknowledgements of one command.
MAX_ENTRIES = 10_000
MAX_ACKS = 400


class Interrupted(BaseException):
    """The run must end now."""


@dataclass
class _Wait:
    condition: Callable[[], object]
    deadline: float

    def __await__(self) -> Generator[_Wait, None, None]:
        yield self


# A coroutine that awaits :class:`_Wait`, directly or through other coroutines.
Main = Coroutine[_Wait, None, None]


class CoroutineRunner:
    """
    Runs one coroutine after another; each awaits :meth:`until` and :meth:`sleep`.

    :ivar now: time of the latest message or poll, s.
    :ivar interrupted: whether :meth:`interrupt` was called.
    :ivar restoring: whether interruption is ignored, because the device is being restored.
    """

    def __init__(self) -> None:
        self.now = 0.0
        self.interrupted = False
        self.restoring = False
        self._main: Main | None = None
        self._wait: _Wait | None = None

    def run(self, main: Main) -> None:
        """Run a coroutine from the next :meth:`advance` on."""
        self._main, self._wait = main, None

    @property
    def running(self) -> bool:
        """Whether the coroutine has not ended."""
        return self._main is not None

    def advance(self, now: float) -> None:
        """Continue the coroutine if its condition holds or its time has come."""
        self.now = now
        while self._main is not None and (
                self._wait is None or now >= self._wait.deadline or self._wait.condition()):
            self._step(lambda main: main.send(None))

    def next_deadline(self) -> float:
        """Return when :meth:`advance` is due, infinity if never."""
        if self._main is None:
            return math.inf
        return self._wait.deadline if self._wait else self.now

    def interrupt(self, now: float) -> None:
        """Raise :class:`Interrupted` in the coroutine, unless it restores the device."""
        self.interrupted = True
        if not self.restoring:
            self.advance(now)
            self._step(lambda main: main.throw(Interrupted()))
            self.advance(now)

    def _step(self, step: Callable[[Main], _Wait]) -> None:
        if self._main is None:
            return
        try:
            self._wait = step(self._main)
        except (StopIteration, Interrupted):
            self._main = self._wait = None

    async def until(self, condition: Callable[[], object], timeout: float) -> bool:
        """
        Wait for a condition, for ``timeout`` s at most, and return whether it holds.

        :raises Interrupted: if the run must end.
        """
        if self.interrupted and not self.restoring:
            raise Interrupted
        await _Wait(condition, self.now + timeout)
        return bool(condition())

    async def sleep(self, seconds: float) -> None:
        """
        Wait for a time, s.

        :raises Interrupted: if the run must end.
        """
        await self.until(lambda: False, seconds)


class DeviceLost(Exception):
    """The device has stopped sending."""


class Skipped(Exception):
    """A requirement cannot be checked; the text gives the reason."""


class Failed(Exception):
    """
    The device does not meet a requirement; the text gives the deviation.

    :ivar lines: the lines of the log that show the deviation, None for all lines of the check.
    """

    def __init__(self, reason: str, lines: list[str] | None = None) -> None:
        super().__init__(reason)
        self.lines = lines


def fail_if(failures: Iterable[Failed | None]) -> None:
    """
    Raise if there are failures.

    :raises Failed: with all of them.
    """
    if found := [one for one in failures if one is not None]:
        raise Failed('; '.join(map(str, found)),
                     [line for one in found for line in one.lines or ()])


class History(deque[T]):
    """
    The newest entries, so that a flood of messages takes a bounded memory.

    :ivar total: entries ever appended.
    """

    def __init__(self) -> None:
        super().__init__(maxlen=MAX_ENTRIES)
        self.total = 0

    def append(self, entry: T, /) -> None:
        """Append an entry; drop the oldest entry if there is no room."""
        super().append(entry)
        self.total += 1

    def since(self, count: int) -> list[T]:
        """Return the entries that were appended after the first ``count`` and are still kept."""
        return list(self)[max(len(self) - (self.total - count), 0):]


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

    def acknowledge(self, ack: Ack, line: str) -> None:
        """Record an acknowledgement, with its line of the log."""
        if len(self.acks) < MAX_ACKS:
            self.acks.append(ack)
            self.lines.append(line)

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


def _protocol_text(message: Message) -> str:
    if isinstance(message, CommandAck):
        target = messages.target_of(message)
        progress = message.result == mavlink.MAV_RESULT_IN_PROGRESS
        return (f'COMMAND_ACK {command_name(message.command)}: {result_name(message.result)}'
                + (f', progress {message.progress}' if progress else '')
                + (f' to {target}' if any(target) else ''))
    if isinstance(message, messages.Heartbeat):
        return f'HEARTBEAT type {message.type}, autopilot {message.autopilot}'
    if isinstance(message, messages.ComponentInformationBasic):
        identity = astuple(Identity.from_message(message))
        return f'{message.get_type()} {", ".join(map(repr, identity))}'
    return message.get_type()


class Session(Endpoint):
    """
    Sends commands to one device and records its messages.

    It is an endpoint, not a payload of a component: it must see the messages from system id 0 and
    every acknowledgement, which a component handles or drops.

    :param address: the address of the session.
    :param payload_messages: the classes of the payload's messages.
    :param is_device: whether a message identifies its sender as a device of this payload.
    :param describe: returns the text of a message of the payload, '' for its name.
    :param target: the device; None selects the first that is heard.
    :param component: the component id that alone identifies the device, whose system id changes;
        None if its address stays the same.
    :param discovery: a message that is requested of all components until the device is found.
    :param part_of: returns the component id of a part of the device, from a message of the
        device; the payload's messages of that component are recorded, too. 0 for no part.
    :ivar found: the present address of the device, once it is heard.
    :ivar heard: the addresses of all components that were heard.
    :ivar devices: the addresses of the devices of this payload among them.
    :ivar idle_until: end of the time in which the session only listened, s.
    :ivar transactions: all commands.
    :ivar versions: the number of frames of the device by MAVLink version.
    :ivar odd_lengths: the latest wrong length of its MAVLink 1 frames, by message name.
    :ivar log: a line for each message.
    """

    def __init__(
        self, address: Address, payload_messages: Sequence[type[Message]],
        is_device: Callable[[Message], bool], describe: Callable[[Message], str],
        target: Address | None, component: int | None, discovery: type[Message] | None,
        part_of: Callable[[Message], int],
    ) -> None:
        super().__init__()
        self.address = address
        self.messages = (messages.Heartbeat, CommandAck, *payload_messages)
        self.target = target
        self.runner = CoroutineRunner()
        self.found: Address | None = None
        self.heard: set[Address] = set()
        self.devices: set[Address] = set()
        self.idle_until = -math.inf
        self.transactions: History[Transaction] = History()
        self.versions: Counter[int] = Counter()
        self.odd_lengths: dict[str, int] = {}
        self.log: History[str] = History()
        self._received: dict[type[Message], History[tuple[float, Message]]] = {
            cls: History() for cls in self.messages}
        self._component = component
        self._is_device = is_device
        self._discovery = discovery
        self._part_of, self._part = part_of, 0
        self._payload_messages = frozenset(payload_messages)
        self._describe = describe
        self._began: float | None = None
        self._last_heard = -math.inf
        self._latest: dict[int, Transaction] = {}
        self._heartbeat = HeartbeatTimer(address, mavlink.MAV_TYPE_GCS, self.outgoing)

    # The endpoint

    def link_opened(self, now: float) -> None:
        """See :meth:`Endpoint.link_opened`."""
        self._heartbeat.send(now)

    def link_closed(self, now: float, reason: str) -> None:
        """See :meth:`Endpoint.link_closed`."""
        self._heartbeat.stop()

    def inspect(self, frame: Frame, cls: type[Message]) -> None:
        """See :class:`Endpoint`."""
        if self._same_device(frame.source, self.found):
            self.versions[frame.version] += 1
            if frame.version == 1 and len(frame.payload) != base_size(cls):
                self.odd_lengths[cls.msgname] = len(frame.payload)

    def receive(self, source: Address, message: Message, now: float) -> None:
        """See :meth:`Endpoint.receive`."""
        self._at(now)
        self.heard.add(source)
        if self._component in (None, source.component) and self._is_device(message):
            self.devices.add(source)
        if self.found is None and (self._same_device(source, self.target) if self.target
                                   else source in self.devices):
            self.found = source
        if self._same_device(source, self.found):
            if self.found is not None and source != self.found:
                self.heard.discard(self.found)
                self.devices.discard(self.found)
            self.found = source
            self._last_heard = now
            self._note('<', self._describe(message) or _protocol_text(message))
            self._record(message)
            self._part = self._part_of(message) or self._part
        elif self.found is not None and source == (self.found.system, self._part) and (
                type(message) in self._payload_messages):
            self._note('<', f'from {source}: {self._describe(message) or message.get_type()}')
            self._record(message)
        self.runner.advance(now)

    def _same_device(self, source: Address, device: Address | None) -> bool:
        return source == device or (
            device is not None and source.component == device.component == self._component)

    def _record(self, message: Message) -> None:
        if (received := self._received.get(type(message))) is not None:
            received.append((self.now, message))
        if isinstance(message, CommandAck) and message.command in self._latest:
            self._latest[message.command].acknowledge(
                Ack(self.now, message.result, message.progress, messages.target_of(message)),
                self.log[-1])

    def poll(self, now: float) -> None:
        """See :meth:`Endpoint.poll`."""
        self._at(now)
        self._heartbeat.poll(now)
        self.runner.advance(now)

    def next_deadline(self) -> float:
        """See :meth:`Endpoint.next_deadline`."""
        return min(self._heartbeat.due, self.runner.next_deadline())

    def interrupt(self, now: float) -> None:
        """End the run, unless it restores the device."""
        self._at(now)
        self.runner.interrupt(now)

    def _at(self, now: float) -> None:
        self._began = now if self._began is None else self._began
        self.runner.now = now

    def _note(self, direction: str, text: str) -> None:
        self.log.append(f'{self.now - (self._began or 0.0):8.3f} s {direction} {text}')

    # The record

    @property
    def now(self) -> float:
        """Return the time of the latest message or poll, s."""
        return self.runner.now

    @property
    def device(self) -> Address:
        """Return the address of the device, which must have been heard."""
        assert self.found is not None
        return self.found

    def free_component(self, first: int = 192) -> Address:
        """
        Return an address of the device's system from which nothing was heard.

        :param first: the lowest component id.
        :raises Skipped: if all are in use.
        """
        system, taken = self.device.system, self.heard | {self.address, self.device}
        for component in range(first, 256):
            if (system, component) not in taken:
                return Address(system, component)
        raise Skipped(f'each component id from {first} of system {system} is in use')

    def free_system(self) -> int:
        """
        Return a system id from which nothing was heard.

        :raises Skipped: if all are in use.
        """
        taken = {one.system for one in self.heard | {self.address, self.device}}
        for system in range(240, 0, -1):
            if system not in taken:
                return system
        raise Skipped('each system id up to 240 is in use')

    @property
    def identity(self) -> str:
        """Return the names that the device has sent, '' if there are none."""
        received = self.received(messages.ComponentInformationBasic)
        one = Identity.from_message(received[-1][1]) if received else Identity()
        return ', '.join(filter(None, (one.vendor, one.model, one.serial_number)))

    def received(self, cls: type[M]) -> History[tuple[float, M]]:
        """Return the messages of a class that the device has sent, with their times, s."""
        return cast(History[tuple[float, M]], self._received.get(cls, History()))

    def idle(self, cls: type[M]) -> list[tuple[float, M]]:
        """Return the messages that the device sent before the session sent a command."""
        return [(at, one) for at, one in self.received(cls) if at <= self.idle_until]

    def send(self, message: Message, source: Address | None = None) -> None:
        """Send a message from an address, by default the session's."""
        self._give(message, self._describe(message) or message.get_type(), source)

    def _give(self, message: Message, text: str, source: Address | None) -> None:
        self.outgoing.append((source or self.address, message))
        self._note('>', text + (f' from {source}' if source else ''))

    def check_presence(self) -> None:
        """
        Check that the device still sends.

        :raises DeviceLost: if it has stopped.
        """
        if self.now - self._last_heard > LOST_TIMEOUT:
            raise DeviceLost

    # For coroutines

    async def find(self, timeout: float, listen: float) -> None:
        """
        Wait for the device, and request its discovery message if there is one; then only listen.

        :param timeout: s to wait for the device.
        :param listen: s to listen; :attr:`idle_until` is their end.
        """
        end = self.now + timeout
        while self.found is None and self.now < end:
            if self._discovery is not None:
                self._send(Transaction(mavlink.MAV_CMD_REQUEST_MESSAGE, (self._discovery.id,),
                                       False),
                           Address(0, 0))
            await self.runner.until(lambda: self.found, min(DISCOVERY_INTERVAL, end - self.now))
        if self.found is not None:
            await self.runner.sleep(listen)
            self.idle_until = self.now

    async def receive_more(
        self, cls: type[M], timeout: float, count: int = 1,
    ) -> list[tuple[float, M]]:
        """Return the messages of a class that come within ``timeout`` s, or until the count-th."""
        received = self.received(cls)
        before = received.total
        await self.runner.until(lambda: received.total >= before + count, timeout)
        return received.since(before)

    async def command(
        self, command: int, *params: float, as_int: bool = False, confirmation: int = 0,
        target: Address | None = None, source: Address | None = None,
    ) -> Transaction:
        """
        Send a command; repeat it while it is not acknowledged or is temporarily rejected.

        :param as_int: whether it is sent as COMMAND_INT.
        :param target: None for the device.
        :param source: the address that sends it, None for the session's.
        :raises DeviceLost: if the device has stopped sending.
        """
        is_deaf = len(self.transactions) >= UNANSWERED and not any(
            one.acks for one in self.transactions)
        attempts, timeout = (1, MESSAGE_TIMEOUT) if is_deaf else (ATTEMPTS, ACK_TIMEOUT)
        # A device that has rejected a command temporarily so often is not waited for again.
        is_stuck = any(one.rejections == REJECTIONS for one in self.transactions)
        for rejections in range(1, 2 if is_stuck else REJECTIONS + 1):
            # Separate requirements cover COMMAND_INT and other addresses.
            one = self._begin(
                command, params, expected=not as_int and target is None and source is None)
            for attempt in range(attempts):
                self._send(one, target or self.device, confirmation + attempt, as_int=as_int,
                           source=source)
                if await self._answered(one, timeout):
                    break
                self.check_presence()
            if one.result != mavlink.MAV_RESULT_TEMPORARILY_REJECTED:
                break
            one.rejections = rejections
            await self.runner.sleep(REJECTION_PAUSE)
        return one

    async def send_to_other(self, target: Address, command: int, *params: float) -> Transaction:
        """Send a command to another address, and return it with the answers of the device."""
        one = self._begin(command, params, expected=False)
        self._send(one, target)
        await self.runner.until(lambda: one.acks, NO_ANSWER_TIME)
        await self.runner.sleep(SETTLE_TIME)
        return one

    async def required(self, cls: type[M]) -> M:
        """Request a message and return it; raise Skipped if it does not come."""
        message = await self.request(cls)
        if message is None:
            raise Skipped(f'no {cls.msgname} was received')
        return message

    async def request(self, cls: type[M]) -> M | None:
        """Request a message until it comes; return it, None if it does not come."""
        for _ in range(ATTEMPTS):
            before = self.received(cls).total
            one = await self.command(mavlink.MAV_CMD_REQUEST_MESSAGE, cls.id)
            if not one.accepted and one.result is not None:
                return None
            if self.received(cls).total > before or await self.receive_more(cls, MESSAGE_TIMEOUT):
                return self.received(cls)[-1][1]
        return None

    def _begin(self, command: int, params: tuple[float, ...], *, expected: bool) -> Transaction:
        one = self._latest[command] = Transaction(command, params, expected)
        self.transactions.append(one)
        return one

    def _send(
        self, one: Transaction, target: Address, confirmation: int = 0, *, as_int: bool = False,
        source: Address | None = None,
    ) -> None:
        values = [*map(float, one.params), *[0.0] * (7 - len(one.params))]
        message = messages.CommandInt(
            *target, 0, one.command, 0, 0, values[0], values[1], values[2], values[3],
            int(values[4]), int(values[5]), values[6],
        ) if as_int else messages.CommandLong(
            *target, one.command, min(confirmation, 255), *values)
        one.sent.append(self.now)
        self._give(message, f'{message.get_type()} to {target}: {one.text}'
                   + (f', confirmation {confirmation}' if confirmation else ''), source)
        one.lines.append(self.log[-1])

    async def _acknowledged(self, one: Transaction, timeout: float) -> bool:
        before = len(one.acks)
        return await self.runner.until(lambda: len(one.acks) > before, timeout)

    async def _answered(self, one: Transaction, timeout: float) -> bool:
        """Wait for the result of an attempt; return whether the device has received it."""
        if not await self._acknowledged(one, timeout):
            return False
        # After a report of progress the command must not be sent again.
        await self.runner.until(lambda: one.finals, PROGRESS_LIMIT)
        # A late acknowledgement must not be assigned to the next command.
        if len(one.sent) > 1:
            await self.runner.until(lambda: len(one.finals) >= len(one.sent), ACK_TIMEOUT)
        await self.runner.sleep(SETTLE_TIME)
        return True
