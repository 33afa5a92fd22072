# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
A straightforward feeder of the camera: rclpy subscribers that pack with pymavlink.

It checks nothing, and has neither a heartbeat nor a service. Its argument is the serial device.
"""

from __future__ import annotations

import contextlib
import math
import os
import sys
from typing import Any, cast

from pymavlink.dialects.v10 import ardupilotmega
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Imu, NavSatFix

# Any: pymavlink has no types.
MAVLINK_1 = cast(Any, ardupilotmega)


class Feeder(Node):
    """Packs and writes in the callbacks."""

    def __init__(self, device: str) -> None:
        super().__init__('straightforward_feeder')
        self._fd = os.open(device, os.O_WRONLY | os.O_NOCTTY)
        self._mav = MAVLINK_1.MAVLink(None, srcSystem=1, srcComponent=191)
        self.create_subscription(NavSatFix, '/fix', self.take_fix, qos_profile_sensor_data)
        self.create_subscription(Imu, '/imu', self.take_imu, qos_profile_sensor_data)

    def _write(self, message: Any) -> None:
        os.write(self._fd, message.pack(self._mav))

    def take_fix(self, fix: NavSatFix) -> None:
        """Send GPS_RAW_INT."""
        stamp = fix.header.stamp
        self._write(MAVLINK_1.MAVLink_gps_raw_int_message(
            stamp.sec * 1_000_000 + stamp.nanosec // 1000, 3, round(fix.latitude * 1e7),
            round(fix.longitude * 1e7), round(fix.altitude * 1e3), 65535, 65535, 65535, 65535,
            255))

    def take_imu(self, imu: Imu) -> None:
        """Send ATTITUDE and MOUNT_STATUS."""
        q, rates = imu.orientation, imu.angular_velocity
        roll = math.atan2(2 * (q.w * q.x + q.y * q.z), 1 - 2 * (q.x * q.x + q.y * q.y))
        pitch = -math.asin(max(-1.0, min(1.0, 2 * (q.w * q.y - q.z * q.x))))
        yaw = math.pi / 2 - math.atan2(
            2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))
        self._write(MAVLINK_1.MAVLink_attitude_message(
            0, roll, pitch, yaw, rates.x, -rates.y, -rates.z))
        self._write(MAVLINK_1.MAVLink_mount_status_message(0, 100, 0, 0, 0))


rclpy.init()
node = Feeder(sys.argv[1])
print('ready', flush=True)
with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
    rclpy.spin(node)
