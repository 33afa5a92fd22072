# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
Conversions between ROS and the camera: pure functions, and one table of all fields.

ROS: ENU and FLU (REP-103), heights above the WGS84 ellipsoid, m, rad. The camera: NED and FRD,
heights above mean sea level, and mount angles of its own. At a rotation of zero relative to the
vehicle, the camera looks straight down with the top of its images ahead.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
import math
from typing import cast, TypeVar

from .messages import CameraFeedback, GpsRawInt, GpsStatus, MountStatus
from ..geometry.rotation import enu_flu, enu_ned, flip, flu_frd, ned_frd, Quaternion, Vector
from ..mavlink.messages import Message
from ..payload.messages import Attitude, GlobalPositionInt, SystemTime

M = TypeVar('M', bound=Message)

# 2015-01-01, before the first camera of the series, and 2100-01-01, us since the UNIX epoch.
FIRST_UTC, LAST_UTC = 1_420_070_400_000_000, 4_102_444_800_000_000
# m/s; below it the course is noise.
SLOWEST_COURSE = 0.3
# GPS_FIX_TYPE by the status of a NavSatFix: 3D, DGPS, RTK float. The others mean "no fix".
FIX_TYPES = {0: 3, 1: 4, 2: 5}
GPS_STATUS_SATELLITES = 20
UINT16_UNKNOWN, UINT8_UNKNOWN = 65535, 255


class MountFrame(Enum):
    """The axes of the camera's frame in ROS."""

    # x out of the lens, z to the top of the image.
    CAMERA = 'camera'
    # z out of the lens, x to the right of the image (REP-103, "Suffix Frames").
    OPTICAL = 'optical'


class MountParent(Enum):
    """The frame of the orientation in ``~/mount``, by its usual ``frame_id``."""

    VEHICLE = 'base_link'
    # Level, with the vehicle's heading.
    LEVEL = 'base_link_stabilized'
    EARTH = 'map'

    @classmethod
    def of(cls, frame_id: str) -> MountParent:
        """
        Return the frame that a ``frame_id`` names, with or without a prefix and a slash.

        :raises ValueError: if it names another frame; '' is the vehicle's frame.
        """
        name = frame_id.rpartition('/')[2] if frame_id else cls.VEHICLE.value
        for parent in cls:
            if name == parent.value:
                return parent
        known = ', '.join(one.value for one in cls)
        raise ValueError(f'frame_id {frame_id!r} is not one of {known}')


@dataclass(frozen=True)
class Field:
    """
    A field of a sent message.

    :param source: the value from ROS.
    :param unit: of that value and of its range.
    :param scale: counts of the field for one unit; None for a float field, in the unit itself.
    :param low: and ``high``, the permitted range, both ends included.
    :param unknown: sent for a value that is NaN or out of range; None if nothing is sent.
    """

    source: str
    unit: str
    scale: float | None
    low: float
    high: float
    unknown: int | None = None

    def encode(self, value: float) -> float:
        """
        Return the value of the field.

        :raises ValueError: if the value is out of range and the field has none for "unknown".
        """
        if not self.includes(value):
            if self.unknown is None:
                raise ValueError(f'{self.source}: {value:.10g} {self.unit} is outside '
                                 f'{self.low:.10g} to {self.high:.10g} {self.unit}')
            return self.unknown
        return value if self.scale is None else round(value * self.scale)

    def includes(self, value: float) -> bool:
        """Return whether a value is in the range."""
        return self.low <= value <= self.high


_UTC = Field('UTC of ~/fix', 'us', 1, FIRST_UTC, LAST_UTC)
_LATITUDE = Field('latitude of ~/fix', 'deg', 1e7, -90, 90)
_LONGITUDE = Field('longitude of ~/fix', 'deg', 1e7, -180, 180)
_ALTITUDE = Field('altitude of ~/fix less geoid_separation', 'm', 1e3, -1000, 100_000)
_SATELLITES = Field('~/satellites', '', 1, 0, 254, UINT8_UNKNOWN)


