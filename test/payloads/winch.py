# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
A winch: a second payload, the worked example of doc/design.md; its ROS half is winch_ros.py.

It is found by its heartbeat, takes MAV_CMD_DO_WINCH, and reports WINCH_STATUS.
https://mavlink.io/en/messages/common.html#WINCH_STATUS
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

from illuminator_ros import checks, simulation
from illuminator_ros.mavlink import (
    Address,
    AnyCommand,
    CommandSender,
    DeviceKind,
    Heartbeat,
    mavlink,
    Message,
    Payload,
)
from illuminator_ros.payload import (
    Change,
    Discovery,
    Done,
    Goal,
    Listeners,
    Liveness,
    PayloadType,
    plan_of,
    Property,
    Request,
    Requests,
    Result,
    Sending,
    Served,
    Target,
    Why,
)

WinchStatus = mavlink.MAVLink_winch_status_message
WINCH = PayloadType('winch', ros='payloads.winch_ros:WINCH', simulated='payloads.winch:SIMULATED',
                    checks='payloads.winch:CHECKS', view='payloads.winch_ros:VIEW',
                    device=DeviceKind('winch', mavlink.MAV_TYPE_WINCH, (WinchStatus.id,)))


# The client

@dataclass(frozen=True)
class WinchReport:
    """The released line of a winch, m."""

    address: Address
    line_length: float


def release(length: float, line_length: float) -> Change[WinchStatus]:
    """Return the change by a length of line, m, to the released line afterwards, m."""
    # A winch that gets the command twice releases twice the length.
    return Change(
        mavlink.MAV_CMD_DO_WINCH, (1, mavlink.WINCH_RELATIVE_LENGTH_CONTROL, length),
        f'{line_length:g} m released', sending=Sending.ONCE,
        shown_by=lambda status: abs(status.line_length - line_length) < 0.01,
        actual=lambda status: f'{status.line_length:g} m')


class Winch:
    """One winch: a :class:`Device` of the discovery."""

    def __init__(self, address: Address, commands: CommandSender) -> None:
        self.liveness = Liveness(timeout=3.0)
        self.was_commanded = False
        self._schedule = commands.schedule
        self._requests = Requests(f'winch {address}')
        self._status: WinchStatus | None = None
        self._length: Property[WinchStatus] = Property(
            Target(address, commands, 'winch', self.poll, WinchStatus.id, WinchStatus.msgname),
            plan_of(self._change))

    @property
    def lost_at(self) -> float:
        return self.liveness.lost_at

    def heard(self, now: float) -> None:
        self.liveness.hear(now)
        self._step(now)

    def receive_status(self, status: WinchStatus, now: float) -> None:
        gap = now - self.liveness.heard_at
        self.liveness.hear(now)
        self._status = status
        self._end(self._length.reported(status, gap, now), now)

    def release(self, length: float, now: float, done: Done) -> None:
        """
        Release line, m, or wind it in if negative; ``done`` gets the confirmed result.

        A release that is under way is not replaced: it may have been executed.
        """
        self.was_commanded = True
        if self._length.attempt is not None:
            done(Result(False, 'a release is under way'), now)
        else:
            self._requests.put(Request({'length': length}, Why.REQUEST, now, done=done,
                                       is_call=True), now)
            self._step(now)

    def _change(self, goal: Goal) -> Change[WinchStatus]:
        out = self._status.line_length if self._status else 0.0
        return release(goal.values, out + goal.values)

    def _step(self, now: float) -> None:
        """Send what is wanted, and answer those whose requests have ended."""
        goal = Goal.strongest(self._requests.live(), 'length', now)
        self._length.steer(goal, now, self._status, 0.0 if self._status else None)
        self._requests.send_replies(now)
        self._schedule.at(self.poll, min(self.liveness.silent_at, self._length.due))

    def _end(self, served: list[Served[WinchStatus]], now: float) -> None:
        for one in served:
            self._requests.end(one.request, one.result, now)
        self._step(now)

    def poll(self, now: float) -> None:
        if now >= self.liveness.silent_at:
            self.liveness.lose(now)
        self._end(self._length.poll(now), now)


