# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The motion of a simulated gimbal: axes with rates and ranges, locks, and a drifting heading."""

from __future__ import annotations

from dataclasses import dataclass, field
import math
from typing import NamedTuple

from .axes import AT_LIMIT, HAS_AXIS, HAS_FOLLOW, HAS_LOCK, LEVEL, LOCKS, Range, Ranges, RESOLUTION
from .manager_setpoint import Setpoint
from ..geometry.mount_attitude import AXES, UNSET_VECTOR, YawFrame
from ..geometry.rotation import Quaternion, Vector
from ..mavlink.dialect import mavlink, short_names
from ..simulation.settings import number, one_of, setting

# s without a heading from the vehicle after which its heading is unknown.
HEADING_TIMEOUT = 2.0
# The flags that a setpoint may set.
SETTABLE = (mavlink.GIMBAL_DEVICE_FLAGS_RETRACT | mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL | LEVEL
            | mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK)
CAPABILITIES = (
    sum((*HAS_AXIS, *HAS_FOLLOW, *HAS_LOCK)) | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_RETRACT
    | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_NEUTRAL
    | mavlink.GIMBAL_DEVICE_CAP_FLAGS_SUPPORTS_YAW_IN_EARTH_FRAME)


def wrapped(angle: float) -> float:
    """Return an angle within -pi..pi, rad."""
    return math.remainder(angle, math.tau)


NO_STOPS = Range(-math.pi, math.pi)


_degrees = number(-180.0, 180.0)


def _span(text: str) -> Range:
    parts = text.split(',')
    if len(parts) != 2:
        raise ValueError(f'{text!r} is not MIN,MAX')
    low, high = (math.radians(_degrees(part)) for part in parts)
    if low > high:
        raise ValueError(f'{text}: the minimum is above the maximum')
    return Range(low, high)


def _capabilities(names: str) -> int:
    known = {name.lower(): flag
             for flag, name in short_names('GIMBAL_DEVICE_CAP_FLAGS').items()}
    return sum({known[one_of(known)(name.strip().lower())] for name in names.split(',')})


@dataclass(frozen=True)
class GimbalMechanics:
    """
    The axes of a gimbal, and its capabilities.

    :param roll_range, pitch_range: relative to the horizon, rad.
    :param yaw_range: relative to the vehicle's heading, rad; a full turn has no stop.
    :param axis_rate: highest rate of each axis, deg/s.
    :param drift: of the gimbal's own heading while the vehicle sends none, deg/s.
    """

    roll_range: Range = setting(
        _span('-45,45'), 'MIN,MAX', 'degrees from the horizon (default: -45,45)', _span)
    pitch_range: Range = setting(
        _span('-120,45'), 'MIN,MAX', 'likewise, up is positive (default: -120,45)', _span)
    yaw_range: Range = setting(
        _span('-170,170'), 'MIN,MAX', 'degrees from the front of the vehicle, right is positive; '
        '-180,180 has no stop (default: -170,170)', _span)
    axis_rate: float = setting(60.0, 'DEG_S', 'highest rate of each axis', number(0.1, 1000))
    drift: float = 0.5
    lacks: int = setting(
        0, 'NAME,...', 'GIMBAL_DEVICE_CAP_FLAGS that it does not have, such as has_yaw_lock',
        _capabilities)

    @property
    def capabilities(self) -> int:
        """Return its GIMBAL_DEVICE_CAP_FLAGS."""
        endless = (mavlink.GIMBAL_DEVICE_CAP_FLAGS_SUPPORTS_INFINITE_YAW
                   if self.yaw_range.is_endless else 0)
        return (CAPABILITIES | endless) & ~self.lacks

    @property
    def rate(self) -> float:
        """Return the highest rate of each axis, rad/s."""
        return math.radians(self.axis_rate)

    @property
    def ranges(self) -> Ranges:
        """Return the ranges in the order of the axes."""
        return self.roll_range, self.pitch_range, self.yaw_range

    @property
    def neutral(self) -> Vector:
        """Return the angles of the neutral position, rad: level and ahead."""
        roll, pitch, yaw = (span.clip(0.0) for span in self.ranges)
        return roll, pitch, yaw

    @property
    def retracted(self) -> Vector:
        """Return the angles of the retracted position, rad: the highest pitch, and ahead."""
        roll, _, yaw = self.neutral
        return roll, self.pitch_range.high, yaw


