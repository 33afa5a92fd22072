# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Attitudes, rates and places of gimbals in messages of ROS."""

from __future__ import annotations

from dataclasses import dataclass
import math

from geometry_msgs.msg import QuaternionStamped, Vector3, Vector3Stamped
from sensor_msgs.msg import NavSatFix, NavSatStatus
from std_msgs.msg import Header

from ..axes import RATE_LIMIT
from ..messages import ALTITUDE_LIMIT
from ...geometry.mount_attitude import AXES, YawFrame
from ...geometry.rotation import Quaternion, Vector
from ...payload.messages import GeoPoint
from ...ros.conversions import read_quaternion, read_vector
from ...ros.parameters import ParameterError, ParameterSpec, Values

FRAME_PARAMETERS = (
    ParameterSpec('earth_frame', 'map', 'frame_id of attitudes with a yaw relative to the earth'),
    ParameterSpec('vehicle_frame', 'base_link_stabilized',
                  'frame_id of attitudes with a yaw relative to the vehicle'),
)
# rad; the limits of roll, pitch and yaw, which are those of a quaternion, and the tolerance for
# rounded angles.
ANGLE_LIMITS = (math.pi, math.pi / 2, math.pi)
ANGLE_TOLERANCE = 0.001


@dataclass(frozen=True)
class Frames:
    """The names of the two yaw frames."""

    earth: str
    vehicle: str

    @classmethod
    def of(cls, values: Values) -> Frames:
        """
        Return the names that parameters give.

        :raises ParameterError: if they are equal or empty.
        """
        frames = cls(values['earth_frame'], values['vehicle_frame'])
        if frames.earth == frames.vehicle or not (frames.earth and frames.vehicle):
            raise ParameterError('earth_frame and vehicle_frame must be two different names')
        return frames

    def name(self, frame: YawFrame) -> str:
        """Return the ``frame_id`` of a yaw frame."""
        return self.earth if frame is YawFrame.EARTH else self.vehicle

    def frame(self, header: Header) -> YawFrame:
        """
        Return the yaw frame that a header names.

        :raises ValueError: if it names neither.
        """
        for frame in YawFrame:
            if header.frame_id == self.name(frame):
                return frame
        raise ValueError(
            f'frame_id {header.frame_id!r} is neither {self.earth!r} nor {self.vehicle!r}')

    def read_attitude(self, message: QuaternionStamped) -> tuple[Quaternion, YawFrame]:
        """
        Return a rotation with norm 1 and its frame.

        :raises ValueError: if the message has no known frame, or is not a rotation.
        """
        return read_quaternion(message.quaternion).normalized(), self.frame(message.header)

    def read_angles(self, message: Vector3Stamped) -> tuple[Vector, YawFrame]:
        """
        Return roll, pitch and yaw, rad or NaN, and their frame.

        :raises ValueError: if the message has no known frame, or an angle is beyond
            :data:`ANGLE_LIMITS`.
        """
        angles = read_vector(message.vector)
        for axis, angle, limit in zip(AXES, angles, ANGLE_LIMITS, strict=True):
            if abs(angle) > limit + ANGLE_TOLERANCE:
                raise ValueError(f'{axis} {angle:g} rad is beyond {limit:.4f} rad')
        return angles, self.frame(message.header)


def read_rates(message: Vector3Stamped) -> Vector:
    """
    Return rates of roll, pitch and yaw, rad/s; the frame is not read.

    :raises ValueError: if one is NaN or beyond :data:`~..axes.RATE_LIMIT`.
    """
    rates = read_vector(message.vector)
    for axis, rate in zip(AXES, rates, strict=True):
        if not abs(rate) <= RATE_LIMIT:
            raise ValueError(f'{axis} rate {rate:g} rad/s is not within {RATE_LIMIT:.4f} rad/s')
    return rates


def read_place(message: NavSatFix, geoid_separation: float) -> GeoPoint:
    """
    Return the place that a message has.

    :param geoid_separation: m; the altitude of a NavSatFix is above the ellipsoid.
    :raises ValueError: if the message does not have a place.
    """
    place = message.latitude, message.longitude, message.altitude
    if not (abs(place[0]) <= 90.0 and abs(place[1]) <= 180.0
            and abs(place[2]) <= ALTITUDE_LIMIT):
        raise ValueError('latitude {:g}, longitude {:g}, altitude {:g} is not a place'.format(
            *place))
    return GeoPoint(place[0], place[1], place[2] - geoid_separation)


def read_fix(message: NavSatFix, geoid_separation: float) -> GeoPoint:
    """
    Return the position that a message has.

    :raises ValueError: if it has no fix; see :func:`read_place` for the rest.
    """
    if message.status.status < NavSatStatus.STATUS_FIX:
        raise ValueError(f'no fix (status {message.status.status})')
    return read_place(message, geoid_separation)


def vector_message(header: Header, vector: Vector) -> Vector3Stamped:
    """Return the message of angles or rates."""
    x, y, z = vector
    return Vector3Stamped(header=header, vector=Vector3(x=x, y=y, z=z))
