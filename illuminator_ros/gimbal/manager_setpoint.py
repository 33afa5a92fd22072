# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
Setpoints of a gimbal: reading, mixing and limiting them. Pure functions; MAVLink's conventions.

A setpoint has angles, which the ranges of the axes limit. They are read from a quaternion once,
and become one once, in the message to the device. Roll and pitch are relative to the horizon. Yaw
is relative to north or to the vehicle's heading: see :class:`~..geometry.mount_attitude.YawFrame`.
"""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import NamedTuple

from . import messages as gimbal
from .axes import LEVEL, Range, Ranges, RATE_LIMIT, UNLIMITED
from .messages import rates_of
from ..geometry.mount_attitude import AXES, STILL, UNSET_VECTOR, yaw_frame, YawFrame
from ..geometry.rotation import Quaternion, Vector
from ..mavlink.command_sender import DEGREE_SCALE
from ..mavlink.dialect import MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME, mavlink
from ..mavlink.messages import AnyCommand, CommandInt, params_of
from ..payload.messages import GeoPoint

# Flags that alone set the attitude.
POSES = mavlink.GIMBAL_DEVICE_FLAGS_RETRACT | mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL
# Flags that are copied to GIMBAL_DEVICE_SET_ATTITUDE; its yaw frame flags depend on the frame.
_PASSED_BITS = (POSES | LEVEL | mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
                | mavlink.GIMBAL_DEVICE_FLAGS_RC_EXCLUSIVE
                | mavlink.GIMBAL_DEVICE_FLAGS_RC_MIXED)
_RIGHT_ANGLE = math.pi / 2
# rad that a clipped angle is beyond its range at least, and by which the other end of the range
# must be nearer before an axis leaves the end where it is.
_TOLERANCE = 1e-5
_HYSTERESIS = math.radians(10)
# rad/s at full deflection of GIMBAL_MANAGER_SET_MANUAL_CONTROL, which leaves it open.
MANUAL_RATE = 0.5
# Equatorial radius, m, and squared eccentricity of WGS 84.
_RADIUS, _ECCENTRICITY_2 = 6378137.0, 6.69437999014e-3


class Refused(ValueError):
    """
    A request of a player is refused, and the reason.

    :param result: MAV_RESULT of a command.
    """

    def __init__(self, reason: str, result: int = mavlink.MAV_RESULT_DENIED) -> None:
        super().__init__(reason)
        self.result = result


class Setpoint(NamedTuple):
    """
    A setpoint of a gimbal: the request of a player, and then what the device gets.

    :param flags: GIMBAL_DEVICE_FLAGS.
    :param frame: of its yaw.
    :param angles: roll, pitch, yaw, rad. In a request NaN leaves an axis as it is; after
        :meth:`resolved` all are NaN for a pose, or where only the rates count.
    :param rates: of the axes, rad/s; NaN where none is given.
    :param turning: the rates at which the manager turns the angles, rad/s.
    :param since: when the angles apply, s.
    """

    flags: int = 0
    frame: YawFrame = YawFrame.VEHICLE
    angles: Vector = UNSET_VECTOR
    rates: Vector = UNSET_VECTOR
    turning: Vector = STILL
    since: float = 0.0

    @property
    def is_pose(self) -> bool:
        """Whether a flag alone sets the attitude."""
        return bool(self.flags & POSES)

    @property
    def has_angles(self) -> bool:
        """Whether it has an angle."""
        return any(map(math.isfinite, self.angles))

    @property
    def has_all_angles(self) -> bool:
        """Whether it has an angle for each axis."""
        return all(map(math.isfinite, self.angles))

    @property
    def has_rates_only(self) -> bool:
        """Whether it has a rate, and no angle."""
        return any(map(math.isfinite, self.rates)) and not self.has_angles

    @property
    def attitude(self) -> Quaternion | None:
        """Return the attitude, None unless it has all angles."""
        return Quaternion.from_euler(*self.angles) if self.has_all_angles else None

    @property
    def operation(self) -> int:
        """Return the flags without the flags of the yaw frame."""
        return self.flags & _PASSED_BITS

    @property
    def device_flags(self) -> int:
        """Return the flags for the device."""
        return self.flags & _PASSED_BITS | self.frame.flag

    def resolved(self, current: Vector, now: float, *, turns: bool) -> Setpoint:
        """
        Return the setpoint that this request makes.

        :param current: the angles, in the frame of the request, of axes without an angle; not used
            for a pose or, unless ``turns``, for rates only.
        :param turns: whether the manager must turn the gimbal where only rates are given.
        """
        if self.is_pose:
            return self._replace(angles=UNSET_VECTOR, rates=UNSET_VECTOR, since=now)
        if self.has_all_angles:
            return self._replace(since=now)
        known = [rate if math.isfinite(rate) else 0.0 for rate in self.rates]
        if self.has_rates_only and not turns:
            return self._replace(rates=_vector(known), since=now)
        angles, rates, turning = zip(*(
            (angle, rate, 0.0) if math.isfinite(angle) else (old, math.nan, known_rate)
            for angle, rate, old, known_rate in zip(
                self.angles, self.rates, current, known, strict=True)), strict=True)
        return self._replace(
            angles=_vector(angles), rates=_vector(rates), turning=_vector(turning), since=now)

    def stopped(self) -> Setpoint:
        """Return the setpoint that ends the motion of this one."""
        return self._replace(
            turning=STILL, rates=STILL if self.has_rates_only else UNSET_VECTOR)

    def offsets(self, limit: float) -> Vector:
        """Return what a player in secondary control adds by it, rad, each within the limit."""
        return _vector([Range(-limit, limit).clip(angle) if math.isfinite(angle) else 0.0
                        for angle in self.angles])

    def in_vehicle_frame(self, heading: float) -> Setpoint:
        """Return it with its yaw relative to the vehicle instead of north."""
        return self._replace(
            frame=YawFrame.VEHICLE, flags=self.flags & ~mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK,
            angles=turned_by(self.angles, -heading))

    @classmethod
    def _checked(cls, flags: int, angles: Vector, rates: Vector) -> Setpoint:
        """
        Return a request with the yaw frame that its flags name.

        :raises ValueError: if the flags name both frames, an angle is beyond half a turn, or a
            rate is beyond :data:`~.axes.RATE_LIMIT`.
        """
        # The definitions of the angles have no larger values. So a larger one is an error, and to
        # subtract turns from it would turn the gimbal to a pose that no player has requested.
        for values, limit, error in (
                (angles, math.pi + _TOLERANCE, 'an angle is beyond 180 degrees'),
                (rates, RATE_LIMIT, f'a rate is beyond {RATE_LIMIT:.4f} rad/s')):
            for value in values:
                if abs(value) > limit:
                    raise ValueError(error)
        return cls(flags, yaw_frame(flags), angles, rates)

    @classmethod
    def from_attitude(
        cls, message: gimbal.GimbalManagerSetAttitude | gimbal.GimbalDeviceSetAttitude,
        ranges: Ranges = UNLIMITED,
    ) -> Setpoint:
        """
        Read GIMBAL_MANAGER_SET_ATTITUDE or GIMBAL_DEVICE_SET_ATTITUDE.

        :raises ValueError: if the quaternion is not a rotation; also see :meth:`_checked`.
        """
        angles = UNSET_VECTOR
        if not all(map(math.isnan, message.q)):
            angles = _nearest_reading(Quaternion(*message.q).normalized().euler(), ranges)
        return cls._checked(message.flags, angles, rates_of(message))

    @classmethod
    def from_pitch_yaw(
        cls, flags: int, pitch: float, yaw: float, pitch_rate: float, yaw_rate: float,
    ) -> Setpoint:
        """
        Read the values of GIMBAL_MANAGER_SET_PITCHYAW, rad and rad/s; with an angle, roll is 0.

        :raises ValueError: see :meth:`_checked`.
        """
        roll = math.nan if math.isnan(pitch) and math.isnan(yaw) else 0.0
        return cls._checked(flags, (roll, pitch, yaw), (math.nan, pitch_rate, yaw_rate))


# A message that sets the attitude of a gimbal.
AnySetpoint = (gimbal.GimbalManagerSetAttitude | gimbal.GimbalManagerSetPitchyaw
               | gimbal.GimbalManagerSetManualControl)


def read_setpoint(message: AnySetpoint, ranges: Ranges) -> Setpoint:
    """
    Read a message of a player.

    :raises ValueError: if it is not valid.
    """
    if isinstance(message, gimbal.GimbalManagerSetAttitude):
        return Setpoint.from_attitude(message, ranges)
    values = message.pitch, message.yaw, message.pitch_rate, message.yaw_rate
    if isinstance(message, gimbal.GimbalManagerSetManualControl):
        # Shares of the ranges, and of a rate.
        if any(abs(value) > 1 for value in values):
            raise ValueError('a deflection is beyond -1 and 1')
        pitch, yaw = (value * (min(range_.high, math.pi) if value > 0
                               else -max(range_.low, -math.pi))
                      for value, range_ in zip(values[:2], ranges[1:], strict=True))
        values = pitch, yaw, values[2] * MANUAL_RATE, values[3] * MANUAL_RATE
    return Setpoint.from_pitch_yaw(message.flags, *values)


def _are_within(angles: Sequence[float], ranges: Sequence[Range]) -> bool:
    for angle, range_ in zip(angles, ranges, strict=True):
        if not range_.low <= angle <= range_.high:
            return False
    return True


def _nearest_reading(angles: Vector, ranges: Ranges) -> Vector:
    """
    Return the angles of an attitude whose roll and pitch are nearer to the ranges.

    The same attitude has a pitch beyond a right angle, with roll and yaw turned by half a turn. To
    clip the other angles would turn the gimbal to another pose.
    """
    roll, pitch, yaw = angles
    if _are_within((roll, pitch), ranges[:2]):
        return angles
    half_turned = (math.remainder(roll + math.pi, math.tau),
                   math.copysign(math.pi, pitch) - pitch,
                   math.remainder(yaw + math.pi, math.tau))
    return min(angles, half_turned, key=lambda one: sum(
        abs(range_.clip(angle) - angle) for angle, range_ in zip(one[:2], ranges, strict=False)))


class Clipped(NamedTuple):
    """An angle beyond the range of its axis, rad: as requested, and the limit."""

    axis: str
    requested: float
    limit: float


def turned(
    setpoint: Setpoint, now: float, ranges: Ranges, ahead: float | None,
    offsets: Vector = STILL, before: Sequence[Clipped] = (),
) -> Setpoint:
    """
    Return a setpoint as the manager has turned it until now, each axis to its stop at most.

    The other parameters are those of :func:`clip`.
    """
    if not setpoint.has_all_angles:
        return setpoint
    elapsed = now - setpoint.since
    roll, pitch, yaw = (
        range_.clip(angle + rate * elapsed + offset) if rate or offset else angle
        for angle, range_, rate, offset in zip(
            *_on_axes(setpoint, ranges, ahead, before), setpoint.turning, offsets, strict=True))
    return setpoint._replace(since=now, angles=(roll, pitch, yaw + (ahead or 0.0)))


def clip(
    setpoint: Setpoint, ranges: Ranges, ahead: float | None, offsets: Vector = STILL,
    before: Sequence[Clipped] = (),
) -> tuple[Vector, tuple[Clipped, ...]]:
    """
    Return the angles of a setpoint within the ranges, and the clipped angles.

    :param ahead: the direction from which the range of the yaw counts, rad in the frame of the
        setpoint; None where it is not known, which leaves the yaw as it is.
    :param offsets: added to the angles before, rad.
    :param before: the angles that were clipped the last time.
    """
    _, pitch, _ = setpoint.angles
    if (ahead is not None and offsets == STILL == setpoint.turning and not before
            and abs(pitch) <= _RIGHT_ANGLE
            and _are_within(turned_by(setpoint.angles, -ahead), ranges)):
        # Most setpoints are within the ranges, and the rest takes longer.
        return setpoint.angles, ()
    if not setpoint.has_all_angles:
        return setpoint.angles, ()
    clipped, angles = [], []
    for axis, angle, range_, offset, rate in zip(
            AXES, *_on_axes(setpoint, ranges, ahead, before), offsets, setpoint.turning,
            strict=True):
        angles.append(range_.clip(angle + offset))
        # A rate against a stop is beyond it, a difference by float32 rounding is not.
        requested = angle + offset + (math.copysign(2 * _TOLERANCE, rate) if rate else 0.0)
        limit = range_.clip(requested)
        if abs(limit - requested) > _TOLERANCE:
            clipped.append(Clipped(axis, requested, limit))
    roll, pitch, yaw = angles
    return (roll, pitch, yaw + (ahead or 0.0)), tuple(clipped)


def _on_axes(
    setpoint: Setpoint, ranges: Ranges, ahead: float | None, before: Sequence[Clipped],
) -> tuple[Vector, Ranges]:
    """Return the angles as the axes count them, and the ranges, infinite without stops."""
    stops = {one.axis: one.limit for one in before}
    roll, pitch, yaw = setpoint.angles
    roll_range, pitch_range, yaw_range = (
        Range() if range_.is_endless else range_ for range_ in ranges)
    # Beyond a right angle another roll and yaw would have the same attitude.
    pitch_range = Range(max(pitch_range.low, -_RIGHT_ANGLE), min(pitch_range.high, _RIGHT_ANGLE))
    if ahead is None:
        yaw_range = Range()
    return ((_nearest(roll, roll_range, stops.get('roll')), pitch,
             _nearest(yaw - (ahead or 0.0), yaw_range, stops.get('yaw'),
                      is_noisy=setpoint.frame is YawFrame.EARTH)),
            (roll_range, pitch_range, yaw_range))


def _nearest(
    angle: float, range_: Range, stop: float | None, *, is_noisy: bool = False,
) -> float:
    """
    Return the angle, or the same direction a turn away, that is nearest to a range.

    :param stop: the end of the range where the axis is, None if it is at neither.
    :param is_noisy: whether the angle contains the measured heading of the vehicle.
    """
    def distance(one: float) -> float:
        limit = range_.clip(one)
        # Noise must not turn an axis from one end to the other, which may be less than the noise
        # apart.
        is_free = limit == one and (stop is None or not is_noisy)
        return abs(one - limit) + (0.0 if is_free or limit == stop else _HYSTERESIS)

    angle = math.remainder(angle, math.tau)
    return min((angle, angle + math.tau, angle - math.tau), key=distance)


def turned_by(angles: Vector, yaw: float) -> Vector:
    """Return angles whose yaw is greater by an angle, rad."""
    return angles[0], angles[1], angles[2] + yaw


def _vector(values: Sequence[float]) -> Vector:
    roll, pitch, yaw = values
    return roll, pitch, yaw


def read_roi(command: AnyCommand) -> tuple[GeoPoint, bool]:
    """
    Return the place of MAV_CMD_DO_SET_ROI_LOCATION.

    :return: the place, and whether its altitude is relative to the home position.
    :raises Refused: if it has no valid place.
    """
    *_, latitude, longitude, altitude = params_of(command)
    is_relative = False
    # A COMMAND_LONG has no frame; PX4, too, reads its altitude as above mean sea level.
    if isinstance(command, CommandInt):
        is_relative = command.frame in gimbal.RELATIVE_FRAMES
        if not is_relative and command.frame not in gimbal.ABSOLUTE_FRAMES:
            raise Refused(f'the frame {command.frame} of the place is not supported',
                          MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME)
        latitude, longitude = latitude / DEGREE_SCALE, longitude / DEGREE_SCALE
    if (abs(latitude) <= 90 and abs(longitude) <= 180
            and abs(altitude) <= gimbal.ALTITUDE_LIMIT):
        return GeoPoint(latitude, longitude, altitude), is_relative
    raise Refused(f'{latitude:g}, {longitude:g}, {altitude:g} is not a place')


def direction(origin: GeoPoint, target: GeoPoint) -> tuple[float, float] | None:
    """
    Return pitch and yaw of the line from one place to another, rad.

    :return: None if the places are less than 0.1 m apart.
    """
    x, y, z = (b - a for a, b in zip(_in_space(origin), _in_space(target), strict=True))
    latitude, longitude = math.radians(origin.latitude), math.radians(origin.longitude)
    outward = math.cos(longitude) * x + math.sin(longitude) * y
    north = math.cos(latitude) * z - math.sin(latitude) * outward
    east = math.cos(longitude) * y - math.sin(longitude) * x
    up = math.cos(latitude) * outward + math.sin(latitude) * z
    if math.hypot(north, east, up) < 0.1:
        return None
    return math.atan2(up, math.hypot(north, east)), math.atan2(east, north)


def _in_space(place: GeoPoint) -> Vector:
    """Return a place in coordinates from the centre of the earth, m."""
    latitude, longitude = math.radians(place.latitude), math.radians(place.longitude)
    radius = _RADIUS / math.sqrt(1 - _ECCENTRICITY_2 * math.sin(latitude) ** 2)
    across = (radius + place.altitude) * math.cos(latitude)
    return (across * math.cos(longitude), across * math.sin(longitude),
            (radius * (1 - _ECCENTRICITY_2) + place.altitude) * math.sin(latitude))