def _accuracy(axis: str) -> Field:
    return Field(f'standard deviation of ~/fix, {axis}', 'm', 100, 0, 655.34, UINT16_UNKNOWN)


def _velocity(axis: str) -> Field:
    return Field(f'velocity, {axis}', 'm/s', 100, -327.67, 327.67)


def _angle(name: str, limit: float = math.pi) -> Field:
    # A rounded angle may exceed the limit.
    return Field(f'{name} of ~/imu or ~/attitude', 'rad', None, -limit - 1e-9, limit + 1e-9)


def _rate(axis: str) -> Field:
    return Field(f'angular velocity of ~/imu, {axis}', 'rad/s', None, -1e3, 1e3, 0)


def _mount(name: str) -> Field:
    return Field(f'{name} of ~/mount or mount_{name}', 'deg', 100, -180, 180)


# By message and field. Fields that are not listed are addresses, or ignored by the camera.
FIELDS: Mapping[type[Message], Mapping[str, Field]] = {
    GpsRawInt: {
        'time_usec': _UTC,
        'fix_type': Field('status of ~/fix', '', 1, 3, 5),
        'lat': _LATITUDE,
        'lon': _LONGITUDE,
        'alt': _ALTITUDE,
        'eph': _accuracy('horizontal'),
        'epv': _accuracy('vertical'),
        'vel': Field('velocity, horizontal', 'm/s', 100, 0, 655.34, UINT16_UNKNOWN),
        'cog': Field('course of the velocity', 'deg', 100, 0, 359.99, UINT16_UNKNOWN),
        'satellites_visible': _SATELLITES,
    },
    SystemTime: {'time_unix_usec': _UTC},
    GlobalPositionInt: {
        'lat': _LATITUDE,
        'lon': _LONGITUDE,
        'alt': _ALTITUDE,
        'vx': _velocity('north'),
        'vy': _velocity('east'),
        'vz': _velocity('down'),
    },
    Attitude: {
        'roll': _angle('roll'),
        'pitch': _angle('pitch', math.pi / 2),
        'yaw': _angle('yaw from north'),
        'rollspeed': _rate('ahead'),
        'pitchspeed': _rate('right'),
        'yawspeed': _rate('down'),
    },
    MountStatus: {
        'pointing_a': _mount('pitch'),
        'pointing_b': _mount('roll'),
        'pointing_c': _mount('yaw'),
    },
    GpsStatus: {'satellites_visible': _SATELLITES},
}


def _encode(cls: type[M], constants: Mapping[str, object], **values: float) -> M:
    fields = FIELDS[cls]
    return cast('Callable[..., M]', cls)(**constants, **{
        name: fields[name].encode(value) for name, value in values.items()})


@dataclass(frozen=True, slots=True)
class Position:
    """
    A position with its fix.

    :param status: of a NavSatFix.
    :param latitude: and ``longitude``, degrees.
    :param altitude: above the WGS84 ellipsoid, m.
    :param horizontal: and ``vertical``, standard deviations, m; NaN if unknown.
    """

    status: int
    latitude: float
    longitude: float
    altitude: float
    horizontal: float = math.nan
    vertical: float = math.nan


def is_no_place(position: Position) -> bool:
    """Return whether a position is 0, 0, which receivers and autopilots send without a fix."""
    return position.latitude == position.longitude == 0


def standard_deviations(covariance: Sequence[float]) -> tuple[float, float]:
    """Return the larger horizontal and the vertical deviation of a row-major ENU covariance, m."""
    def root(*variances: float) -> float:
        return math.sqrt(max(variances)) if all(one >= 0 for one in variances) else math.nan

    return root(covariance[0], covariance[4]), root(covariance[8])


