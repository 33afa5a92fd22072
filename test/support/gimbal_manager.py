# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A gimbal manager with a clock that jumps, a device, and players that a test controls."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
import itertools
from typing import Any, TypeVar

from illuminator_ros.geometry.mount_attitude import AXES
from illuminator_ros.geometry.rotation import Quaternion
from illuminator_ros.gimbal.manager import GimbalManager, ManagerEvent, ManagerSettings
from illuminator_ros.gimbal.manager_control import ControlSettings
from illuminator_ros.gimbal.manager_state import ManagerState
from illuminator_ros.gimbal.messages import (
    GimbalDeviceInformation,
    GimbalDeviceSetAttitude,
    GimbalManagerSetPitchyaw,
)
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.command_sender import CommandSender
from illuminator_ros.mavlink.component import Component
from illuminator_ros.mavlink.dialect import mavlink, replaced
from illuminator_ros.payload.messages import (
    Attitude,
    GimbalDeviceAttitudeStatus,
    GlobalPositionInt,
)
from support.bench import Bench

OURS, DEVICE, AUTOPILOT = mav.Address(1, 193), mav.Address(1, 154), mav.Address(1, 1)
PILOT, GUEST = mav.Address(255, 190), mav.Address(255, 191)
NAN = float('nan')
FULL = (mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_RETRACT | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_NEUTRAL
        | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_ROLL_AXIS
        | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_PITCH_AXIS
        | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_AXIS
        | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK
        | mavlink.GIMBAL_DEVICE_CAP_FLAGS_SUPPORTS_YAW_IN_EARTH_FRAME)
# The ranges of a device without stops.
EVERYWHERE: dict[str, Any] = {
    f'{axis}_{end}': NAN for axis in AXES for end in ('min', 'max')}
T = TypeVar('T')


def information(capabilities: int = FULL, **ranges: Any) -> GimbalDeviceInformation:
    """Return the information of a device that can turn by half a rad, unless given otherwise."""
    return replaced(GimbalDeviceInformation(
        0, b'maker', b'model', b'', 1, 1, 7, int(capabilities), 0, -0.5, 0.5, -0.5, 0.5, -0.5,
        0.5), **ranges)


def attitude_status(
    q: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0), *,
    flags: int = mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME, heading: float = NAN,
    turning: float = 0.0,
) -> GimbalDeviceAttitudeStatus:
    """Return an attitude of the device; ``turning`` is the rate of its yaw, rad/s."""
    return GimbalDeviceAttitudeStatus(
        0, 0, 0, int(flags), q, 0.0, 0.0, turning, 0, heading, NAN, 0)


class ManagerRig(Bench):
    """
    A manager, and what it sends.

    :param draws: the random numbers that the manager draws; the last one is repeated.
    :ivar device_information: the answer of the device; None for no device.
    :ivar lost: how many of its next answers are lost, and how many GIMBAL_DEVICE_INFORMATION.
    :ivar heading: of the vehicle, as the device reports it.
    :ivar flags: as the device reports them.
    :ivar turning: the rate of its yaw, as the device reports it, rad/s.
    """

    def __init__(
        self, control: ControlSettings | None = None, *, device_id: int = 0,
        device: GimbalDeviceInformation | None = None, address: mav.Address = OURS,
        active: bool = True, draws: Sequence[float] = (0.25,),
        lost: tuple[float, float] = (0, 0), **settings: Any,
    ) -> None:
        self.events: list[ManagerEvent] = []
        self.device_information = device or information()
        self.device_is_there = not 0 < device_id < 7
        self.heading = NAN
        self.flags, self.turning = mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME, 0.0
        self.lost = lost
        self.draw = itertools.chain(draws, itertools.repeat(draws[-1])).__next__
        self.manager, self.component = self.make(CommandSender(address), ManagerSettings(
            control or ControlSettings(), device_id=device_id, **settings))
        super().__init__(self.component, 1000.0)
        self.manager.events.subscribe(self.events.append)
        self.component.link_opened(self.now)
        self._each: Callable[[], None] = lambda: None
        self.later(0.0, self._beat)
        if active:
            self.run(5.0)
            assert self.manager.tracker.state is ManagerState.ACTIVE

    def make(
        self, commands: CommandSender, settings: ManagerSettings,
    ) -> tuple[GimbalManager, Component]:
        """Return a manager and its component."""
        manager = GimbalManager(commands, settings, self.draw)
        return manager, Component(commands, [manager])

    def run(self, seconds: float, *, each: Callable[[], None] = lambda: None) -> ManagerRig:
        """Let time pass; ``each`` is called with each heartbeat of the device, twice a second."""
        self._each = each
        return super().run(seconds)

    def _beat(self) -> None:
        self.later(0.5, self._beat)
        if self.device_is_there:
            self.component.receive(DEVICE, mav.heartbeat(mavlink.MAV_TYPE_GIMBAL), self.now)
            self.report()
        self._each()

    def report(self, q: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)) -> None:
        """Let the device report its attitude, and whether it accepts a yaw from north."""
        north = (self.device_information.cap_flags
                 & mavlink.GIMBAL_DEVICE_CAP_FLAGS_SUPPORTS_YAW_IN_EARTH_FRAME)
        flags = self.flags | (
            mavlink.GIMBAL_DEVICE_FLAGS_ACCEPTS_YAW_IN_EARTH_FRAME if north else 0)
        self.component.receive(DEVICE, attitude_status(
            q, flags=flags, heading=self.heading, turning=self.turning), self.now)

    def give(self, source: mav.Address, *messages: mav.Message) -> list[Any]:
        """Return what the manager sends when it receives messages, and is polled then."""
        before = len(self.sent)
        super().give(source, *messages)
        self.poll()
        return [message for _, message in self.sent[before:]]

    def answer(self, source: mav.Address, message: Any) -> None:
        """See :class:`Bench`."""
        assert source == self.component.address
        if (isinstance(message, mav.CommandLong) and self.device_is_there
                and (message.target_system, message.target_component) == DEVICE):
            self._answer(message, source)

    def _answer(self, message: mav.CommandLong, source: mav.Address) -> None:
        answers, messages = self.lost
        if answers:
            self.lost = answers - 1, messages
            return
        self.component.receive(
            DEVICE, mav.CommandAck(message.command, 0, 0, 0, *source), self.now)
        if messages:
            self.lost = 0, messages - 1
        else:
            self.component.receive(DEVICE, self.device_information, self.now)

    # Players

    def heartbeats(self, *players: mav.Address) -> Callable[[], None]:
        """Return a function that sends a heartbeat of each player."""
        def send() -> None:
            for player in players:
                self.component.receive(player, mav.heartbeat(mavlink.MAV_TYPE_GCS), self.now)

        return send

    def result(
        self, source: mav.Address, command: mav.CommandLong | mav.CommandInt,
    ) -> int:
        """Return the result of a command."""
        answer = of(mav.CommandAck, self.give(source, command))
        assert len(answer) == 1
        return int(answer[0].result)

    def take(self, player: mav.Address) -> int:
        """Return the result of taking primary control."""
        return self.result(player, configure(*player))

    def points(self, player: mav.Address, pitch: float = 0.1, yaw: float = 0.0) -> list[Any]:
        """Return the messages to the device when a player sets angles, rad."""
        return of(GimbalDeviceSetAttitude, self.give(player, pitch_yaw(pitch, yaw)))


