# Copyright 2026 The illuminator_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Rotations, vectors and altitudes in messages of ROS."""

from __future__ import annotations

from geometry_msgs.msg import Quaternion as QuaternionMessage
from geometry_msgs.msg import QuaternionStamped, Vector3
from sensor_msgs.msg import Imu
from std_msgs.msg import Header

from .parameters import ParameterSpec
from ..payload.rotation import Quaternion, Vector

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
