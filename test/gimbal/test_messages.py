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

"""Numbers of the gimbal protocol, compared with those of pymavlink."""

from __future__ import annotations

from enum import IntEnum

from illuminator_ros.gimbal import messages
from illuminator_ros.payload.mount_attitude import MountFlags
from pymavlink.dialects.v20 import common
import pytest

NUMBERS = vars(common)


@pytest.mark.parametrize(('enum', 'prefix'), [
    (MountFlags, 'GIMBAL_DEVICE_FLAGS'), (MountFlags, 'GIMBAL_MANAGER_FLAGS'),
    (messages.Capabilities, 'GIMBAL_DEVICE_CAP_FLAGS'),
    (messages.Capabilities, 'GIMBAL_MANAGER_CAP_FLAGS'),
    (messages.ErrorFlags, 'GIMBAL_DEVICE_ERROR_FLAGS')])
def test_flags_are_all_those_of_pymavlink(enum: type[IntEnum], prefix: str) -> None:
    assert {f'{prefix}_{entry.name}': entry.value for entry in enum} == {
        name: value for name, value in NUMBERS.items()
        if name.startswith(f'{prefix}_') and not name.endswith('_ENUM_END')}


def test_commands_and_ids_are_those_of_pymavlink() -> None:
    assert {f'MAV_CMD_{entry.name}': NUMBERS[f'MAV_CMD_{entry.name}']
            for entry in messages.GimbalCommand} == {
        f'MAV_CMD_{entry.name}': entry.value for entry in messages.GimbalCommand}
    for name in ('MAV_TYPE_GIMBAL', 'MAV_COMP_ID_GIMBAL'):
        assert getattr(messages, name) == NUMBERS[name]
