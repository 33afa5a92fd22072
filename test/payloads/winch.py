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
A winch: a second payload, the worked example of doc/design.md.

It is found by its heartbeat, takes MAV_CMD_DO_WINCH, and reports WINCH_STATUS.
https://mavlink.io/en/messages/common.html#WINCH_STATUS
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.command import Command, CommandSender, Done
from illuminator_ros.payload import simulated
from illuminator_ros.payload.events import Listeners
from illuminator_ros.payload.faults import Behaviour
from illuminator_ros.payload.registry import PayloadType

WINCH = PayloadType(
    'winch', ros='payloads.winch_ros:WINCH', simulated='payloads.winch:SIMULATED',
    checks='payloads.winch_checks:CHECKS')

MAV_TYPE_WINCH = 42
DO_WINCH = 42600
WINCH_RELATIVE_LENGTH_CONTROL = 1


@mav.define(9005, 'WINCH_STATUS')
@dataclass(slots=True)
class WinchStatus(mav.Message):
    """See above."""

    time_usec: mav.UInt64
    line_length: mav.Float
    speed: mav.Float
    tension: mav.Float
    voltage: mav.Float
    current: mav.Float
    temperature: mav.Int16
    status: mav.UInt32


@dataclass(frozen=True)
class WinchReport:
    """The released line of a winch, m."""

    address: mav.Address
    line_length: float


class WinchClient:
    """
    Finds winches on a link and releases their line.

    :ivar events: a :class:`WinchReport` for each status.
    """

    messages = (mav.Heartbeat, WinchStatus)

    def __init__(self, commands: CommandSender) -> None:
        self.events: Listeners[WinchReport] = Listeners()
        self.winches: set[mav.Address] = set()
        self._commands = commands

    def release(self, winch: mav.Address, length: float, now: float, done: Done) -> None:
        """Release line, m, or wind it in if negative; ``done`` gets the outcome."""
        self._commands.start(
            Command(winch, DO_WINCH, (1, WINCH_RELATIVE_LENGTH_CONTROL, length)), now, done)

    def receive(self, source: mav.Address, message: object, now: float) -> None:
        """See :meth:`Payload.receive`."""
        if isinstance(message, mav.Heartbeat) and message.type == MAV_TYPE_WINCH:
            self.winches.add(source)
        elif isinstance(message, WinchStatus) and source in self.winches:
            self.events.emit(WinchReport(source, message.line_length))

    def link_opened(self, now: float) -> None:
        """See :meth:`Payload.link_opened`."""

    def link_closed(self, now: float, reason: str) -> None:
        """See :meth:`Payload.link_closed`."""

    def poll(self, now: float) -> None:
        """See :meth:`Payload.poll`."""

    def next_deadline(self) -> float:
        """See :meth:`Payload.next_deadline`."""
        return float('inf')


class SimulatedWinch(simulated.SimulatedDevice):
    """A winch that releases and winds in at once."""

    changes = frozenset({DO_WINCH})

    def __init__(self) -> None:
        super().__init__(Behaviour(heartbeat_type=MAV_TYPE_WINCH))
        self.line_length = 0.0

    def restart(self, now: float) -> None:
        """See :meth:`SimulatedDevice.restart`; the line stays where it is."""

    def streams(self) -> Mapping[int, float]:
        """See :meth:`SimulatedDevice.streams`."""
        return {WinchStatus.id: 1.0}

    def message(self, message_id: int, now: float) -> object:
        """See :meth:`SimulatedDevice.message`."""
        if message_id == WinchStatus.id:
            return WinchStatus(int(now * 1e6), self.line_length, 0, 0, 12, 0, 25, 1)
        return None

    def execute(self, command: simulated.AnyCommand, now: float) -> simulated.Reply:
        """See :meth:`SimulatedDevice.execute`."""
        if command.command != DO_WINCH:
            return None
        length = self.line_length + command.param3
        if command.param2 != WINCH_RELATIVE_LENGTH_CONTROL or not length >= 0:
            return simulated.CommandReply(mav.MavResult.DENIED)
        return simulated.CommandReply(mav.MavResult.ACCEPTED, partial(self.set_length, length))

    def set_length(self, length: float) -> None:
        """Release or wind in until so much of the line is released, m."""
        self.line_length = length

    def snapshot(self, now: float) -> simulated.Snapshot:
        """See :meth:`SimulatedDevice.snapshot`."""
        return simulated.Snapshot(f'{self.line_length:.1f} m released', (self.line_length,))

    def _release(self, words: list[str], now: float) -> simulated.Change:
        return partial(self.set_length, self.line_length + float(words[0]))

    commands = (simulated.ConsoleCommand('release M', 'release line', _release, (1,)),)


SIMULATED = simulated.SimulatedType(
    'winch', 'winches', SimulatedWinch,
    make=lambda settings, address, several: SimulatedWinch(),
    address=lambda settings: mav.Address(1, 169))
