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

from collections.abc import Callable
from enum import IntEnum

from rclpy.duration import Duration
from rclpy.time import Time

class JumpThreshold:
    def __init__(
        self, *, min_forward: Duration | None, min_backward: Duration | None,
        on_clock_change: bool = ...,
    ) -> None: ...

class TimeJump: ...
class JumpHandle: ...

class ClockType(IntEnum):
    ROS_TIME = ...
    SYSTEM_TIME = ...
    STEADY_TIME = ...

class Clock:
    # Makes a ROSClock for ROS_TIME.
    def __init__(self, *, clock_type: ClockType = ...) -> None: ...
    @property
    def clock_type(self) -> ClockType: ...
    def now(self) -> Time: ...
    def create_jump_callback(
        self, threshold: JumpThreshold, *, pre_callback: Callable[[], None] | None = ...,
        post_callback: Callable[[TimeJump], None] | None = ...,
    ) -> JumpHandle: ...

class ROSClock(Clock):
    @property
    def ros_time_is_active(self) -> bool: ...
