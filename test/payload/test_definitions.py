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
"""Messages and numbers of all payloads, compared with those of pymavlink."""

from __future__ import annotations

from dataclasses import astuple, fields
from enum import IntEnum
import random
from typing import Any

from illuminator_ros.gimbal import messages as gimbal
from illuminator_ros.illuminator import messages as light
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.payload import messages as vehicle
from illuminator_ros.payload.mount_attitude import MountFlags
from illuminator_ros.rededge import messages as rededge
from pymavlink.dialects.v10 import ardupilotmega as mavlink_1
from pymavlink.dialects.v20 import common
import pytest
from support.reference_dialect import reference

NUMBERS = vars(common)
CLASSES = [value for module in (mav, light, vehicle, gimbal, rededge)
           for value in vars(module).values()
           if isinstance(value, type) and issubclass(value, mav.Message)
           and value is not mav.Message and value.__module__ == module.__name__]


@pytest.mark.parametrize('cls', CLASSES, ids=lambda one: one.name)
def test_a_random_payload_has_the_values_that_pymavlink_reads(cls: type[mav.Message]) -> None:
    # The camera gets MAVLink 1, so its messages have no extension fields (RE-2), except the field
    # of CAMERA_FEEDBACK by which recorders count. Any: pymavlink has no types.
    camera: Any = mavlink_1
    of_camera = cls.__module__ == rededge.__name__ and cls is not rededge.CameraFeedback
    known = (camera if of_camera else reference()).mavlink_map[cls.id]
    assert (cls.name, cls.crc_extra, cls.full_size) == (
        known.msgname, known.crc_extra, known.unpacker.size)
    assert of_camera or mav.LAYOUTS[cls.id] == (known.crc_extra, known.unpacker.size)

    payload = random.Random(cls.id).randbytes(cls.full_size)
    message: Any = cls.decode(payload)

    assert [field.name for field in fields(message)] == known.fieldnames
    values = iter(known.unpacker.unpack(payload))
    wire = {}
    for name, length in zip(known.ordered_fieldnames, known.lengths, strict=True):
        wire[name] = tuple(next(values) for _ in range(length)) if length > 1 else next(values)
    assert repr(astuple(message)) == repr(tuple(wire[name] for name in known.fieldnames))
    assert message.encode() == payload


@pytest.mark.parametrize(('enum', 'prefix'), [
    (MountFlags, 'GIMBAL_DEVICE_FLAGS'), (MountFlags, 'GIMBAL_MANAGER_FLAGS'),
    (gimbal.Capabilities, 'GIMBAL_DEVICE_CAP_FLAGS'),
    (gimbal.Capabilities, 'GIMBAL_MANAGER_CAP_FLAGS'),
    (gimbal.ErrorFlags, 'GIMBAL_DEVICE_ERROR_FLAGS')])
def test_flags_are_all_those_of_pymavlink(enum: type[IntEnum], prefix: str) -> None:
    assert {f'{prefix}_{entry.name}': entry.value for entry in enum} == {
        name: value for name, value in NUMBERS.items()
        if name.startswith(f'{prefix}_') and not name.endswith('_ENUM_END')}


def test_commands_and_ids_are_those_of_pymavlink() -> None:
    assert {f'MAV_CMD_{entry.name}': NUMBERS[f'MAV_CMD_{entry.name}']
            for entry in gimbal.GimbalCommand} == {
        f'MAV_CMD_{entry.name}': entry.value for entry in gimbal.GimbalCommand}
    for name in ('MAV_TYPE_GIMBAL', 'MAV_COMP_ID_GIMBAL'):
        assert getattr(gimbal, name) == NUMBERS[name]


@pytest.mark.parametrize(('enum', 'prefix'), [
    (mav.MavCmd, 'MAV_CMD'), (mav.MavResult, 'MAV_RESULT'), (mav.MavType, 'MAV_TYPE')])
def test_numbers_are_those_of_pymavlink(enum: Any, prefix: str) -> None:
    missing = {entry.name for entry in enum if not hasattr(common, f'{prefix}_{entry.name}')}

    assert missing <= {'CANCELLED', 'COMMAND_UNSUPPORTED_MAV_FRAME', 'NOT_IN_CONTROL'}
    for entry in enum:
        assert getattr(common, f'{prefix}_{entry.name}', entry) == entry
    assert light.MAV_COMP_ID_ILLUMINATOR == common.MAV_COMP_ID_ILLUMINATOR