class VehicleAttitude(NamedTuple):
    """
    The attitude of the vehicle, rad.

    :param yaw: its heading, rad from north.
    :param rate: of the heading, rad/s; NaN if unknown.
    :param until: when it is no longer current, s.
    """

    roll: float
    pitch: float
    yaw: float
    rate: float
    until: float


@dataclass
class _Axis:
    """
    One axis.

    :ivar angle: rad; velocity: rad/s.
    :ivar target: in the reference of the axis, rad; it turns at ``rate``, rad/s.
    :ivar speed: at which the axis approaches the target, rad/s.
    :ivar stopped: whether it is at the end of its range, and its target is beyond.
    """

    angle: float = 0.0
    velocity: float = 0.0
    target: float = 0.0
    rate: float = 0.0
    speed: float = 0.0
    stopped: bool = False

    def advance(self, seconds: float, goal: float, span: Range, *, endless: bool) -> None:
        """Approach a goal, rad, for some time."""
        within = goal if endless else span.clip(goal)
        error = wrapped(within - self.angle) if endless else within - self.angle
        step = math.copysign(min(abs(error), self.speed * seconds), error)
        self.velocity = step / seconds
        self.angle = wrapped(self.angle + step) if endless else self.angle + step
        self.stopped = within != goal and abs(within - self.angle) < RESOLUTION
        if self.stopped and self.rate:
            # Otherwise its return would take as long as it was driven against the stop.
            self.target += self.angle - goal


