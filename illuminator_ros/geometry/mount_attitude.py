# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The attitude of a stabilised mount, in the conventions of ROS and MAVLink.

A stabilised mount keeps roll and pitch relative to the horizon. Its yaw is relative to the earth
or to the vehicle's heading, so that neither frame is the vehicle's body frame. ROS has ENU and FLU
(REP 103): pitch down and yaw left are positive, and a yaw of 0 is east or ahead. MAVLink has NED
and FRD: pitch up and yaw right are positive, and a yaw of 0 is north or ahead.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
import math

from .rotation import enu_flu, flip, flu_frd, ned_frd, Quaternion, Vector
from ..mavlink.dialect import mavlink
from ..payload.messages import GimbalDeviceAttitudeStatus, is_angle, is_rate

# w, x, y, z of a message.
Wxyz = tuple[float, float, float, float]
# Fields of a setpoint that the receiver must ignore. NaN is their only value for that ("set to NaN
# according to use case", GIMBAL_MANAGER_SET_ATTITUDE and GIMBAL_DEVICE_SET_ATTITUDE).
UNSET_QUATERNION: Wxyz = (math.nan,) * 4
UNSET_VECTOR: Vector = (math.nan,) * 3
# The order of angles and rates, and rates of a mount that does not turn.
AXES = ('roll', 'pitch', 'yaw')
STILL: Vector = (0.0,) * 3


class YawFrame(Enum):
    """The direction that a yaw is relative to; roll and pitch are relative to the horizon."""

    EARTH = 'earth'
    VEHICLE = 'vehicle'

    @property
    def flag(self) -> int:
        """Return the flag of messages that name the frame."""
        return _EARTH_BIT if self is YawFrame.EARTH else _VEHICLE_BIT


_EARTH_BIT = mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME
_VEHICLE_BIT = mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
_LOCK_BIT = mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK


def names_frame(flags: int) -> bool:
    """Return whether flags name a yaw frame; those of old implementations do not."""
    return bool(flags & (_EARTH_BIT | _VEHICLE_BIT))


def yaw_frame(flags: int) -> YawFrame:
    """
    Return the yaw frame of a message with quaternion and flags.

    Without a flag of a frame the frame follows from YAW_LOCK (GIMBAL_DEVICE_ATTITUDE_STATUS).

    :raises ValueError: if the flags name both frames.
    """
    earth, vehicle = flags & _EARTH_BIT, flags & _VEHICLE_BIT
    if earth and vehicle:
        raise ValueError('the flags name both yaw frames')
    if not vehicle and (earth or flags & _LOCK_BIT):
        return YawFrame.EARTH
    return YawFrame.VEHICLE


def rotation_of(q: Sequence[float]) -> Quaternion:
    """
    Return the rotation of a quaternion that a device reports.

    :raises ValueError: if it is far from the norm 1, NaN included.
    """
    if not 0.25 <= math.hypot(*q) <= 4.0:
        raise ValueError(f'({", ".join(f"{value:g}" for value in q)}) is not a rotation')
    return Quaternion(*q).normalized()


def heading_of(status: GimbalDeviceAttitudeStatus) -> float | None:
    """Return the heading of the vehicle, rad from north, None if the status has none."""
    # Implementations that name no frame are older than delta_yaw.
    return status.delta_yaw if names_frame(status.flags) and is_angle(status.delta_yaw) else None


def from_mavlink(q: Sequence[float], frame: YawFrame) -> Quaternion:
    """
    Return the rotation in ROS of a quaternion in MAVLink.

    :raises ValueError: if it is not a rotation, NaN included.
    """
    rotation = rotation_of(q)
    return enu_flu(rotation) if frame is YawFrame.EARTH else flip(rotation)


def to_mavlink(rotation: Quaternion, frame: YawFrame) -> Wxyz:
    """Return the quaternion in MAVLink of a rotation in ROS."""
    return ned_frd(rotation) if frame is YawFrame.EARTH else flip(rotation)


@dataclass(frozen=True, slots=True)
class MountAttitude:
    """
    The attitude of a mount.

    :param rotation: from the FLU axes of the mount to ENU, or to the level FLU axes that have the
        vehicle's heading.
    :param rates: of roll, pitch and yaw with the signs of FLU, rad/s; None where unknown.
    :param heading: of the vehicle, rad from north, clockwise; None where unknown.
    """

    rotation: Quaternion
    frame: YawFrame
    rates: Vector | None = None
    heading: float | None = None

    @classmethod
    def from_status(cls, status: GimbalDeviceAttitudeStatus) -> MountAttitude:
        """
        Read a status.

        :raises ValueError: if it has no attitude.
        """
        frame = yaw_frame(status.flags)
        rates = flu_frd((status.angular_velocity_x, status.angular_velocity_y,
                         status.angular_velocity_z))
        return cls(from_mavlink(status.q, frame), frame,
                   rates if all(map(is_rate, rates)) else None, heading_of(status))

    def seen_from(self, frame: YawFrame, heading: float | None = None) -> Quaternion | None:
        """
        Return the rotation with a yaw relative to a frame, None if the heading is unknown.

        :param heading: of the vehicle, used where the mount reports none.
        """
        if frame is self.frame:
            return self.rotation
        heading = heading if self.heading is None else self.heading
        if heading is None:
            return None
        ahead = Quaternion.from_euler(0.0, 0.0, math.pi / 2 - heading)
        return (ahead if frame is YawFrame.EARTH else ahead.inverse()) * self.rotation
