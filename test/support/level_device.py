# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A device with one level, a command sender, and a line with a latency between them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection
import functools
from typing import Any

from illuminator_ros.mavlink.command_sender import CommandSender
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address, CommandAck
from illuminator_ros.payload.attempt import Change, Target
from support.bench import Bench

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


class LevelBench(Bench, ABC):
    """
    The sending side of a command under test, and the device; times are s since the start.

    :ivar level: of the device.
    :ivar results: its answers to the commands, None for none, a tuple for several; used up from
        the front, and the last one is kept.
    :ivar executes: the last results of the commands that it executes.
    :ivar sends_status: whether it sends its status on request.
    :ivar tries: when commands were sent; likewise ``requests`` for the status.
    """

    def __init__(self, level: int | None = 0, *results: Any, **device: Any) -> None:
        self.commands = CommandSender(US)
        super().__init__(self.commands, 0.0)
        self.level = level
        self.results = list(results or [ACCEPTED])
        self.executes: Collection[int | None] = (ACCEPTED,)
        self.sends_status = True
        self.tries: list[float] = []
        self.requests: list[float] = []
        for name, value in device.items():
            setattr(self, name, value)

    def target(self, **options: Any) -> Target:
        """Return the device as the target of commands."""
        return Target(DEVICE, self.commands, 'device', lambda now: self.act(), **{
            'status_id': STATUS_ID, 'status_name': 'STATUS', **options})

    # The sending side

    @abstractmethod
    def reported(self, level: int | None) -> None:
        """Take a status."""

    @abstractmethod
    def act(self) -> None:
        """Do what is due."""

    @property
    @abstractmethod
    def act_due(self) -> float:
        """Return when :meth:`act` has something to do."""

    @property
    def due(self) -> float:
        """See :class:`Bench`."""
        return min(super().due, self.act_due)

    def poll(self) -> None:
        """See :class:`Bench`."""
        self.commands.schedule.run(self.now)
        self.act()
        self.flush()

    # The line and the device

    def answer(self, source: Address, message: Any) -> None:
        """Put what was sent on the line."""
        self.later(LATENCY, functools.partial(self._receive, message))
        (self.tries if message.command == SET_LEVEL else self.requests).append(round(self.now, 3))

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