def fix_type(status: int) -> int:
    """
    Return GPS_FIX_TYPE for the status of a NavSatFix.

    :raises ValueError: if that means "no fix".
    """
    if status not in FIX_TYPES:
        raise ValueError(f'no fix (status {status})')
    return FIX_TYPES[status]


def gps_raw_int(
    position: Position, utc: int, velocity: Vector | None, satellites: int | None,
    geoid_separation: float,
) -> GpsRawInt:
    """
    Return GPS_RAW_INT.

    :param utc: us since the UNIX epoch.
    :param velocity: ENU, m/s; None if unknown.
    :param geoid_separation: height of mean sea level above the ellipsoid, m.
    :raises ValueError: if there is no fix, or a value is out of range.
    """
    speed = course = math.nan
    if velocity is not None:
        east, north, _ = velocity
        speed = math.hypot(east, north)
        if speed >= SLOWEST_COURSE:
            course = round(math.degrees(math.atan2(east, north)), 2) % 360.0
    return _encode(
        GpsRawInt, {}, time_usec=utc, fix_type=fix_type(position.status), lat=position.latitude,
        lon=position.longitude, alt=position.altitude - geoid_separation, eph=position.horizontal,
        epv=position.vertical, vel=speed, cog=course,
        satellites_visible=math.nan if satellites is None else satellites)


def global_position_int(
    position: Position, velocity: Vector, geoid_separation: float, boot_ms: int,
) -> GlobalPositionInt:
    """
    Return GLOBAL_POSITION_INT, which implies a fix and has no value for an unknown velocity.

    The parameters are those of :func:`gps_raw_int`.

    :raises ValueError: if there is no fix, or a value is out of range.
    """
    fix_type(position.status)
    north, east, down = enu_ned(velocity)
    return _encode(
        GlobalPositionInt, {'time_boot_ms': boot_ms, 'relative_alt': 0, 'hdg': UINT16_UNKNOWN},
        lat=position.latitude, lon=position.longitude, alt=position.altitude - geoid_separation,
        vx=north, vy=east, vz=down)


def system_time(utc: int, boot_ms: int) -> SystemTime:
    """
    Return SYSTEM_TIME for UTC in us.

    :raises ValueError: if that cannot be UTC.
    """
    return _encode(SystemTime, {'time_boot_ms': boot_ms}, time_unix_usec=utc)


def attitude(orientation: Quaternion, rates: Vector, boot_ms: int) -> Attitude:
    """
    Return ATTITUDE.

    :param orientation: of the vehicle's FLU body in ENU, of norm 1.
    :param rates: of the body, FLU, rad/s; NaN if unknown. The camera ignores them.
    """
    roll, pitch, yaw = ned_frd(orientation).euler()
    ahead, right, down = flu_frd(rates)
    return _encode(Attitude, {'time_boot_ms': boot_ms}, roll=roll, pitch=pitch, yaw=yaw,
                   rollspeed=ahead, pitchspeed=right, yawspeed=down)


def interpolate(one: Quaternion, other: Quaternion, share: float) -> Quaternion:
    """Return the rotation at a share (0..1) of the way between two close rotations."""
    # q and -q are the same rotation.
    sign = 1.0 if (one.inverse() * other).w >= 0 else -1.0
    rest, share = 1 - share, sign * share
    return Quaternion(
        rest * one.w + share * other.w, rest * one.x + share * other.x,
        rest * one.y + share * other.y, rest * one.z + share * other.z).normalized()


# The camera has the axes of an FRD body with x out of the lens. Its zero pose in the vehicle:
# x down, z to the rear.
_ZERO_POSE = Quaternion.from_euler(0.0, -math.pi / 2, 0.0)
# Converts coordinates in the optical frame to coordinates in the frame with x out of the lens.
_FROM_OPTICAL = Quaternion(0.5, -0.5, 0.5, -0.5)


