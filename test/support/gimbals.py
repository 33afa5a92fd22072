# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A gimbal client and gimbal managers that a test controls, on one simulated clock."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
import itertools
import math
from typing import Any, TypeVar

from illuminator_ros.geometry.mount_attitude import YawFrame
from illuminator_ros.geometry.rotation import Vector
from illuminator_ros.gimbal import messages as gm
from illuminator_ros.gimbal.client import GimbalClient
from illuminator_ros.gimbal.commands import Move, NEUTRAL, RETRACT, YAW_LOCKS
from illuminator_ros.gimbal.events import GimbalEvent, GimbalKey
from illuminator_ros.gimbal.gimbal import Gimbal, GimbalSettings
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.command_sender import CommandSender
from illuminator_ros.mavlink.component import Component, Endpoint
from illuminator_ros.mavlink.dialect import entry_names, mavlink
from illuminator_ros.mavlink.link import Link
from illuminator_ros.payload.command_sources import DEFAULT
from illuminator_ros.payload.messages import GeoPoint, GimbalDeviceAttitudeStatus
from illuminator_ros.payload.requests import Done, Result
from support.bench import Bench
from support.live_link import EndpointLink

OURS, AUTOPILOT, DEVICE, OTHER = (mav.Address(1, component) for component in (193, 1, 154, 195))
NAN = math.nan
ALL = sum(entry_names('GIMBAL_DEVICE_CAP_FLAGS'))
LEVEL = (1.0, 0.0, 0.0, 0.0)
PLACE = GeoPoint(47.0, 8.5, 500.0)

E = TypeVar('E', bound=GimbalEvent)


