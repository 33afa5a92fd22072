# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
Devices written from the documents alone: each does what its protocol demands, and no more.

They share no code with the simulator, so that an error of the package does not hide itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import math
from typing import Any, ClassVar

from illuminator_ros.gimbal import messages as gimbal
from illuminator_ros.illuminator.messages import IlluminatorStatus
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.component import Endpoint
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.payload.messages import Attitude, GlobalPositionInt, SystemTime
from illuminator_ros.payload.messages import GimbalDeviceAttitudeStatus as AttitudeStatus
from illuminator_ros.rededge import messages as rededge

NAN = math.nan
# GIMBAL_DEVICE_FLAGS
ROLL_LOCK, PITCH_LOCK, IN_VEHICLE_FRAME = 4, 8, 32
# GIMBAL_DEVICE_ERROR_FLAGS
AT_PITCH_LIMIT, AT_YAW_LIMIT = 2, 4
# s; UTC at 0 on the link's clock, since 1970.
STEP = 0.05
UTC = 1.7e9
# rad/s
SPEED = 0.7


class MinimalDevice(Endpoint):
    """
    A component with a heartbeat and commands; it takes COMMAND_LONG only.

    :cvar intervals: s between messages of each class.
    :cvar requestable: the messages that can be requested.
    """

    intervals: ClassVar[Mapping[type[mav.Message], float]] = {}
    requestable: ClassVar[Sequence[type[mav.Message]]] = ()
    messages: Sequence[type[mav.Message]] = (mav.CommandLong, mav.CommandInt)

    def __init__(self, address: Address, mav_type: int, autopilot: int) -> None:
        super().__init__()
        self.address = address
        self.heartbeat = mav.Heartbeat(mav_type, autopilot, 0, 0, 0, 3)
        self.now = self._booted = 0.0
        self._due: list[tuple[float, Callable[[], object]]] = []

    def link_opened(self, now: float) -> None:
        # A link repeats the call while it hears no peer.
        if not self._due:
            self.now = self._booted = now
            self.start()

    def start(self) -> None:
        """Begin to send."""
        self._repeat(1.0, lambda: self.heartbeat)
        for cls, interval in self.intervals.items():
            self._repeat(interval, lambda cls=cls: self.message(cls.id))  # type: ignore[misc]

    @property
    def uptime_ms(self) -> int:
        """Return the time since the start, ms."""
        return round((self.now - self._booted) * 1e3)

    def after(self, seconds: float, action: Callable[[], object]) -> None:
        """Call a function after some time."""
        self._due.append((self.now + seconds, action))
        self._set_due()

    def _repeat(self, interval: float, make: Callable[[], mav.Message]) -> None:
        self.send(make())
        self.after(interval, lambda: self._repeat(interval, make))

    def send(self, message: mav.Message) -> None:
        """Send a message."""
        self.outgoing.append((self.address, message))

    def poll(self, now: float) -> None:
        self.now = now
        due, self._due = ([one for one in self._due if one[0] <= now],
                          [one for one in self._due if one[0] > now])
        for _, action in due:
            action()
        self._set_due()

    def _set_due(self) -> None:
        self.schedule.at(self.poll, min((at for at, _ in self._due), default=math.inf))

    def receive(self, source: Address, message: Any, now: float) -> None:
        self.now = now
        system, component = mav.target_of(message) if hasattr(message, 'target_system') else (0, 0)
        if system not in (0, self.address.system) or component not in (0, self.address.component):
            return
        if isinstance(message, mav.CommandLong):
            self._answer(source, message)
        elif not isinstance(message, mav.CommandInt):
            self.take(source, message)

    def _answer(self, source: Address, command: mav.CommandLong) -> None:
        if command.command == mavlink.MAV_CMD_REQUEST_MESSAGE:
            is_known = command.param1 in {cls.id for cls in self.requestable}
            self.acknowledge(command, mavlink.MAV_RESULT_ACCEPTED if is_known
                             else mavlink.MAV_RESULT_DENIED)
            if is_known:
                self.send(self.message(int(command.param1)))
        else:
            self.execute(source, command)

    def acknowledge(self, command: mav.CommandLong, result: int) -> None:
        """Send COMMAND_ACK without its optional fields."""
        self.send(mav.CommandAck(command.command, result))

    # What a device of one kind adds

    def message(self, message_id: int) -> mav.Message:
        """Return a message that can be requested or is streamed."""
        raise NotImplementedError

    def execute(self, source: Address, command: mav.CommandLong) -> None:
        """Execute and acknowledge a command."""
        self.acknowledge(command, mavlink.MAV_RESULT_UNSUPPORTED)

    def take(self, source: Address, message: Any) -> None:
        """Take another message."""


