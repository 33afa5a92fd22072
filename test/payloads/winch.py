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
from illuminator_ros.mavlink.command_sender import CommandSender
from illuminator_ros.mavlink.component import Payload
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import AnyCommand
from illuminator_ros.payload import simulated
from illuminator_ros.payload.confirmed_command import Done, Result, Target
from illuminator_ros.payload.device_property import answer, Caller, Desired, Property
from illuminator_ros.payload.discovery import Discovery
from illuminator_ros.payload.faults import Behaviour
from illuminator_ros.payload.listeners import Listeners
from illuminator_ros.payload.liveness import Liveness
from illuminator_ros.payload.payload_type import PayloadType

WINCH = PayloadType('winch', ros='payloads.winch_ros:WINCH',
                    simulated='payloads.winch:SIMULATED', checks='payloads.winch_checks:CHECKS',
                    view='payloads.winch_view:VIEW')

WinchStatus = mavlink.MAVLink_winch_status_message
# s without a message after which a winch is lost.
TIMEOUT = 3.0


@dataclass(frozen=True)
class WinchReport:
    """The released line of a winch, m."""

    address: mav.Address
    line_length: float


@dataclass(frozen=True)
class Release:
    """
    Releases line, m, or winds it in if negative.

    :param line_length: the released line afterwards, m.
    """

    length: float
    line_length: float
    note: str = ''
    position: None = None
    command: int = mavlink.MAV_CMD_DO_WINCH
    # A winch that gets it twice releases twice the length.
    is_idempotent: bool = False
    is_repeated: bool = False

    @property
    def params(self) -> tuple[float, ...]:
        """See :class:`Change`."""
        return 1, mavlink.WINCH_RELATIVE_LENGTH_CONTROL, self.length

    @property
    def goal(self) -> str:
        """See :class:`Change`."""
        return f'{self.line_length:g} m released'

    def shown_by(self, status: WinchStatus) -> bool:
        """See :class:`Change`."""
        return abs(status.line_length - self.line_length) < 0.01

    def evidence(self, status: WinchStatus) -> str:
        """See :class:`Change`."""
        return 'confirmed by WINCH_STATUS'

    def actual(self, status: WinchStatus) -> str:
        """See :class:`Change`."""
        return f'{status.line_length:g} m'


class Winch:
    """One winch: a :class:`Device` of the discovery."""

    def __init__(self, address: mav.Address, commands: CommandSender) -> None:
        self.address = address
        self.liveness = Liveness(TIMEOUT)
        self.was_commanded = False
        self._line_length = 0.0
        self._length: Property[WinchStatus] = Property(
            Target(address, commands, 'winch', WinchStatus.id, WinchStatus.msgname))

    @property
    def lost_at(self) -> float:
        """See :class:`Device`."""
        return self.liveness.lost_at

    def take_status(self, status: WinchStatus, now: float) -> None:
        """Take a status."""
        self.liveness.hear(now)
        self._line_length = status.line_length
        self._length.reported(status, now)
        self._answer(now)

    def release(self, length: float, now: float, done: Done) -> None:
        """
        Release line, m, or wind it in if negative; ``done`` gets the confirmed result.

        A release that is under way is not replaced: it may have been executed.
        """
        self.was_commanded = True
        if self._length.desired is not None:
            done(Result(False, 'a release is under way'), now)
            return
        self._length.want(
            Desired(Release(length, self._line_length + length)), now, Caller(done, now))

    def _answer(self, now: float) -> None:
        while self._length.outcomes:
            outcome = self._length.outcomes.popleft()
            answer(outcome.callers, outcome.result, now)

    def poll(self, now: float) -> None:
        """See :class:`Device`."""
        if now >= self.liveness.next_deadline():
            self.liveness.lose(now)
        self._length.poll(now)
        self._answer(now)

    def next_deadline(self) -> float:
        """See :class:`Device`."""
        return min(self.liveness.next_deadline(), self._length.next_deadline())


class WinchClient(Payload):
    """
    Finds winches on a link; each releases line.

    :ivar events: a :class:`WinchReport` for each status.
    :ivar winches: the winches that were found, by address.
    """

    messages = (mav.Heartbeat, WinchStatus)

    def __init__(self, commands: CommandSender) -> None:
        self.events: Listeners[WinchReport] = Listeners()
        self._discovery = Discovery[mav.Address, Winch]()
        self.winches: Mapping[mav.Address, Winch] = self._discovery.devices
        self._make = partial(Winch, commands=commands)

    def poll(self, now: float) -> None:
        """See :meth:`Payload.poll`."""
        self._discovery.poll(now)

    def next_deadline(self) -> float:
        """See :meth:`Payload.next_deadline`."""
        return self._discovery.next_deadline()

    def receive(self, source: mav.Address, message: mav.Message, now: float) -> None:
        """See :meth:`Payload.receive`."""
        if isinstance(message, WinchStatus):
            if winch := self._discovery.hear(source, now, self._make, proved=True):
                winch.take_status(message, now)
                self.events.emit(WinchReport(source, message.line_length))
        elif (isinstance(message, mav.Heartbeat) and message.type == mavlink.MAV_TYPE_WINCH
                and (winch := self._discovery.hear(source, now, self._make, proved=False))):
            winch.liveness.hear(now)


class SimulatedWinch(simulated.SimulatedDevice):
    """A winch that releases and winds in at once."""

    changes = frozenset({mavlink.MAV_CMD_DO_WINCH})
    sends = (WinchStatus,)

    def __init__(self, properties: simulated.Properties) -> None:
        super().__init__(properties)
        self.line_length = 0.0

    def streams(self) -> Mapping[int, float]:
        """See :meth:`SimulatedDevice.streams`."""
        return {WinchStatus.id: 1.0}

    def message(self, message_id: int, now: float) -> mav.Message | None:
        """See :meth:`SimulatedDevice.message`."""
        return (WinchStatus(int(now * 1e6), self.line_length, 0, 0, 12, 0, 25, 1)
                if message_id == WinchStatus.id else None)

    def execute(
        self, source: mav.Address, command: AnyCommand, now: float,
    ) -> simulated.Reply:
        """See :meth:`SimulatedDevice.execute`."""
        if command.command != mavlink.MAV_CMD_DO_WINCH:
            return None
        length = self.line_length + command.param3
        if command.param2 != mavlink.WINCH_RELATIVE_LENGTH_CONTROL or not length >= 0:
            return simulated.CommandReply(mavlink.MAV_RESULT_DENIED)
        return simulated.CommandReply(mavlink.MAV_RESULT_ACCEPTED,
                                      partial(self.set_length, length))

    def set_length(self, length: float) -> None:
        """Release or wind in until this length of line is released, m."""
        self.line_length = length

    def snapshot(self, now: float) -> simulated.Snapshot:
        """See :meth:`SimulatedDevice.snapshot`."""
        return simulated.Snapshot(f'{self.line_length:.1f} m released', (self.line_length,))


SIMULATED = simulated.SimulatedType(
    'winch', 'winches', SimulatedWinch, simulated.Properties(
        mav.Address(1, 169), Behaviour(heartbeat_type=mavlink.MAV_TYPE_WINCH)))
