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

"""From what a light reports to messages; pure functions."""

from __future__ import annotations

from typing import Any

from sensor_msgs.msg import Temperature
from std_msgs.msg import Bool, Float32, Float64, String, UInt32

from ..illuminator.model import Status

# The topics that follow from every status: name and type.
STATUS_TOPICS: dict[str, Any] = {
    'enabled': Bool,
    'brightness': Float32,
    'mode': String,
    'strobe_period': Float32,
    'strobe_duty_cycle': Float32,
    'error_flags': UInt32,
    'uptime': Float64,
}


def status_values(status: Status) -> dict[str, Any]:
    """Return what goes on each topic; nothing for what is not believable in the status."""
    values = {
        'enabled': status.enabled,
        'brightness': status.brightness,
        'mode': status.mode.label,
        'strobe_period': status.strobe_period,
        'strobe_duty_cycle': status.strobe_duty_cycle,
        'error_flags': status.error_flags,
        'uptime': status.uptime_ms / 1000.0,
    }
    return {name: value for name, value in values.items() if value is not None}


def temperature_message(temperature: float, stamp: Any, frame_id: str) -> Temperature:
    """Return a temperature, degC, of unknown variance."""
    message = Temperature(temperature=temperature)
    message.header.stamp = stamp
    message.header.frame_id = frame_id
    return message
