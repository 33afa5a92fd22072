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

"""The payloads that the executables know, by the name that ``--payload`` takes."""

from __future__ import annotations

from collections.abc import Mapping

from ..payload.payload_type import PayloadType

# The payload of the executables without ``--payload``, and of ``bridge``.
DEFAULT_PAYLOAD = 'illuminator'
PAYLOADS: Mapping[str, PayloadType] = {one.name: one for one in (
    PayloadType(
        'illuminator', ros='illuminator_ros.illuminator.ros.lights:ILLUMINATOR',
        simulated='illuminator_ros.illuminator.simulated:SIMULATED',
        checks='illuminator_ros.illuminator.checks.requirements:CHECKS',
        view='illuminator_ros.illuminator.ros.monitor_view:VIEW'),
    PayloadType('rededge', ros='illuminator_ros.rededge.ros.camera_node:REDEDGE',
                simulated='illuminator_ros.rededge.simulated:SIMULATED',
                checks='illuminator_ros.rededge.checks:CHECKS',
                view='illuminator_ros.rededge.ros.monitor_view:VIEW'),
    PayloadType(
        'gimbal', ros='illuminator_ros.gimbal.ros.gimbals:GIMBAL',
        simulated='illuminator_ros.gimbal.simulated_device:SIMULATED',
        checks='illuminator_ros.gimbal.checks.device:CHECKS',
        view='illuminator_ros.gimbal.ros.monitor_view:VIEW'),
    PayloadType(
        'gimbal_manager', ros='illuminator_ros.gimbal.ros.manager_node:GIMBAL_MANAGER',
        simulated='illuminator_ros.gimbal.simulated_manager:SIMULATED',
        checks='illuminator_ros.gimbal.checks.manager:CHECKS'),
)}