class WinchClient(Payload):
    """
    Finds winches on a link; each releases line.

    :ivar events: a :class:`WinchReport` for each status.
    :ivar winches: the winches that were found, by address.
    """

    messages = (Heartbeat, WinchStatus)

    def __init__(self, commands: CommandSender) -> None:
        self.events: Listeners[WinchReport] = Listeners()
        self._discovery = Discovery[Address, Winch](commands.schedule)
        self.winches: Mapping[Address, Winch] = self._discovery.devices
        self._hear = partial(self._discovery.hear, make=partial(Winch, commands=commands))

    def receive(self, source: Address, message: Message, now: float) -> None:
        if isinstance(message, WinchStatus):
            if winch := self._hear(source, now, proved=True):
                winch.receive_status(message, now)
                self.events.emit(WinchReport(source, message.line_length))
        elif (isinstance(message, Heartbeat) and message.type == mavlink.MAV_TYPE_WINCH
                and (winch := self._hear(source, now, proved=False))):
            winch.heard(now)


# The simulated device

class SimulatedWinch(simulation.SimulatedDevice):
    """A winch that releases and winds in at once."""

    changes = frozenset({mavlink.MAV_CMD_DO_WINCH})
    line_length = 0.0

    def reports(self) -> Mapping[type[Message], simulation.Report]:
        return {WinchStatus: simulation.Report(lambda now: WinchStatus(
            int(now * 1e6), self.line_length, 0, 0, 12, 0, 25, 1), interval=1.0)}

    def execute(self, source: Address, command: AnyCommand, now: float) -> simulation.Reply:
        if command.command != mavlink.MAV_CMD_DO_WINCH:
            return None
        length = self.line_length + command.param3
        if command.param2 != mavlink.WINCH_RELATIVE_LENGTH_CONTROL or not length >= 0:
            return simulation.CommandReply(mavlink.MAV_RESULT_DENIED)
        return simulation.CommandReply(
            mavlink.MAV_RESULT_ACCEPTED, partial(setattr, self, 'line_length', length))

    def snapshot(self, now: float) -> simulation.Snapshot:
        return simulation.Snapshot(f'{self.line_length:.1f} m released', (self.line_length,))


SIMULATED = simulation.SimulatedType(
    'winch', 'winches', SimulatedWinch, simulation.Properties(
        Address(1, 169), simulation.Behaviour(heartbeat_type=mavlink.MAV_TYPE_WINCH)))


# The checks

class WinchSession(checks.Session):
    """Releases line, and winds it in at the end."""

    messages = (*checks.Session.messages, WinchStatus)
    mav_type = mavlink.MAV_TYPE_WINCH
    before: float | None = None

    async def length(self) -> float | None:
        """Return the released length, m; None if the winch does not report it."""
        status = await self.request(WinchStatus)
        return status.line_length if status else None

    async def release(self, length: float) -> checks.Transaction:
        return await self.command(
            mavlink.MAV_CMD_DO_WINCH, 1, mavlink.WINCH_RELATIVE_LENGTH_CONTROL, length)

    async def save(self) -> str | None:
        self.before = await self.length()
        return None if self.before is None else f'{self.before} m'

    async def restore(self) -> list[str]:
        await self.release((self.before or 0.0) - (await self.length() or 0.0))
        return [] if await self.length() == self.before else ['line_length']


@checks.requirement(
    'release', 'releases line when commanded', checks.MESSAGES, 'MAV_CMD_DO_WINCH', changes=True)
async def releases(winch: WinchSession) -> None:
    before = await winch.length()
    one = await winch.release(2.0)
    after = await winch.length()
    if before is None or after != before + 2.0:
        raise one.failure(f'{before} m, then {after} m')


CHECKS = checks.PayloadChecks(
    'winch', 'winch', WinchSession, 'HEARTBEAT with MAV_TYPE_WINCH',
    checks.with_common((releases,), WinchStatus))
