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

"""What is said to a light, and what it says; all of it is kept. No I/O; time is passed in."""

from __future__ import annotations

import math
from typing import Any

from .describe import command_name, describe
from .script import Script
from .transaction import Transaction
from ..model import Status
from ...mavlink.component import Heartbeat as HeartbeatTimer
from ...mavlink.messages import (
    Address,
    CommandAck,
    CommandInt,
    CommandLong,
    ComponentInformationBasic,
    Heartbeat,
    IlluminatorStatus,
    MavCmd,
    MavResult,
    MavType,
)

# s. The developer guide's own tests wait 3 s for an acknowledgement.
ACK_TIMEOUT = 3.0
PROGRESS_TIMEOUT = 4.0
# s after which a command that is still reported to be in progress is not waited for any more.
PROGRESS_LIMIT = 15.0
TRIES = 4
# s in which a message that was requested or a change that was accepted has to show.
SHOW_TIMEOUT = 1.0
# s; a second acknowledgement of one command would come this soon.
SETTLE = 0.05
# s in which a message to somebody else would be answered.
SILENCE = 0.7
# s without a message after which an unanswered command means that the light is gone.
GONE = 5.0
# Temporary rejections in a row that are put up with, and s between the tries.
REJECTIONS = 12
REJECTION_PAUSE = 0.3


class LightGone(Exception):
    """The light has fallen silent."""


class Exchange(Script):
    """
    Talks to one light, and listens.

    :param identity: our own address.
    :param target: the light; None takes the first that is heard.
    :ivar found: the light, once it is heard.
    :ivar transactions: all commands, in order.
    :ivar log: a line for each message.
    """

    def __init__(self, identity: Address, target: Address | None) -> None:
        super().__init__()
        self.identity = identity
        self.target = target
        self.found: Address | None = None
        self.heard: set[Address] = set()
        self.heartbeats: list[tuple[float, Any]] = []
        self.statuses: list[tuple[float, Status]] = []
        self.informations: list[Any] = []
        self.transactions: list[Transaction] = []
        self.log: list[str] = []
        self._last_heard = -math.inf
        self._latest: dict[int, Transaction] = {}
        self._beat = HeartbeatTimer(identity, MavType.GCS)
        self._open = False

    # The endpoint

    def link_opened(self, now: float) -> None:
        """See :meth:`Endpoint.link_opened`."""
        self._open = True
        self._beat.send(now, self.outgoing)

    def link_closed(self, now: float, reason: str) -> None:
        """See :meth:`Endpoint.link_closed`."""
        self._open = False

    def receive(self, source: Address, message: Any, now: float) -> None:
        """See :meth:`Endpoint.receive`."""
        self._at(now)
        self.heard.add(source)
        if self.found is None and self._is_light(source, message):
            self.found = source
        if source == self.found:
            self._last_heard = now
            self._note('<', describe(message))
            self._take(message)
        self._advance()

    def _is_light(self, source: Address, message: Any) -> bool:
        if self.target is not None:
            return source == self.target
        return (isinstance(message, IlluminatorStatus)
                or isinstance(message, Heartbeat) and message.type == MavType.ILLUMINATOR)

    def _take(self, message: Any) -> None:
        if isinstance(message, Heartbeat):
            self.heartbeats.append((self.now, message))
        elif isinstance(message, IlluminatorStatus):
            self.statuses.append((self.now, Status.from_message(message)))
        elif isinstance(message, ComponentInformationBasic):
            self.informations.append(message)
        elif isinstance(message, CommandAck) and message.command in self._latest:
            transaction = self._latest[message.command]
            transaction.acks.append((self.now, message))
            transaction.lines.append(self.log[-1])

    def poll(self, now: float) -> None:
        """See :meth:`Endpoint.poll`."""
        if self._open:
            self._beat.poll(now, self.outgoing)
        super().poll(now)

    def next_deadline(self) -> float:
        """See :meth:`Endpoint.next_deadline`."""
        return min(self._beat.due if self._open else math.inf, super().next_deadline())

    def _note(self, direction: str, text: str) -> None:
        """Keep a line of the exchange."""
        self.log.append(f'{self.elapsed:8.3f} s {direction} {text}')

    # Commands

    @property
    def light(self) -> Address:
        """Return the light's address."""
        assert self.found is not None
        return self.found

    async def command(
        self, command: int, *params: float, as_int: bool = False, confirmation: int = 0,
        target: Address | None = None,
    ) -> Transaction:
        """Send a command, again where it must be, and return what it was answered with."""
        for _ in range(REJECTIONS):
            one = self._begin(command, params)
            # Checks of their own see to these.
            one.expected = not as_int and target is None
            for number in range(TRIES):
                self._send(one, params, confirmation + number, as_int, target or self.light)
                if await self._answered(one):
                    break
                self._must_be_there()
            if one.result != MavResult.TEMPORARILY_REJECTED:
                break
            await self.sleep(REJECTION_PAUSE)
        return one

    async def overheard(self, target: Address, command: int, *params: float) -> Transaction:
        """Send a command to somebody else, and return what the light answers all the same."""
        one = self._begin(command, params)
        one.expected = False
        self._send(one, params, 0, False, target)
        await self.until(lambda: one.acks, SILENCE)
        await self.sleep(SETTLE)
        return one

    def _begin(self, command: int, params: tuple[float, ...]) -> Transaction:
        text = ' '.join([command_name(command), *(f'{param:g}' for param in params)])
        one = Transaction(text, command)
        self.transactions.append(one)
        self._latest[command] = one
        return one

    def _send(
        self, one: Transaction, params: tuple[float, ...], confirmation: int, as_int: bool,
        target: Address,
    ) -> None:
        values = [*map(float, params), *[0.0] * (7 - len(params))]
        message = (
            CommandInt(*target, 0, one.command, 0, 0, values[0], values[1], values[2], values[3],
                       0, 0, 0.0) if as_int
            else CommandLong(*target, one.command, min(confirmation, 255), *values))
        one.sent.append(self.now)
        self.outgoing.append((self.identity, message))
        self._note('>', describe(message))
        one.lines.append(self.log[-1])

    async def _answered(self, one: Transaction) -> bool:
        """Wait for the result of a try, as long as progress is reported."""
        timeout, until = ACK_TIMEOUT, self.now + PROGRESS_LIMIT
        while self.now < until:
            seen = len(one.acks)
            await self.more(one.acks, seen, timeout)
            if one.finals:
                break
            if len(one.acks) == seen:
                return False
            timeout = PROGRESS_TIMEOUT
        # Whatever else comes must not be taken for the answer to the next command.
        if len(one.sent) > 1:
            await self.until(lambda: len(one.finals) >= len(one.sent), ACK_TIMEOUT)
        await self.sleep(SETTLE)
        return True

    def _must_be_there(self) -> None:
        if self.now - self._last_heard > GONE:
            raise LightGone

    async def request(self, message_id: int, came: list[Any]) -> Any:
        """Request a message until it comes, and return it, None if it does not."""
        for _ in range(TRIES):
            before = len(came)
            one = await self.command(MavCmd.REQUEST_MESSAGE, message_id)
            if not one.accepted and one.result is not None:
                return None
            if await self.more(came, before, SHOW_TIMEOUT):
                return came[-1]
        return None
