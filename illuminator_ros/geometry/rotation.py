# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Rotations as unit quaternions, and the frames of ROS and MAVLink.

ROS has ENU for the earth and FLU for bodies (REP-103), MAVLink has NED and FRD.

Of pymavlink 2.4.50, ``quaternion`` returns angles that are wrong by up to 180 degrees within 0.06
degrees of straight up and down, and ``rotmat`` a pitch of 180 degrees straight up and down.
"""

from __future__ import annotations

import math
from math import cos, sin
from typing import NamedTuple

Vector = tuple[float, float, float]

# Sine of the pitch beyond which rounding errors prevent the separation of roll and yaw.
_SINGULAR = 1.0 - 1e-12


class Quaternion(NamedTuple):
    """
    A rotation: :meth:`rotate` takes the coordinates of a vector from a body's frame to another.

    The field ``q`` of a message can hold it.

    All methods but :meth:`normalized` expect the norm 1.
    """

    w: float = 1.0
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0

    @staticmethod
    def from_euler(roll: float, pitch: float, yaw: float) -> Quaternion:
        """Return the rotation by yaw about z, then pitch about the new y, roll about x, rad."""
        cos_r, sin_r = cos(roll / 2), sin(roll / 2)
        cos_p, sin_p = cos(pitch / 2), sin(pitch / 2)
        cos_y, sin_y = cos(yaw / 2), sin(yaw / 2)
        return Quaternion(
            cos_r * cos_p * cos_y + sin_r * sin_p * sin_y,
            sin_r * cos_p * cos_y - cos_r * sin_p * sin_y,
            cos_r * sin_p * cos_y + sin_r * cos_p * sin_y,
            cos_r * cos_p * sin_y - sin_r * sin_p * cos_y)

    def euler(self) -> Vector:
        """
        Return roll, pitch and yaw of :meth:`from_euler`, rad: +-pi, +-pi/2, +-pi.

        At a pitch of +-pi/2 only the sum or the difference of roll and yaw is defined: roll is 0.
        """
        w, x, y, z = self
        sine = 2 * (w * y - z * x)
        if abs(sine) > _SINGULAR:
            return 0.0, math.copysign(math.pi / 2, sine), math.atan2(
                2 * (w * z - x * y), 1 - 2 * (x * x + z * z))
        # The cosine of the pitch is exact where the sine has lost its last digits.
        up, ahead = 1 - 2 * (y * y + z * z), 2 * (w * z + x * y)
        return (math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
                math.atan2(sine, math.hypot(up, ahead)), math.atan2(ahead, up))

    # Replaces the repetition of tuples.
    def __mul__(self, other: Quaternion) -> Quaternion:  # type: ignore[override]
        """Return the composition: first ``other``, then this rotation."""
        w, x, y, z = self
        a, b, c, d = other
        return Quaternion(w * a - x * b - y * c - z * d, w * b + x * a + y * d - z * c,
                          w * c - x * d + y * a + z * b, w * d + x * c - y * b + z * a)

    def inverse(self) -> Quaternion:
        """Return the inverse rotation."""
        return Quaternion(self.w, -self.x, -self.y, -self.z)

    def normalized(self) -> Quaternion:
        """
        Return the quaternion with norm 1.

        :raises ValueError: if a component is not finite, or the norm is too small to have a
            direction.
        """
        norm = math.hypot(*self)
        if not (math.isfinite(norm) and norm > 1e-6):
            raise ValueError(f'({self.x:g}, {self.y:g}, {self.z:g}, {self.w:g}) is not a rotation')
        return Quaternion(self.w / norm, self.x / norm, self.y / norm, self.z / norm)

    def rotate(self, vector: Vector) -> Vector:
        """Return the coordinates of a vector in the other frame."""
        turned = self * Quaternion(0.0, *vector) * self.inverse()
        return turned.x, turned.y, turned.z

    def angle_to(self, other: Quaternion) -> float:
        """Return the angle of the rotation between the two, rad, 0..pi."""
        turn = self.inverse() * other
        return 2 * math.atan2(math.hypot(turn.x, turn.y, turn.z), abs(turn.w))


# Between ENU and NED: half a turn about the axis between north and east. It is its own inverse.
_ENU_NED = Quaternion(0.0, math.sqrt(0.5), math.sqrt(0.5), 0.0)
# Between FLU and FRD: half a turn about x. It is its own inverse.
_FLU_FRD = Quaternion(0.0, 1.0, 0.0, 0.0)


def enu_ned(vector: Vector) -> Vector:
    """Return the NED coordinates of an ENU vector, and vice versa."""
    x, y, z = vector
    return y, x, -z


def flu_frd(vector: Vector) -> Vector:
    """Return the FRD coordinates of an FLU vector, and vice versa."""
    x, y, z = vector
    return x, -y, -z


def ned_frd(attitude: Quaternion) -> Quaternion:
    """Return the attitude of an FRD body in NED, given the attitude of its FLU body in ENU."""
    return _ENU_NED * attitude * _FLU_FRD


def enu_flu(attitude: Quaternion) -> Quaternion:
    """Return the attitude of an FLU body in ENU, given the attitude of its FRD body in NED."""
    # Both changes of axes are their own inverses.
    return ned_frd(attitude)


def flip(rotation: Quaternion) -> Quaternion:
    """Return the rotation between two FRD bodies, given the one between their FLU bodies."""
    return Quaternion(rotation.w, rotation.x, -rotation.y, -rotation.z)