def of(cls: type[T], messages: Iterable[Any]) -> list[T]:
    """Return those messages or events that are of a class."""
    return [message for message in messages if isinstance(message, cls)]


def euler(message: GimbalDeviceSetAttitude) -> tuple[float, float, float]:
    """Return roll, pitch and yaw of a setpoint, rounded, rad."""
    roll, pitch, yaw = (round(angle, 4) for angle in Quaternion(*message.q).euler())
    return roll, pitch, yaw


def long(
    number: int, *params: float, to: mav.Address = OURS, confirmation: int = 0,
) -> mav.CommandLong:
    """Return a command; params that are not given are 0."""
    return mav.CommandLong(*to, number, confirmation, *params, *(0.0,) * (7 - len(params)))


def configure(
    system: float, component: float, system2: float = -1, component2: float = -1, *,
    device_id: float = 0, to: mav.Address = OURS, confirmation: int = 0,
) -> mav.CommandLong:
    """Return MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE."""
    return long(mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, system, component, system2,
                component2, 0, 0, device_id, to=to, confirmation=confirmation)


def pitch_yaw_command(pitch: float, yaw: float, pitch_rate: float = NAN, yaw_rate: float = NAN,
                      flags: float = 0, device_id: float = 0) -> mav.CommandLong:
    """Return MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, deg and deg/s."""
    return long(mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, pitch, yaw, pitch_rate, yaw_rate,
                flags, 0, device_id)


def pitch_yaw(pitch: float = NAN, yaw: float = NAN, pitch_rate: float = NAN,
              yaw_rate: float = NAN, flags: int = 0, device_id: int = 0,
              to: mav.Address = OURS) -> GimbalManagerSetPitchyaw:
    """Return GIMBAL_MANAGER_SET_PITCHYAW, rad and rad/s."""
    return GimbalManagerSetPitchyaw(*to, flags, device_id, pitch, yaw, pitch_rate, yaw_rate)


def request(message: type[mav.Message], to: mav.Address = OURS) -> mav.CommandLong:
    """Return a request for a message."""
    return long(mavlink.MAV_CMD_REQUEST_MESSAGE, message.id, to=to)


def region(latitude: float, longitude: float, altitude: float, *, frame: int = 0,
           device_id: float = 0) -> mav.CommandInt:
    """Return MAV_CMD_DO_SET_ROI_LOCATION, deg and m."""
    return mav.CommandInt(
        *OURS, frame, mavlink.MAV_CMD_DO_SET_ROI_LOCATION, 0, 0, device_id, 0.0, 0.0, 0.0,
        round(latitude * 1e7), round(longitude * 1e7), altitude)


def position(latitude: float, longitude: float, altitude: float, *,
             home: float = 0.0) -> GlobalPositionInt:
    """Return a position of the vehicle, deg and m."""
    return GlobalPositionInt(
        0, round(latitude * 1e7), round(longitude * 1e7), round(altitude * 1e3),
        round((altitude - home) * 1e3), 0, 0, 0, 0)


def vehicle_yaw(yaw: float) -> Attitude:
    """Return an attitude of the vehicle, rad from north."""
    return Attitude(0, 0.0, 0.0, yaw, 0.0, 0.0, 0.0)