@dataclass
class FakeManager:
    """
    A gimbal manager, and its device, which turns at once.

    :ivar results: the results of commands that are not accepted, by MAV_CMD.
    :ivar announces: whether it answers requests for GIMBAL_MANAGER_INFORMATION.
    :ivar reports: whether it sends GIMBAL_MANAGER_STATUS.
    :ivar streams: whether it does so without a request.
    :ivar applies: whether it executes the commands that it accepts.
    :ivar beat: tenths of a second between its heartbeats.
    :ivar answers: whether it acknowledges commands.
    :ivar hears: whether anything that is sent reaches it.
    :ivar device_reports: whether the device sends GIMBAL_DEVICE_ATTITUDE_STATUS.
    :ivar on_demand: whether it does so once an interval is set.
    :ivar received: the received setpoints.
    """

    address: mav.Address = AUTOPILOT
    device_id: int = 154
    capabilities: int = ALL
    autopilot: int = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA + 9
    results: dict[int, int] = field(default_factory=dict)
    announces: bool = True
    reports: bool = True
    streams: bool = True
    beat: int = 10
    applies: bool = True
    answers: bool = True
    hears: bool = True
    alive: bool = True
    device_alive: bool = True
    device_reports: bool = True
    on_demand: bool = False
    primary: mav.Address = mav.Address(0, 0)
    secondary: mav.Address = mav.Address(0, 0)
    flags: int = (mavlink.GIMBAL_DEVICE_FLAGS_ROLL_LOCK | mavlink.GIMBAL_DEVICE_FLAGS_PITCH_LOCK
                  | mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME)
    q: tuple[float, float, float, float] = LEVEL
    rates: tuple[float, float, float] = (NAN, NAN, NAN)
    delta_yaw: float = NAN
    failure_flags: int = 0
    attitude_number: int | None = None
    received: list[gm.GimbalManagerSetAttitude] = field(default_factory=list)
    commands: list[mav.CommandLong | mav.CommandInt] = field(default_factory=list)

    @property
    def device(self) -> mav.Address:
        number = self.device_id in gm.NON_MAVLINK_IDS
        return self.address if number else mav.Address(self.address.system, self.device_id)

    def information(self) -> gm.GimbalManagerInformation:
        return gm.GimbalManagerInformation(
            0, self.capabilities, self.device_id, -0.5, 0.5, -1.57, 0.5, -3.0, 3.0)

    def status(self) -> gm.GimbalManagerStatus:
        return gm.GimbalManagerStatus(
            0, self.flags, self.device_id, *self.primary, *self.secondary)

    def attitude(self) -> GimbalDeviceAttitudeStatus:
        number = self.device_id if self.device_id in gm.NON_MAVLINK_IDS else 0
        return GimbalDeviceAttitudeStatus(
            0, 0, 0, self.flags, self.q, *self.rates, self.failure_flags, self.delta_yaw, NAN,
            number if self.attitude_number is None else self.attitude_number)

    def sent_each(self, tenth: int) -> list[tuple[mav.Address, mav.Message]]:
        """Return its messages of a tenth of a second: statuses 5 Hz."""
        sent: list[tuple[mav.Address, mav.Message]] = []
        if self.alive and tenth % self.beat == 0:
            sent.append((self.address, mav.Heartbeat(2, self.autopilot, 0, 0, 4, 3)))
        if self.alive and self.reports and self.streams and tenth % 2 == 0:
            sent.append((self.address, self.status()))
        if self.device_alive:
            if tenth % 10 == 5 and self.device != self.address:
                sent.append((self.device, mav.heartbeat(mavlink.MAV_TYPE_GIMBAL)))
            if self.device_reports and tenth % 2 == 1:
                sent.append((self.device, self.attitude()))
        return sent

    def take(
        self, source: mav.Address, message: mav.Message,
    ) -> list[tuple[mav.Address, mav.Message]]:
        """Return the answers to a message."""
        if not (self.alive and self.hears) or getattr(message, 'target_system', None) is None:
            return []
        target = mav.Address(message.target_system, message.target_component)  # type: ignore
        if (isinstance(message, gm.GimbalManagerSetAttitude) and target == self.address
                and message.gimbal_device_id == self.device_id):
            self.received.append(message)
            if self.applies and self.primary == source:
                # The frame that it names does not depend on the setpoint.
                named = (mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
                         | mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME)
                self.flags = self.flags & named | message.flags & ~named
        if not isinstance(message, mav.CommandLong | mav.CommandInt) or (
                target not in (self.address, self.device)):
            return []
        device_id = message.param1 if message.command in (195, 197) else getattr(
            message, 'param7', 0)
        if message.command in gm.DEVICE_ID_PARAM and device_id not in (0, self.device_id):
            return []
        self.commands.append(message)
        if not self.answers:
            return []
        result = self.results.get(message.command, mavlink.MAV_RESULT_ACCEPTED)
        sent: list[tuple[mav.Address, mav.Message]] = [
            (target, mav.CommandAck(message.command, result, 0, 0, *source))]
        if result == mavlink.MAV_RESULT_ACCEPTED:
            sent += self._execute(message, target)
        return sent

    def _execute(
        self, message: mav.CommandLong | mav.CommandInt, target: mav.Address,
    ) -> list[tuple[mav.Address, mav.Message]]:
        command, p1, p2, p3, p4 = (message.command, message.param1, message.param2,
                                   message.param3, message.param4)
        if command == mavlink.MAV_CMD_REQUEST_MESSAGE:
            made: dict[tuple[int, mav.Address], mav.Message | None] = {
                (280, self.address): self.information() if self.announces else None,
                (281, self.address): self.status() if self.reports else None,
                (283, self.device): device_information()}
            found = made.get((int(p1), target))
            return [(target, found)] if found is not None else []
        if command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL and target == self.device:
            self.device_reports |= self.on_demand
        if self.applies and command == mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE:
            old = (*self.primary, *self.secondary)
            new = [was if value == -1 else 0 if value == -3 else int(value)
                   for was, value in zip(old, (p1, p2, p3, p4), strict=True)]
            self.primary, self.secondary = mav.Address(*new[:2]), mav.Address(*new[2:])
        if self.applies and command == mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW:
            assert isinstance(message, mav.CommandLong)
            self.flags = int(message.param5)
        return []


def device_information(**fields: Any) -> gm.GimbalDeviceInformation:
    """Return the information of a device."""
    return gm.GimbalDeviceInformation(**{
        'time_boot_ms': 0, 'vendor_name': b'Maker', 'model_name': b'Turn', 'custom_name': b'',
        'firmware_version': 0x00030201, 'hardware_version': 0, 'uid': 77, 'cap_flags': 0,
        'custom_cap_flags': 0, 'roll_min': NAN, 'roll_max': NAN, 'pitch_min': -1.5,
        'pitch_max': 0.5, 'yaw_min': -3.0, 'yaw_max': 3.0, **fields})


