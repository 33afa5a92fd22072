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

"""A winch in the monitor: its released line, and a key to release more."""

from __future__ import annotations

import math

from illuminator_ros.ros.monitor_view import Device, Key, measured, Request, Topic, View
from std_msgs.msg import Float32


def length(device: Device) -> str:
    """Return the released line."""
    return measured(device.values.get('line_length'), 'm')


def release(device: Device, typed: str) -> Request | str:
    """Release line, m, or wind it in if negative."""
    try:
        metres = float(typed)
    except ValueError:
        metres = math.nan
    return f'{typed!r} is not a length' if not math.isfinite(metres) else Request(
        f'release {metres:g} m', 'cmd/release', Float32, Float32(data=metres))


VIEW = View('winch', {'line_length': Topic(Float32)}, ('line_length',), lambda device: [
    length(device)], lambda device: [('line', [f'{length(device)} released'])], (
    Key(('p',), 'release line', release, 'length (m, negative winds in)'),))
