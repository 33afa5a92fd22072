# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""An endpoint on a bench: messages in, messages out, and a clock that jumps."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
import heapq
import itertools
import math
from typing import Any, Protocol, TypeVar

from illuminator_ros.mavlink.messages import (
    Address,
    CommandAck,
    CommandInt,
    CommandLong,
    Message,
)
from illuminator_ros.mavlink.schedule import Schedule
from illuminator_ros.simulation.simulated import SimulatedComponent

GROUND = Address(255, 190)
B = TypeVar('B', bound='Bench')
M = TypeVar('M')


class Scheduled(Protocol):
    """The part of an endpoint that a :class:`Bench` drives."""

    outgoing: deque[tuple[Address, Message]]
    schedule: Schedule


class Bench:
    """
    One endpoint, called when it wants to be, and never else.

    :ivar now: s.
    :ivar sent: each message that it has sent, with its time.
    """

    def __init__(self, endpoint: Scheduled, now: float) -> None:
        self.endpoint = endpoint
        self.now = now
        self.sent: list[tuple[float, Any]] = []
        self._later: list[tuple[float, int, Callable[[], object]]] = []
        self._number = itertools.count()

    def answer(self, source: Address, message: Any) -> None:
        """Act on a message that the endpoint has sent, as its peer does."""

    def later(self, seconds: float, call: Callable[[], object]) -> None:
        """Call something after a time."""
        heapq.heappush(self._later, (self.now + seconds, next(self._number), call))

    def flush(self) -> None:
        """Take what the endpoint sends, and what it sends to the answers."""
        while self.endpoint.outgoing:
            source, message = self.endpoint.outgoing.popleft()
            self.sent.append((self.now, message))
            self.answer(source, message)

    @property
    def due(self) -> float:
        """Return when :meth:`poll` is due."""
        return self.endpoint.schedule.due

    def poll(self) -> None:
        """Do what is due."""
        self.endpoint.schedule.run(self.now)
        self.flush()

    def step(self, until: float = math.inf) -> bool:
        """Advance to the next event up to then; return whether there is one."""
        self.flush()
        due = min(self.due, self._later[0][0] if self._later else math.inf)
        if due > until or due == math.inf:
            return False
        self.now = max(self.now, due)
        if self._later and self._later[0][0] <= self.now:
            heapq.heappop(self._later)[2]()
        self.poll()
        return True

    def run_until(self, until: float = math.inf) -> None:
        """Let time pass until then, or until nothing is due."""
        while self.step(until):
            pass
        self.now = until if until < math.inf else self.now

    def run(self: B, seconds: float) -> B:
        """Let time pass."""
        self.run_until(self.now + seconds)
        return self

    def give(self, source: Address, *messages: Message) -> list[Any]:
        """Return the messages that the endpoint sends at once when it receives others."""
        before = len(self.sent)
        for message in messages:
            self.endpoint.receive(source, message, self.now)  # type: ignore[attr-defined]
        self.flush()
        return [message for _, message in self.sent[before:]]

    def messages(self, cls: type[M], since: float = 0.0) -> list[M]:
        """Return the messages of a class that the endpoint has sent."""
        return [message for at, message in self.sent if at >= since and isinstance(message, cls)]

    def timed(self, cls: type[M]) -> list[tuple[float, M]]:
        """Return the same with their times."""
        return [(at, message) for at, message in self.sent if isinstance(message, cls)]


class DeviceBench(Bench):
    """
    One simulated device.

    :ivar component: its component.
    :cvar peer: the sender of commands unless another one is given.
    """

    peer = GROUND

    def __init__(self, device: Any, now: float = 0.0) -> None:
        self.component: SimulatedComponent[Any] = SimulatedComponent(device, now)
        super().__init__(self.component, now)
        self.device = device

    def command(
        self, command: int, *params: float, source: Address | None = None,
        target: tuple[int, int] | None = None, form: type = CommandLong, frame: int = 0,
    ) -> list[Any]:
        """Send a command and return the messages that answer it at once."""
        to = target or self.component.address
        one, two, three, four, five, six, seven = [*params, *[0.0] * (7 - len(params))]
        return self.give(source or self.peer, CommandInt(
            *to, frame, command, 0, 0, one, two, three, four, int(five), int(six), seven)
            if form is CommandInt else CommandLong(
            *to, command, 0, one, two, three, four, five, six, seven))

    def result(self, command: int, *params: float, **options: Any) -> int:
        """Send a command and return the MAV_RESULT that answers it."""
        return next(int(one.result) for one in self.command(command, *params, **options)
                    if isinstance(one, CommandAck))