class Rig(Bench):
    """
    A client and managers on one link.

    :ivar results: of the requests that were made with :attr:`done`.
    """

    def __init__(self, *managers: FakeManager, **settings: Any) -> None:
        self.managers = list(managers)
        self.commands = CommandSender(OURS)
        self.client = GimbalClient(self.commands, GimbalSettings(**settings))
        self.component = Component(self.commands, [self.client])
        super().__init__(self.component, 100.0)
        self.events: list[GimbalEvent] = []
        self.results: list[Result] = []
        self._tenth = 0
        self.client.events.subscribe(self.events.append)
        self.component.link_opened(self.now)

    def done(self, result: Result, now: float) -> None:
        self.results.append(result)

    @property
    def gimbal(self) -> Gimbal:
        """Return the only gimbal."""
        (gimbal,) = self.client.gimbals.values()
        return gimbal

    def all_of(self, kind: type[E]) -> list[E]:
        """Return the events of a kind."""
        return [event for event in self.events if isinstance(event, kind)]

    def send(self, move: Move, source: str = DEFAULT) -> str:
        """Ask for a move as a topic does; return why it was refused, '' if it was not."""
        return setpoint(self.gimbal, move, self.now, source)

    def send_angles(self, angles: Vector, frame: YawFrame, source: str = DEFAULT) -> str:
        """Ask for angles as a topic does; return why they were refused, '' if they were not."""
        refusals: list[Result] = []
        self.gimbal.set_angles(
            angles, frame, self.now, lambda result, now: refusals.append(result), source=source)
        return refusal(refusals)

    def receive(self, source: mav.Address, message: mav.Message) -> None:
        self.component.receive(source, message, self.now)

    def run_until(self, until: float = math.inf) -> None:
        """Let time pass in steps of 20 ms."""
        for step in range(round((until - self.now) / 0.02)):
            if step % 5 == 0:
                for manager in self.managers:
                    for one in manager.sent_each(self._tenth):
                        self.receive(*one)
                self._tenth += 1
            self.poll()
            self.now += 0.02

    def answer(self, source: mav.Address, message: mav.Message) -> None:
        """See :class:`Bench`."""
        for manager in self.managers:
            for one in manager.take(source, message):
                self.receive(*one)


class GimbalEndpoint(Endpoint):
    """Fake managers as the endpoint of a link."""

    messages = (mav.CommandLong, mav.CommandInt, gm.GimbalManagerSetAttitude)
    sends = (gm.GimbalManagerStatus,)

    def __init__(self, managers: Sequence[FakeManager]) -> None:
        super().__init__()
        self.managers = managers
        self._tenth = 0

    def link_opened(self, now: float) -> None:
        self.schedule.at(self._report, now)

    def receive(self, source: mav.Address, message: mav.Message, now: float) -> None:
        for manager in self.managers:
            self.outgoing += manager.take(source, message)

    def _report(self, now: float) -> None:
        for manager in self.managers:
            self.outgoing += manager.sent_each(self._tenth)
        self._tenth += 1
        self.schedule.at(self._report, now + 0.1)


def served_gimbals(
    port: int, *managers: FakeManager, link: type[Link] = Link,
) -> EndpointLink[GimbalEndpoint]:
    """Serve fake managers over UDP, by the clock of this machine unless the link has another."""
    return EndpointLink(f'udpout://127.0.0.1:{port}', GimbalEndpoint(managers), kind=link)


def steps(values: Iterable[float]) -> list[float]:
    """Return values without those that repeat the one before: a zero is sent again."""
    return [value for value, _ in itertools.groupby(values)]


def keys(rig: Rig) -> Sequence[GimbalKey]:
    """Return the keys of the gimbals that were found."""
    return list(rig.client.gimbals)


def in_control(**fields: Any) -> Rig:
    """Return a client that controls a gimbal; ``fields`` are those of its settings."""
    rig = Rig(FakeManager(primary=OURS), **fields).run(4.0)
    assert rig.gimbal.reports.in_control
    return rig


def setpoint(gimbal: Gimbal, move: Move, now: float, source: str = DEFAULT) -> str:
    """Ask for a move as a topic does; return why it was refused, '' if it was not."""
    results: list[Result] = []
    gimbal.request(move, now, lambda result, now: results.append(result), is_call=False,
                   source=source)
    return refusal(results)


def refusal(results: Sequence[Result]) -> str:
    """Return why a message of a topic was refused, '' if it was not."""
    return next((one.message for one in results if not (one.success or one.superseded)), '')


def set_neutral(gimbal: Gimbal, now: float, done: Done) -> None:
    gimbal.request(NEUTRAL, now, done)


def retract(gimbal: Gimbal, now: float, done: Done) -> None:
    gimbal.request(RETRACT, now, done)


def clear_roi(gimbal: Gimbal, now: float, done: Done) -> None:
    gimbal.request(None, now, done)


def set_yaw_lock(gimbal: Gimbal, lock: bool, now: float, done: Done) -> None:
    gimbal.request(YAW_LOCKS[lock], now, done)
