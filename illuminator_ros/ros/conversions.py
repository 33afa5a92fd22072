# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Rotations, vectors and altitudes in messages of ROS."""

from __future__ import annotations

from geometry_msgs.msg import Quaternion as QuaternionMessage
from geometry_msgs.msg import QuaternionStamped, Vector3
from sensor_msgs.msg import Imu
from std_msgs.msg import Header

from .parameters import ParameterSpec
from ..geometry.rotation import Quaternion, Vector

GEOID_SEPARATION = ParameterSpec(
    'geoid_separation', 0.0, 'height of mean sea level above the WGS84 ellipsoid, where the '
    'vehicle is', 'm', -150.0, 150.0)
# The covariance of an Imu message that has no such value begins with this (sensor_msgs/Imu).
NO_VALUE = -1.0


def read_quaternion(message: QuaternionMessage) -> Quaternion:
    """Return a quaternion of any norm."""
    return Quaternion(message.w, message.x, message.y, message.z)


def read_vector(message: Vector3) -> Vector:
    """Return a vector."""
    return message.x, message.y, message.z


def read_orientation(message: Imu) -> Quaternion | None:
    """Return the orientation of any norm, None if the message has none."""
    return (None if message.orientation_covariance[0] == NO_VALUE
            else read_quaternion(message.orientation))


def quaternion_message(header: Header, rotation: Quaternion) -> QuaternionStamped:
    """Return the message of a rotation."""
    return QuaternionStamped(header=header, quaternion=QuaternionMessage(
        x=rotation.x, y=rotation.y, z=rotation.z, w=rotation.w))
