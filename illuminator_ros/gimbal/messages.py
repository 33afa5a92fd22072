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

"""
The gimbal protocol v2: messages, commands and flags.

https://mavlink.io/en/services/gimbal_v2.html
Its commands and messages have a gimbal device id: the component id of the device, or 1..6 for a
device that is not a component of its own, and 0 for all devices of a manager. Quaternions are
w, x, y, z. GIMBAL_DEVICE_ATTITUDE_STATUS is in ``payload/messages.py``, the flags of devices and
managers are in ``payload/mount_attitude.py``.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum, IntFlag

from ..mavlink import messages as mav

MAV_TYPE_GIMBAL = 26
MAV_COMP_ID_GIMBAL = 154
# Ids of devices that are not components of their own.
NON_MAVLINK_IDS = range(1, 7)
# The address in GIMBAL_MANAGER_STATUS where no component has control.
NO_COMPONENT = mav.Address(0, 0)
# Params of MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, for system id and component id alike.
NO_PLAYER, UNCHANGED, SENDER, REMOVE_SENDER = 0, -1, -2, -3
# MAV_FRAMEs with altitudes above mean sea level, and above the home position.
ABSOLUTE_FRAMES, RELATIVE_FRAMES = (0, 5), (3, 6)


class GimbalCommand(IntEnum):
    """The commands of MAV_CMD that a gimbal manager executes."""

    DO_SET_ROI_LOCATION = 195
    DO_SET_ROI_NONE = 197
    DO_GIMBAL_MANAGER_PITCHYAW = 1000
    DO_GIMBAL_MANAGER_CONFIGURE = 1001


# The index of the param that is the gimbal device id.
DEVICE_ID_PARAM: dict[int, int] = {
    GimbalCommand.DO_SET_ROI_LOCATION: 0, GimbalCommand.DO_SET_ROI_NONE: 0,
    GimbalCommand.DO_GIMBAL_MANAGER_PITCHYAW: 6, GimbalCommand.DO_GIMBAL_MANAGER_CONFIGURE: 6}


class Capabilities(IntFlag):
    """GIMBAL_DEVICE_CAP_FLAGS, and GIMBAL_MANAGER_CAP_FLAGS, which has the same values."""

    HAS_RETRACT = 1
    HAS_NEUTRAL = 2
    HAS_ROLL_AXIS = 4
    HAS_ROLL_FOLLOW = 8
    HAS_ROLL_LOCK = 16
    HAS_PITCH_AXIS = 32
    HAS_PITCH_FOLLOW = 64
    HAS_PITCH_LOCK = 128
    HAS_YAW_AXIS = 256
    HAS_YAW_FOLLOW = 512
    HAS_YAW_LOCK = 1024
    SUPPORTS_INFINITE_YAW = 2048
    SUPPORTS_YAW_IN_EARTH_FRAME = 4096
    HAS_RC_INPUTS = 8192
    CAN_POINT_LOCATION_LOCAL = 65536
    CAN_POINT_LOCATION_GLOBAL = 131072


class ErrorFlags(IntFlag):
    """GIMBAL_DEVICE_ERROR_FLAGS."""

    AT_ROLL_LIMIT = 1
    AT_PITCH_LIMIT = 2
    AT_YAW_LIMIT = 4
    ENCODER_ERROR = 8
    POWER_ERROR = 16
    MOTOR_ERROR = 32
    SOFTWARE_ERROR = 64
    COMMS_ERROR = 128
    CALIBRATION_RUNNING = 256
    NO_MANAGER = 512


def flag_names(flags: IntFlag) -> list[str]:
    """Return readable names of the flags that are set; unknown ones as one hexadecimal number."""
    known = [flag for flag in type(flags) if flag & flags]
    names = [str(flag.name).lower().replace('_', ' ') for flag in known]
    unknown = int(flags) & ~sum(known)
    return [*names, f'unknown flags 0x{unknown:x}'] if unknown else names


@mav.define(280, 'GIMBAL_MANAGER_INFORMATION')
@dataclass(slots=True)
class GimbalManagerInformation(mav.Message):
    """https://mavlink.io/en/messages/common.html#GIMBAL_MANAGER_INFORMATION."""

    time_boot_ms: mav.UInt32
    cap_flags: mav.UInt32
    gimbal_device_id: mav.UInt8
    roll_min: mav.Float
    roll_max: mav.Float
    pitch_min: mav.Float
    pitch_max: mav.Float
    yaw_min: mav.Float
    yaw_max: mav.Float


