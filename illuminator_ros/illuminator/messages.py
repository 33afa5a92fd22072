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

"""The message of illuminators, and their usual component id."""

from __future__ import annotations

from dataclasses import dataclass

from ..mavlink.messages import define, Float, Message, UInt8, UInt32  # noqa: I101

MAV_COMP_ID_ILLUMINATOR = 243


@define(440, 'ILLUMINATOR_STATUS', extensions=3)
@dataclass(slots=True)
class IlluminatorStatus(Message):
    """
    https://mavlink.io/en/messages/common.html#ILLUMINATOR_STATUS.

    The last three fields are extensions of a vendor, 0 where a light does not have them.

    :ivar zoom_level: %.
    :ivar color_mode: 0 white, 1 red, 2 blue, 255 not applicable.
    :ivar gimbal_device_id: of the gimbal that the light is on, 0 for none.
    """

    uptime_ms: UInt32
    enable: UInt8
    mode_bitmask: UInt8
    error_status: UInt32
    mode: UInt8
    brightness: Float
    strobe_period: Float
    strobe_duty_cycle: Float
    temp_c: Float
    min_strobe_period: Float
    max_strobe_period: Float
    zoom_level: UInt8 = 0
    color_mode: UInt8 = 0
    gimbal_device_id: UInt8 = 0


STATUS_ID = IlluminatorStatus.id