@dataclass
class GimbalMotion:
    """
    The axes of a gimbal: roll and pitch relative to the horizon, yaw relative to the vehicle.

    A call computes the state at its time ``now``, s.

    :ivar flags: the flags of the latest setpoint.
    :ivar frame: the yaw frame of the latest setpoint.
    :ivar travelled: sum of the angles of all movements, rad.
    """

    mechanics: GimbalMechanics
    now: float
    flags: int = LEVEL
    frame: YawFrame = YawFrame.VEHICLE
    vehicle: VehicleAttitude = VehicleAttitude(0.0, 0.0, 0.0, math.nan, -math.inf)
    travelled: float = 0.0
    _axes: tuple[_Axis, _Axis, _Axis] = field(
        default_factory=lambda: (_Axis(), _Axis(), _Axis()))
    _frozen_axis: str = ''
    _limited: bool = True

    def fail(self, frozen_axis: str, *, limited: bool) -> None:
        """Freeze an axis, '' for none; set whether the axes keep within their ranges."""
        self._frozen_axis, self._limited = frozen_axis, limited

    def heading_known(self, now: float) -> bool:
        """Return whether the vehicle's heading is known."""
        return now < self.vehicle.until

    def _heading(self, now: float) -> float:
        """Return the heading of the gimbal's gyros; it drifts while the vehicle sends none."""
        lost = max(0.0, now - max(self.vehicle.until, 0.0))
        return wrapped(self.vehicle.yaw + math.radians(self.mechanics.drift) * lost)

    def receive_heading(
        self, roll: float, pitch: float, yaw: float, rate: float, now: float,
        valid: float = HEADING_TIMEOUT,
    ) -> None:
        """Receive the attitude of the vehicle, rad, and its turning rate, rad/s."""
        self.advance(now)
        self.vehicle = VehicleAttitude(roll, pitch, yaw, rate, now + valid)

    def locked(self, axis: int) -> bool:
        """Return whether an axis is held against the horizon or against north."""
        can_follow = self.mechanics.capabilities & HAS_FOLLOW[axis]
        can_lock = self.mechanics.capabilities & HAS_LOCK[axis]
        return bool(can_lock and (self.flags & LOCKS[axis] or not can_follow))

    def _references(self, now: float) -> Vector:
        """Return for each axis the difference of its angle and its target, rad."""
        vehicle = self.vehicle
        roll, pitch = (0.0 if self.locked(axis) else angle
                       for axis, angle in enumerate((vehicle.roll, vehicle.pitch)))
        return roll, pitch, -self._heading(now) if self.locked(2) else 0.0

    def obey(self, setpoint: Setpoint, now: float) -> None:
        """
        Receive a setpoint (GIMBAL_DEVICE_SET_ATTITUDE).

        A rate with an angle is the speed at which the axis approaches the angle; an axis with
        neither keeps its angle.
        """
        self.advance(now)
        flags, angles, rates = setpoint.flags, setpoint.angles, setpoint.rates
        self.flags, self.frame = flags & SETTABLE, setpoint.frame
        if flags & (mavlink.GIMBAL_DEVICE_FLAGS_RETRACT | mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL):
            # RETRACT takes precedence (GIMBAL_DEVICE_FLAGS).
            mechanics = self.mechanics
            angles = (mechanics.retracted if flags & mavlink.GIMBAL_DEVICE_FLAGS_RETRACT
                      else mechanics.neutral)
            rates, self.frame = UNSET_VECTOR, YawFrame.VEHICLE
        references = self._references(now)
        for index, (axis, angle, rate) in enumerate(zip(self._axes, angles, rates, strict=True)):
            axis.rate, axis.speed = 0.0, self.mechanics.rate
            if math.isfinite(angle):
                axis.target = angle
                if index == 2:
                    own = self._heading(now) if self.frame is YawFrame.EARTH else 0.0
                    axis.target = angle - own - references[index]
                if math.isfinite(rate) and rate:
                    axis.speed = min(abs(rate), self.mechanics.rate)
            else:
                axis.target = axis.angle - references[index]
                if math.isfinite(rate):
                    axis.rate = Range(-self.mechanics.rate, self.mechanics.rate).clip(rate)

    def turn(self, pitch: float, yaw: float, now: float) -> None:
        """Move it by hand: it keeps these angles, rad, relative to horizon and vehicle."""
        self.advance(now)
        references = self._references(now)
        for index, angle in ((1, pitch), (2, yaw)):
            axis = self._axes[index]
            before, axis.angle = axis.angle, self.mechanics.ranges[index].clip(angle)
            self.travelled += abs(axis.angle - before)
            axis.target, axis.rate = axis.angle - references[index], 0.0

    def advance(self, now: float) -> None:
        """Move until a moment."""
        seconds, self.now = now - self.now, now
        if seconds <= 0:
            return
        references, capabilities = self._references(now), self.mechanics.capabilities
        for name, axis, span, reference, has_axis in zip(
                AXES, self._axes, self.mechanics.ranges, references, HAS_AXIS, strict=True):
            turned = axis.rate * seconds
            axis.target += turned
            goal = axis.target + reference
            if name == 'yaw':
                # The goal of an angle is within -pi..pi; a rate continues from the present angle.
                ahead = axis.angle + turned
                goal = ahead + wrapped(goal - ahead) if axis.rate else wrapped(goal)
            if name == self._frozen_axis or not capabilities & has_axis:
                goal = axis.angle
            axis.advance(seconds, goal, span if self._limited else NO_STOPS,
                         endless=name == 'yaw' and span.is_endless)
            self.travelled += abs(axis.velocity) * seconds

    @property
    def angles(self) -> Vector:
        """Return roll, pitch and yaw, rad, yaw relative to the vehicle."""
        roll, pitch, yaw = self._axes
        return roll.angle, pitch.angle, yaw.angle

    @property
    def rates(self) -> Vector:
        """Return their rates, rad/s."""
        roll, pitch, yaw = self._axes
        return roll.velocity, pitch.velocity, yaw.velocity

    @property
    def moving(self) -> bool:
        """Return whether an axis moves, slow drift aside."""
        drift = math.radians(self.mechanics.drift)
        return any(abs(rate) > drift * 1.5 + RESOLUTION for rate in self.rates)

    def limits(self) -> int:
        """Return the flags of the axes that are stopped at the end of their range."""
        return sum(flag for flag, axis in zip(AT_LIMIT, self._axes, strict=True) if axis.stopped)

    def attitude(self, frame: YawFrame) -> Quaternion:
        """Return the attitude in MAVLink's axes; the earth frame needs the heading."""
        roll, pitch, yaw = self.angles
        return Quaternion.from_euler(
            roll, pitch, yaw + self.vehicle.yaw if frame is YawFrame.EARTH else yaw)
