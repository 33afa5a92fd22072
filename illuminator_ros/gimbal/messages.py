# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The gimbal protocol v2: messages, and numbers that the specification describes in words.

https://mavlink.io/en/services/gimbal_v2.html
Its commands and messages have a gimbal device id: the component id of the device, or 1..6 for a
device that is not a component of its own, and 0 for all devices of a manager. Quaternions are
w, x, y, z. GIMBAL_DEVICE_ATTITUDE_STATUS is in ``payload/messages.py``. The enums of managers have
the values of those of devices, which are used for both.
"""

from __future__ import annotations

from ..geometry.rotation import Vector
from ..mavlink.dialect import mavlink
from ..mavlink.messages import Address
from ..payload.messages import GimbalDeviceAttitudeStatus

GimbalManagerInformation = mavlink.MAVLink_gimbal_manager_information_message
GimbalManagerStatus = mavlink.MAVLink_gimbal_manager_status_message
GimbalManagerSetAttitude = mavlink.MAVLink_gimbal_manager_set_attitude_message
GimbalManagerSetPitchyaw = mavlink.MAVLink_gimbal_manager_set_pitchyaw_message
GimbalManagerSetManualControl = mavlink.MAVLink_gimbal_manager_set_manual_control_message
GimbalDeviceInformation = mavlink.MAVLink_gimbal_device_information_message
GimbalDeviceSetAttitude = mavlink.MAVLink_gimbal_device_set_attitude_message
AutopilotStateForGimbalDevice = mavlink.MAVLink_autopilot_state_for_gimbal_device_message

NON_MAVLINK_IDS = range(1, 7)
NO_COMPONENT = Address(0, 0)
NO_PLAYER, UNCHANGED, SENDER, REMOVE_SENDER = 0, -1, -2, -3
# m; some greater altitudes exceed the range of float32, their type in MAVLink.
ALTITUDE_LIMIT = 100e3
ABSOLUTE_FRAMES, RELATIVE_FRAMES = (0, 5), (3, 6)

# The commands that a gimbal manager executes, and which param has the gimbal device id.
DEVICE_ID_PARAM = {
    mavlink.MAV_CMD_DO_SET_ROI_LOCATION: 0, mavlink.MAV_CMD_DO_SET_ROI_NONE: 0,
    mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: 6, mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE: 6}


def rates_of(
    message: GimbalManagerSetAttitude | GimbalDeviceSetAttitude | GimbalDeviceAttitudeStatus,
) -> Vector:
    """Return the rates of roll, pitch and yaw in a message, rad/s."""
    return message.angular_velocity_x, message.angular_velocity_y, message.angular_velocity_z