class MinimalLight(MinimalDevice):
    """
    A light that is switched and dimmed in whole percent.

    It has no strobe, no external sync, no thermometer and no names, sends its status on request
    only, and rejects MAV_CMD_SET_MESSAGE_INTERVAL.

    :param step: of its brightness, %.
    :param fade: s from a change of brightness to its end.
    :param strobes: whether it has a strobe, which then shows no period while it does not strobe.
    """

    requestable = (IlluminatorStatus, mav.ComponentInformationBasic)

    def __init__(self, *, step: float = 1.0, fade: float = 0.0, strobes: bool = False) -> None:
        super().__init__(Address(1, 243), mavlink.MAV_TYPE_ILLUMINATOR,
                         mavlink.MAV_AUTOPILOT_INVALID)
        self.step, self.fade = step, fade
        self.limits = (0.1, 5.0) if strobes else (0.0, 0.0)
        self.on = 0
        self.brightness = 40.0
        self.strobe = 0.0, 0.0

    def message(self, message_id: int) -> mav.Message:
        if message_id == IlluminatorStatus.id:
            return IlluminatorStatus(
                self.uptime_ms, self.on, 1, 0, 1, self.brightness, *self.strobe, NAN, *self.limits)
        return mav.ComponentInformationBasic(0, 0, 0, b'', b'', b'', b'', b'')

    def execute(self, source: Address, command: mav.CommandLong) -> None:
        p1, p2, p3, p4 = command.param1, command.param2, command.param3, command.param4
        low, high = self.limits
        if command.command == mavlink.MAV_CMD_ILLUMINATOR_ON_OFF:
            valid = p1 in (0, 1)
            self.on = int(p1) if valid else self.on
        elif command.command == mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE:
            valid = (p1 == 1 and 0 <= p2 <= 100 and 0 <= p4 <= 100
                     and (p3 == 0 or low <= p3 <= high and high > 0))
            if valid:
                self.configure(p2, p3, p4)
        else:
            super().execute(source, command)
            return
        self.acknowledge(command, mavlink.MAV_RESULT_ACCEPTED if valid
                         else mavlink.MAV_RESULT_DENIED)

    def configure(self, brightness: float, period: float, duty: float) -> None:
        """Apply a configuration."""
        self.strobe = (period, duty) if period and 0 < duty < 100 else (0.0, 0.0)
        end = round(brightness / self.step) * self.step
        if self.fade:
            self.after(self.fade / 2, lambda: setattr(
                self, 'brightness', (self.brightness + end) / 2))
        self.after(self.fade, lambda: setattr(self, 'brightness', end))


def quaternion(pitch: float, yaw: float) -> tuple[float, float, float, float]:
    """Return w, x, y, z of a rotation about z, then about y."""
    c, s = (math.cos(pitch / 2), math.sin(pitch / 2))
    d, t = (math.cos(yaw / 2), math.sin(yaw / 2))
    return d * c, -t * s, d * s, t * c


def angles(q: Sequence[float]) -> tuple[float, float]:
    """Return pitch and yaw of a unit quaternion."""
    w, x, y, z = q
    return (math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x)))),
            math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))


PITCH = math.radians(-90), math.radians(30)
YAW = math.radians(-160), math.radians(160)