def in_vehicle(mount: Quaternion, parent: MountParent, vehicle: Quaternion) -> Quaternion:
    """
    Return the orientation of the camera's frame in ``base_link``.

    :param mount: its orientation in another frame, of norm 1.
    :param vehicle: orientation of ``base_link`` in ENU, of norm 1.
    """
    if parent is MountParent.VEHICLE:
        return mount
    if parent is MountParent.LEVEL:
        mount = Quaternion.from_euler(0.0, 0.0, vehicle.euler()[2]) * mount
    return vehicle.inverse() * mount


def mount_angles(mount: Quaternion, frame: MountFrame) -> Vector:
    """
    Return roll, pitch and yaw of the camera in its own convention, degrees.

    :param mount: orientation of the camera's frame in ``base_link`` (FLU), of norm 1.
    """
    if frame is MountFrame.OPTICAL:
        mount = mount * _FROM_OPTICAL.inverse()
    turned = _ZERO_POSE.inverse() * flip(mount)
    _, pitch, yaw = (round(math.degrees(angle), 2) for angle in turned.euler())
    # Near the singular pitch the rounding errors of yaw and roll would add up: roll compensates
    # the error of yaw.
    rest = Quaternion.from_euler(0.0, math.radians(pitch), math.radians(yaw)).inverse() * turned
    return math.degrees(2 * math.atan2(*(
        (rest.x, rest.w) if rest.w >= 0 else (-rest.x, -rest.w)))), pitch, yaw


def fixed_mount(angles: Vector, frame: MountFrame) -> Quaternion:
    """
    Return the orientation of the camera's frame in ``base_link``.

    :param angles: as :func:`mount_angles` returns them.
    """
    mount = flip(_ZERO_POSE * Quaternion.from_euler(*map(math.radians, angles)))
    return mount * _FROM_OPTICAL if frame is MountFrame.OPTICAL else mount


def mount_status(angles: Vector, target: tuple[int, int]) -> MountStatus:
    """
    Return MOUNT_STATUS.

    :param angles: roll, pitch and yaw, degrees, each within -180..180; 180 is sent for -180.
    :param target: system and component of the camera.
    :raises ValueError: if an angle is out of range.
    """
    roll, pitch, yaw = (180.0 if angle < -179.995 else angle for angle in angles)
    system, component = target
    return _encode(MountStatus, {'target_system': system, 'target_component': component},
                   pointing_a=pitch, pointing_b=roll, pointing_c=yaw)


def gps_status(satellites: int) -> GpsStatus:
    """Return GPS_STATUS without single satellites: ROS has no standard message for them."""
    none = (0,) * GPS_STATUS_SATELLITES
    return _encode(GpsStatus, {
        'satellite_prn': none, 'satellite_used': none, 'satellite_elevation': none,
        'satellite_azimuth': none, 'satellite_snr': none}, satellites_visible=satellites)


def image_position(feedback: CameraFeedback, geoid_separation: float) -> Position | None:
    """
    Return the position of an image; None if the camera had none.

    :param geoid_separation: height of mean sea level above the ellipsoid, m.
    """
    position = Position(
        0, feedback.lat / 1e7, feedback.lng / 1e7, feedback.alt_msl + geoid_separation)
    if is_no_place(position) or not all(field.includes(value) for field, value in (
            (_LATITUDE, position.latitude), (_LONGITUDE, position.longitude),
            (_ALTITUDE, feedback.alt_msl))):
        return None
    return position


def image_attitude(feedback: CameraFeedback, frame: MountFrame) -> Quaternion | None:
    """Return the orientation of the camera's frame in ENU; None if the angles cannot be right."""
    angles = feedback.roll, feedback.pitch, feedback.yaw
    # A comparison with NaN is false.
    if not all(abs(angle) <= 360.0 for angle in angles):
        return None
    camera = enu_flu(Quaternion.from_euler(*map(math.radians, angles)) * _ZERO_POSE)
    return camera * _FROM_OPTICAL if frame is MountFrame.OPTICAL else camera
