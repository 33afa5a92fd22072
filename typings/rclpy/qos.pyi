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

from enum import IntEnum

from rclpy.duration import Duration

class HistoryPolicy(IntEnum):
    SYSTEM_DEFAULT = ...
    KEEP_LAST = ...
    KEEP_ALL = ...
    UNKNOWN = ...

class ReliabilityPolicy(IntEnum):
    SYSTEM_DEFAULT = ...
    RELIABLE = ...
    BEST_EFFORT = ...
    UNKNOWN = ...
    BEST_AVAILABLE = ...

class DurabilityPolicy(IntEnum):
    SYSTEM_DEFAULT = ...
    TRANSIENT_LOCAL = ...
    VOLATILE = ...
    UNKNOWN = ...
    BEST_AVAILABLE = ...

class QoSProfile:
    def __init__(
        self, *, depth: int = ..., history: HistoryPolicy = ...,
        reliability: ReliabilityPolicy = ..., durability: DurabilityPolicy = ...,
        lifespan: Duration = ..., deadline: Duration = ...,
    ) -> None: ...
    depth: int
    history: HistoryPolicy
    reliability: ReliabilityPolicy
    durability: DurabilityPolicy

qos_profile_parameters: QoSProfile
qos_profile_sensor_data: QoSProfile
qos_profile_services_default: QoSProfile
qos_profile_system_default: QoSProfile
