# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A device with one level, a command sender, and a line with a latency between them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection
import functools
import heapq
import itertools
import math
from typing import Any

from illuminator_ros.mavlink.command_sender import CommandSender
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address, CommandAck
from illuminator_ros.payload.attempt import Change, Target

US, DEVICE = Address(1, 194), Address(1, 7)
SET_LEVEL, STATUS_ID = 31000, 40000
ACCEPTED, REJECTED, DENIED, FAILED, IN_PROGRESS = (
    mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_TEMPORARILY_REJECTED,
    mavlink.MAV_RESULT_DENIED, mavlink.MAV_RESULT_FAILED, mavlink.MAV_RESULT_IN_PROGRESS)
# s each way.
LATENCY = 0.01


def level_change(level: int, **options: Any) -> Change[int | None]:
    """Return the change to a level of the device; a status of None cannot show it."""
    return Change(
        SET_LEVEL, (float(level),), f'level {level}',
        shown_by=lambda status: None if status is None else status == level,
        actual=lambda status: f'level {status}',
        evidence=lambda status: 'accepted' if status is None else 'confirmed by STATUS',
        **options)


class Bench(ABC):
    """
    The sending side of a command under test, and the device; times are s since the start.

    :ivar level: of the device.
    :ivar results: its answers to the commands, None for none, a tuple for several; used up from
        the front, and the last one is kept.
    :ivar executes: the last results of the commands that it executes.
    :ivar sends_status: whether it sends its status on request.
    :ivar tries: when commands were sent; likewise ``requests`` for the status.
    :ivar sent: the commands.
    """

    def __init__(self, level: int | None = 0, *results: Any, **device: Any) -> None:
        self.now = 0.0
        self.commands = CommandSender(US)
        self.level = level
        self.results = list(results or [ACCEPTED])
        self.executes: Collection[int | None] = (ACCEPTED,)
        self.sends_status = True
        self.sent: list[Any] = []
        self.tries: list[float] = []
        self.requests: list[float] = []
        self._line: list[tuple[float, int, Callable[[], None]]] = []
        self._number = itertools.count()
        for name, value in device.items():
            setattr(self, name, value)

    def target(self, **options: Any) -> Target:
        """Return the device as the target of commands."""
        return Target(DEVICE, self.commands, 'device', **{
            'status_id': STATUS_ID, 'status_name': 'STATUS', **options})

    # The sending side

    @abstractmethod
    def reported(self, level: int | None) -> None:
        """Take a status."""

    @abstractmethod
    def poll(self) -> None:
        """Do what is due."""

    @abstractmethod
    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""

    def step(self, until: float = math.inf) -> bool:
        """Let time pass until something happens before then; return whether it does."""
        self.flush()
        due = min(self.commands.next_deadline(), self.next_deadline(),
                  self._line[0][0] if self._line else math.inf)
        if due >= until:
            return False
        self.now = max(self.now, due)
        if self._line and self._line[0][0] <= self.now:
            heapq.heappop(self._line)[2]()
        self.commands.poll(self.now)
        self.poll()
        return True

    def run(self, until: float = math.inf) -> None:
        """Let time pass until then, or until nothing is due."""
        while self.step(until):
            pass
        self.flush()
        self.now = until

    # The line and the device

    def flush(self) -> None:
        """Put what was sent on the line."""
        while self.commands.outgoing:
            message: Any = self.commands.outgoing.popleft()[1]
            self.later(LATENCY, functools.partial(self._receive, message))
            at = round(self.now, 3)
            if message.command == SET_LEVEL:
                self.sent.append(message)
                self.tries.append(at)
            else:
                self.requests.append(at)

    def later(self, seconds: float, call: Callable[[], None]) -> None:
        """Call something after a time."""
        heapq.heappush(self._line, (self.now + seconds, next(self._number), call))

    def acknowledge(self, result: int) -> None:
        """Acknowledge a command at once."""
        self.commands.acknowledge(DEVICE, CommandAck(SET_LEVEL, result, 0, 0, *US), self.now)

    def _receive(self, message: Any) -> None:
        if message.command != SET_LEVEL:
            if self.sends_status:
                self.later(LATENCY, functools.partial(self.reported, self.level))
            return
        results = self.results.pop(0) if len(self.results) > 1 else self.results[0]
        results = results if isinstance(results, tuple) else (results,)
        for place, result in enumerate(results):
            if result is not None:
                self.later(LATENCY * (1 + place), functools.partial(self.acknowledge, result))
        if results[-1] in self.executes:
            self.level = int(message.param1)