class MinimalGimbal(MinimalDevice):
    """
    A gimbal device with pitch and yaw that obeys its manager.

    It reports no rates, no heading and no names, and has neither neutral nor retracted position,
    yaw lock, nor yaw relative to north.

    :cvar ranges: of pitch and yaw, rad.
    :cvar capabilities: HAS_PITCH_AXIS, HAS_PITCH_LOCK, HAS_YAW_AXIS, HAS_YAW_FOLLOW.
    """

    intervals = {AttitudeStatus: 0.1}
    requestable = (gimbal.GimbalDeviceInformation,)
    messages = (*MinimalDevice.messages, gimbal.GimbalManagerStatus,
                gimbal.GimbalDeviceSetAttitude)
    ranges: ClassVar[tuple[tuple[float, float], tuple[float, float]]] = (PITCH, YAW)
    capabilities: ClassVar[int] = 32 | 128 | 256 | 512

    def __init__(self) -> None:
        super().__init__(Address(1, 154), mavlink.MAV_TYPE_GIMBAL, mavlink.MAV_AUTOPILOT_INVALID)
        # Of pitch and yaw: the angle, rad, the commanded one, NaN for none, and the rate, rad/s.
        self.angles, self.targets, self.rates = [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]
        self.manager: Address | None = None

    def start(self) -> None:
        super().start()
        self._move()

    def _move(self) -> None:
        for axis, (low, high) in enumerate(self.ranges):
            step = self.rates[axis] * STEP
            if not math.isnan(self.targets[axis]):
                longest = (abs(self.rates[axis]) or SPEED) * STEP
                step = max(-longest, min(longest, self.targets[axis] - self.angles[axis]))
            self.angles[axis] = max(low, min(high, self.angles[axis] + step))
        self.after(STEP, self._move)

    def message(self, message_id: int) -> mav.Message:
        if message_id == AttitudeStatus.id:
            at_limits = sum(flag for flag, target, (low, high) in zip(
                (AT_PITCH_LIMIT, AT_YAW_LIMIT), self.targets, self.ranges, strict=True)
                if target < low or target > high)
            return AttitudeStatus(
                0, 0, self.uptime_ms, ROLL_LOCK | PITCH_LOCK | IN_VEHICLE_FRAME, self.reported(),
                NAN, NAN, NAN, at_limits, NAN, NAN)
        return gimbal.GimbalDeviceInformation(
            self.uptime_ms, b'', b'', b'', 0, 0, 0, self.capabilities, 0, NAN, NAN,
            *self.reported_limits())

    def reported_limits(self) -> tuple[float, float, float, float]:
        """Return pitch_min to yaw_max."""
        return (*self.ranges[0], *self.ranges[1])

    def reported(self) -> tuple[float, float, float, float]:
        """Return the quaternion of its status."""
        pitch, yaw = self.angles
        return quaternion(pitch, yaw)

    def commanded(self, q: Sequence[float]) -> tuple[float, float]:
        """Return the angles of a commanded quaternion."""
        return (NAN, NAN) if any(map(math.isnan, q)) else angles(q)

    def take(self, source: Address, message: Any) -> None:
        if isinstance(message, gimbal.GimbalManagerStatus):
            if (source.system, message.gimbal_device_id) == self.address and not self.manager:
                self.manager = source
        elif isinstance(message, gimbal.GimbalDeviceSetAttitude) and source == self.manager:
            self.obey(message)

    def obey(self, message: gimbal.GimbalDeviceSetAttitude) -> None:
        """Turn each axis to an angle, else at a rate; NaN for neither, which stops it."""
        self.targets = [*self.commanded(message.q)]
        self.rates = [0.0 if math.isnan(rate) else rate for rate in (
            message.angular_velocity_y, message.angular_velocity_z)]


class MinimalCamera(MinimalDevice):
    """
    A camera of the serial API 1.3.2: it sends HEARTBEAT and answers PING.

    The API says nothing about the contents of its heartbeat, and about its system id.
    """

    messages: Sequence[type[mav.Message]] = (rededge.Ping, rededge.DigicamControl)

    def __init__(self) -> None:
        super().__init__(Address(1, 100), mavlink.MAV_TYPE_CAMERA, mavlink.MAV_AUTOPILOT_INVALID)

    def receive(self, source: Address, message: Any, now: float) -> None:
        self.now = now
        if isinstance(message, rededge.Ping) and not any(mav.target_of(message)):
            self.send(rededge.Ping(0, message.seq, *source))
        elif isinstance(message, rededge.DigicamControl):
            self.capture(source, message)

    def capture(self, source: Address, message: rededge.DigicamControl) -> None:
        """Take no image: the API has no captures."""


class MinimalCapturingCamera(MinimalCamera):
    """
    A camera of the serial API 1.5.5: it takes images, too, and uses injected state for 5 s.

    The API says nothing about its system id, and about messages for other components.
    """

    messages = (*MinimalCamera.messages, rededge.GpsRawInt, SystemTime, GlobalPositionInt,
                Attitude, rededge.MountStatus)

    def __init__(self) -> None:
        super().__init__()
        self.heartbeat = mav.Heartbeat(0, 1, 2, 3, 4, 3)
        self.images = 0
        # The latest message of each class, and when it was received, s.
        self.injected: dict[type[mav.Message], tuple[float, Any]] = {}

    def receive(self, source: Address, message: Any, now: float) -> None:
        super().receive(source, message, now)
        self.injected[type(message)] = now, message

    def _fresh(self, cls: type[mav.Message]) -> Any:
        at, message = self.injected.get(cls, (-math.inf, None))
        return message if self.now - at <= 5.0 else None

    def capture(self, source: Address, message: rededge.DigicamControl) -> None:
        if message.shot not in (1, 2):
            return
        self.images += 1
        time_usec = int((UTC + self.now) * 1e6)
        place = self._fresh(rededge.GpsRawInt) or self._fresh(GlobalPositionInt)
        attitude, mount = self._fresh(Attitude), self._fresh(rededge.MountStatus)
        # The roll of the mount is about the line of sight, so it turns the image.
        yaw = math.degrees(attitude.yaw) + mount.pointing_b / 100 if attitude and mount else 0.0
        self.send(rededge.CameraStatus(
            time_usec, source.system, 0, self.images, 1, 0.0, 0.0, 0.0, 0.0))
        feedback = rededge.CameraFeedback(
            time_usec, source.system, 0, self.images, place.lat if place else 0,
            place.lon if place else 0, place.alt / 1e3 if place else 0.0, 0.0, 0.0, 0.0,
            yaw % 360.0, 5.4, 3)
        self.after(0.5, lambda: self.send(feedback))
