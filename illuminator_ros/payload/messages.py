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
"""Messages that describe the state of a vehicle or of a mount, for several payloads."""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import NamedTuple

from ..mavlink import messages as mav


class GeoPoint(NamedTuple):
    """
    A place.

    :param latitude: and longitude, deg.
    :param altitude: m above mean sea level.
    """

    latitude: float
    longitude: float
    altitude: float


@mav.define(2, 'SYSTEM_TIME')
@dataclass(slots=True)
class SystemTime(mav.Message):
    """https://mavlink.io/en/messages/common.html#SYSTEM_TIME."""

    time_unix_usec: mav.UInt64
    time_boot_ms: mav.UInt32


@mav.define(30, 'ATTITUDE')
@dataclass(slots=True)
class Attitude(mav.Message):
    """https://mavlink.io/en/messages/common.html#ATTITUDE."""

    time_boot_ms: mav.UInt32
    roll: mav.Float
    pitch: mav.Float
    yaw: mav.Float
    rollspeed: mav.Float
    pitchspeed: mav.Float
    yawspeed: mav.Float

    @property
    def is_finite(self) -> bool:
        """Return whether all angles are finite."""
        return all(map(math.isfinite, (self.roll, self.pitch, self.yaw)))


@mav.define(33, 'GLOBAL_POSITION_INT')
@dataclass(slots=True)
class GlobalPositionInt(mav.Message):
    """https://mavlink.io/en/messages/common.html#GLOBAL_POSITION_INT."""

    time_boot_ms: mav.UInt32
    lat: mav.Int32
    lon: mav.Int32
    alt: mav.Int32
    relative_alt: mav.Int32
    vx: mav.Int16
    vy: mav.Int16
    vz: mav.Int16
    hdg: mav.UInt16

    @property
    def place(self) -> GeoPoint:
        """Return the position."""
        return GeoPoint(self.lat / 1e7, self.lon / 1e7, self.alt / 1e3)


@mav.define(285, 'GIMBAL_DEVICE_ATTITUDE_STATUS', extensions=3)
@dataclass(slots=True)
class GimbalDeviceAttitudeStatus(mav.Message):
    """
    https://mavlink.io/en/messages/common.html#GIMBAL_DEVICE_ATTITUDE_STATUS.

    The definition has the quaternion as an array of w, x, y, z.
    """

    target_system: mav.UInt8
    target_component: mav.UInt8
    time_boot_ms: mav.UInt32
    flags: mav.UInt16
    q: mav.Float4
    angular_velocity_x: mav.Float
    angular_velocity_y: mav.Float
    angular_velocity_z: mav.Float
    failure_flags: mav.UInt32
    delta_yaw: mav.Float = 0.0
    delta_yaw_velocity: mav.Float = 0.0
    gimbal_device_id: mav.UInt8 = 0
