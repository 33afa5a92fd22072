# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
One message of each handled kind.

No field has its default, and each number is exact in float32.
"""

from illuminator_ros.illuminator.messages import IlluminatorStatus
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import decode

STATUS = IlluminatorStatus(
    uptime_ms=123456, enable=1, mode_bitmask=3, error_status=5, mode=2, brightness=62.5,
    strobe_period=0.25, strobe_duty_cycle=40.0, temp_c=71.5, min_strobe_period=0.0625,
    max_strobe_period=10.0, zoom_level=25, color_mode=1, gimbal_device_id=154)
INFORMATION = mav.ComponentInformationBasic(
    time_boot_ms=5000, capabilities=1 << 40, time_manufacture_s=1_600_000_000,
    vendor_name=b'Maker', model_name=b'Torch', software_version=b'1.2.3',
    hardware_version=b'B', serial_number=b'SN-7')
EVERY_MESSAGE = (
    mav.Heartbeat(44, 8, 1, 77, 4, 3),
    mav.CommandInt(1, 243, 2, 405, 1, 1, 1.0, 2.0, 3.0, 4.0, -5, 6, 7.0),
    mav.CommandLong(1, 243, 406, 2, 1.0, 50.0, 0.25, 40.0, 5.0, 6.0, 7.0),
    mav.CommandAck(405, 5, 30, -2, 1, 193),
    STATUS,
    INFORMATION,
)
# The classes of these messages, by message id.
HANDLED: dict[int, type[mav.Message]] = {message.id: type(message) for message in EVERY_MESSAGE}


def decode_payload(message_id: int, payload: bytes) -> mav.Message:
    """Return the message of a payload; its class is the one of :data:`HANDLED`."""
    return decode(HANDLED[message_id], payload)
