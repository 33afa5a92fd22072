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
"""The messages of the payloads, compared with those of pymavlink's dialect."""

from __future__ import annotations

from dataclasses import astuple, fields
import random
from types import ModuleType
from typing import Any, cast

from illuminator_ros.gimbal import messages as gimbal
from illuminator_ros.mavlink.messages import decode_payload, encode_payload, Message
from illuminator_ros.payload import messages as vehicle
from illuminator_ros.rededge import messages as rededge
from pymavlink.dialects.v10 import ardupilotmega as mavlink_1
from pymavlink.dialects.v20 import ardupilotmega as mavlink_2
import pytest

# The camera gets MAVLink 1, so its messages have no extension fields (RE-2), except the field
# of CAMERA_FEEDBACK by which recorders count.
MODULES: dict[ModuleType, ModuleType] = {
    vehicle: mavlink_2, gimbal: mavlink_2, rededge: mavlink_1}
CLASSES: list[tuple[type[Message], ModuleType]] = [
    (value, mavlink_2 if value is rededge.CameraFeedback else dialect)
    for module, dialect in MODULES.items() for value in vars(module).values()
    if isinstance(value, type) and issubclass(value, Message) and value is not Message
    and value.__module__ == module.__name__]


@pytest.mark.parametrize(('cls', 'dialect'), CLASSES, ids=lambda one: getattr(one, 'name', ''))
def test_a_random_payload_has_the_values_that_pymavlink_reads(
        cls: type[Message], dialect: ModuleType) -> None:
    # Any: pymavlink has no types.
    known = cast(Any, dialect).mavlink_map[cls.id]
    assert (cls.name, cls.crc_extra, cls.codec.size) == (
        known.msgname, known.crc_extra, known.unpacker.size)

    payload = random.Random(cls.id).randbytes(cls.codec.size)
    message: Any = decode_payload(cls, payload)

    assert [field.name for field in fields(message)] == known.fieldnames
    values = iter(known.unpacker.unpack(payload))
    wire = {}
    for name, length in zip(known.ordered_fieldnames, known.lengths, strict=True):
        wire[name] = tuple(next(values) for _ in range(length)) if length > 1 else next(values)
    assert repr(astuple(message)) == repr(tuple(wire[name] for name in known.fieldnames))
    assert encode_payload(message) == payload
