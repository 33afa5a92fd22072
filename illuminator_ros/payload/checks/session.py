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

"""A session with one device: commands, acknowledgements, and a record of all messages. No I/O."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
import math
from typing import cast, TypeVar

from .coroutine import CoroutineRunner
from .describe import command_name, describe
from .history import History
from .transaction import Ack, Transaction
from ...mavlink import messages
from ...mavlink.component import Endpoint, HeartbeatTimer
from ...mavlink.messages import Address, CommandAck, MavCmd, MavResult, Message

M = TypeVar('M', bound=Message)

# s
ACK_TIMEOUT = 3.0
PROGRESS_TIMEOUT = 4.0
PROGRESS_LIMIT = 15.0
MESSAGE_TIMEOUT = 1.0
# After a final acknowledgement, so that a duplicate is not taken for the next command's.
SETTLE_TIME = 0.05
# In which a device that must not answer may answer.
NO_ANSWER_TIME = 0.7
LOST_TIMEOUT = 5.0
REJECTION_PAUSE = 0.3

ATTEMPTS = 4
REJECTIONS = 12


class DeviceLost(Exception):
    """The device has stopped sending."""


class Session(Endpoint):
    """
    Sends commands to one device and records its messages.

    An endpoint of its own, not a payload of a component: it must see messages from system id 0
    and every acknowledgement, which a component handles or drops.

    :param address: our own address.
    :param payload_messages: the classes of the payload's messages.
    :param is_device: whether a message identifies its sender as a device of this payload.
    :param describe: text of a message of the payload.
    :param target: the device; None selects the first that is heard.
    :ivar found: the device, once it is heard.
    :ivar heard: all senders.
    :ivar devices: the senders that are devices of this payload.
    :ivar idle_until: end of the time in which the session only listened, s.
    :ivar transactions: all commands.
    :ivar log: a line for each message.
    """

    def __init__(
        self, address: Address, payload_messages: Sequence[type[Message]], *,
        is_device: Callable[[Message], bool], describe: Callable[[Message], str] = describe,
        target: Address | None = None,
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
        self.log: History[str] = History()
        self._received: dict[type[Message], History[tuple[float, Message]]] = {
            cls: History() for cls in self.messages}
        self._is_device = is_device
        self._describe = describe
        self._began: float | None = None
        self._last_heard = -math.inf
        self._latest: dict[int, Transaction] = {}
        self._heartbeat = HeartbeatTimer(address, messages.MavType.GCS)
        self._open = False

    # The endpoint

    def link_opened(self, now: float) -> None:
        """See :meth:`Endpoint.link_opened`."""
        self._open = True
        self._heartbeat.send(now, self.outgoing)

    def link_closed(self, now: float, reason: str) -> None:
        """See :meth:`Endpoint.link_closed`."""
        self._open = False

    def receive(self, source: Address, message: Message, now: float) -> None:
        """See :meth:`Endpoint.receive`."""
        self._at(now)
        self.heard.add(source)
        if self._is_device(message):
            self.devices.add(source)
        if self.found is None and (
                source == self.target if self.target else source in self.devices):
            self.found = source
        if source == self.found:
            self._last_heard = now
            self._note('<', message)
            self._record(message)
        self.runner.advance(now)

    def _record(self, message: Message) -> None:
        if (received := self._received.get(type(message))) is not None:
            received.append((self.now, message))
        if isinstance(message, CommandAck) and message.command in self._latest:
            self._latest[message.command].acknowledge(
                Ack(self.now, message.result, message.progress,
                    Address(message.target_system, message.target_component)), self.log.last)

    def poll(self, now: float) -> None:
        """See :meth:`Endpoint.poll`."""
        self._at(now)
        if self._open:
            self._heartbeat.poll(now, self.outgoing)
        self.runner.advance(now)

    def next_deadline(self) -> float:
        """See :meth:`Endpoint.next_deadline`."""
        return min(self._heartbeat.due if self._open else math.inf, self.runner.next_deadline())

    def interrupt(self, now: float) -> None:
        """End the run, unless it restores the device."""
        self._at(now)
        self.runner.interrupt(now)

    def _at(self, now: float) -> None:
        self._began = now if self._began is None else self._began
        self.runner.now = now

    def _note(self, direction: str, message: Message) -> None:
        elapsed = self.now - (self._began or 0.0)
        self.log.append(f'{elapsed:8.3f} s {direction} {self._describe(message)}')

    # The record

    @property
    def now(self) -> float:
        """Return the time of the latest message or poll, s."""
        return self.runner.now

    @property
    def device(self) -> Address:
        """Return the address of the device, which has been heard."""
        assert self.found is not None
        return self.found

    def received(self, cls: type[M]) -> History[tuple[float, M]]:
        """Return the messages of a class that the device has sent, with their times, s."""
        return cast(History[tuple[float, M]], self._received[cls])

    def idle(self, cls: type[M]) -> list[tuple[float, M]]:
        """Return those that the device sent before the session sent a command."""
        return [(at, one) for at, one in self.received(cls) if at <= self.idle_until]

    # For coroutines

    async def find(self, timeout: float, listen: float) -> None:
        """
        Wait for the device, then listen without sending a command.

        :param timeout: s to wait for the device.
        :param listen: s to listen; :attr:`idle_until` is the end of it.
        """
        if await self.runner.until(lambda: self.found, timeout):
            await self.runner.sleep(listen)
            self.idle_until = self.now

    async def receive_more(
        self, cls: type[M], timeout: float, count: int = 1,
    ) -> list[tuple[float, M]]:
        """Return the messages of a class that come within a time, s; end at the count-th."""
        received = self.received(cls)
        before = received.count
        await self.runner.until(lambda: received.count >= before + count, timeout)
        return received.since(before)

    async def command(
        self, command: int, *params: float, as_int: bool = False, confirmation: int = 0,
        target: Address | None = None,
    ) -> Transaction:
        """
        Send a command, repeatedly while it is not acknowledged or temporarily rejected.

        :param as_int: whether it is sent as COMMAND_INT.
        :param target: None for the device.
        :raises DeviceLost: if the device has stopped sending.
        """
        for _ in range(REJECTIONS):
            # Requirements of their own cover COMMAND_INT and other targets.
            one = self._begin(command, params, expected=not as_int and target is None)
            for attempt in range(ATTEMPTS):
                self._send(one, params, confirmation + attempt, as_int, target or self.device)
                if await self._answered(one):
                    break
                if self.now - self._last_heard > LOST_TIMEOUT:
                    raise DeviceLost
            if one.result != MavResult.TEMPORARILY_REJECTED:
                break
            await self.runner.sleep(REJECTION_PAUSE)
        return one

    async def send_to_other(self, target: Address, command: int, *params: float) -> Transaction:
        """Send a command to another address, and return what our device answers to it."""
        one = self._begin(command, params, expected=False)
        self._send(one, params, 0, False, target)
        await self.runner.until(lambda: one.acks, NO_ANSWER_TIME)
        await self.runner.sleep(SETTLE_TIME)
        return one

    async def request(self, cls: type[M]) -> M | None:
        """Request a message until it comes; return it, None if it does not come."""
        received = self.received(cls)
        for _ in range(ATTEMPTS):
            before = received.count
            one = await self.command(MavCmd.REQUEST_MESSAGE, cls.id)
            if not one.accepted and one.result is not None:
                return None
            if await self.runner.until(partial(received.since, before), MESSAGE_TIMEOUT):
                return received.last[1]
        return None

    def _begin(self, command: int, params: tuple[float, ...], *, expected: bool) -> Transaction:
        text = ' '.join([command_name(command), *(f'{param:g}' for param in params)])
        one = Transaction(text, command, expected)
        self.transactions.append(one)
        self._latest[command] = one
        return one

    def _send(
        self, one: Transaction, params: tuple[float, ...], confirmation: int, as_int: bool,
        target: Address,
    ) -> None:
        values = [*map(float, params), *[0.0] * (7 - len(params))]
        message = messages.CommandInt(
            *target, 0, one.command, 0, 0, values[0], values[1], values[2], values[3], 0, 0, 0.0,
        ) if as_int else messages.CommandLong(
            *target, one.command, min(confirmation, 255), *values)
        one.sent.append(self.now)
        self.outgoing.append((self.address, message))
        self._note('>', message)
        one.lines.append(self.log.last)

    async def _answered(self, one: Transaction) -> bool:
        """Wait for the result of an attempt, as long as progress is reported."""
        timeout, until = ACK_TIMEOUT, self.now + PROGRESS_LIMIT
        while self.now < until:
            seen = len(one.acks)
            await self.runner.until(partial(one.acks_since, seen), timeout)
            if one.finals:
                break
            if len(one.acks) == seen:
                return False
            timeout = PROGRESS_TIMEOUT
        # A late acknowledgement must not be assigned to the next command.
        if len(one.sent) > 1:
            await self.runner.until(lambda: len(one.finals) >= len(one.sent), ACK_TIMEOUT)
        await self.runner.sleep(SETTLE_TIME)
        return True