@mav.define(281, 'GIMBAL_MANAGER_STATUS')
@dataclass(slots=True)
class GimbalManagerStatus(mav.Message):
    """https://mavlink.io/en/messages/common.html#GIMBAL_MANAGER_STATUS."""

    time_boot_ms: mav.UInt32
    flags: mav.UInt32
    gimbal_device_id: mav.UInt8
    primary_control_sysid: mav.UInt8
    primary_control_compid: mav.UInt8
    secondary_control_sysid: mav.UInt8
    secondary_control_compid: mav.UInt8


@mav.define(282, 'GIMBAL_MANAGER_SET_ATTITUDE')
@dataclass(slots=True)
class GimbalManagerSetAttitude(mav.Message):
    """https://mavlink.io/en/messages/common.html#GIMBAL_MANAGER_SET_ATTITUDE."""

    target_system: mav.UInt8
    target_component: mav.UInt8
    flags: mav.UInt32
    gimbal_device_id: mav.UInt8
    q: mav.Float4
    angular_velocity_x: mav.Float
    angular_velocity_y: mav.Float
    angular_velocity_z: mav.Float


@mav.define(283, 'GIMBAL_DEVICE_INFORMATION', extensions=2)
@dataclass(slots=True)
class GimbalDeviceInformation(mav.Message):
    """https://mavlink.io/en/messages/common.html#GIMBAL_DEVICE_INFORMATION."""

    time_boot_ms: mav.UInt32
    vendor_name: mav.Char32
    model_name: mav.Char32
    custom_name: mav.Char32
    firmware_version: mav.UInt32
    hardware_version: mav.UInt32
    uid: mav.UInt64
    cap_flags: mav.UInt16
    custom_cap_flags: mav.UInt16
    roll_min: mav.Float
    roll_max: mav.Float
    pitch_min: mav.Float
    pitch_max: mav.Float
    yaw_min: mav.Float
    yaw_max: mav.Float
    gimbal_device_id: mav.UInt8 = 0
    cap_flags2: mav.UInt32 = 0


@mav.define(284, 'GIMBAL_DEVICE_SET_ATTITUDE')
@dataclass(slots=True)
class GimbalDeviceSetAttitude(mav.Message):
    """https://mavlink.io/en/messages/common.html#GIMBAL_DEVICE_SET_ATTITUDE."""

    target_system: mav.UInt8
    target_component: mav.UInt8
    flags: mav.UInt16
    q: mav.Float4
    angular_velocity_x: mav.Float
    angular_velocity_y: mav.Float
    angular_velocity_z: mav.Float


@mav.define(286, 'AUTOPILOT_STATE_FOR_GIMBAL_DEVICE', extensions=1)
@dataclass(slots=True)
class AutopilotStateForGimbalDevice(mav.Message):
    """https://mavlink.io/en/messages/common.html#AUTOPILOT_STATE_FOR_GIMBAL_DEVICE."""

    target_system: mav.UInt8
    target_component: mav.UInt8
    time_boot_us: mav.UInt64
    q: mav.Float4
    q_estimated_delay_us: mav.UInt32
    vx: mav.Float
    vy: mav.Float
    vz: mav.Float
    v_estimated_delay_us: mav.UInt32
    feed_forward_angular_velocity_z: mav.Float
    estimator_status: mav.UInt16
    landed_state: mav.UInt8
    angular_velocity_z: mav.Float = 0.0


@mav.define(287, 'GIMBAL_MANAGER_SET_PITCHYAW')
@dataclass(slots=True)
class GimbalManagerSetPitchyaw(mav.Message):
    """https://mavlink.io/en/messages/common.html#GIMBAL_MANAGER_SET_PITCHYAW."""

    target_system: mav.UInt8
    target_component: mav.UInt8
    flags: mav.UInt32
    gimbal_device_id: mav.UInt8
    pitch: mav.Float
    yaw: mav.Float
    pitch_rate: mav.Float
    yaw_rate: mav.Float


@mav.define(288, 'GIMBAL_MANAGER_SET_MANUAL_CONTROL')
@dataclass(slots=True)
class GimbalManagerSetManualControl(mav.Message):
    """https://mavlink.io/en/messages/common.html#GIMBAL_MANAGER_SET_MANUAL_CONTROL."""

    target_system: mav.UInt8
    target_component: mav.UInt8
    flags: mav.UInt32
    gimbal_device_id: mav.UInt8
    pitch: mav.Float
    yaw: mav.Float
    pitch_rate: mav.Float
    yaw_rate: mav.Float
