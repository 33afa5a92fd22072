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

"""Serialised messages as the nodes read them, compared with rclpy."""

from __future__ import annotations

from collections.abc import Iterable
import contextlib
import importlib
import operator
import re
import struct

from diagnostic_msgs.msg import DiagnosticArray
from hypothesis import given
from hypothesis import strategies as st
from illuminator_ros.ros.cdr import deserializer
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Bool

READ = [
    'geometry_msgs/QuaternionStamped', 'geometry_msgs/TwistStamped',
    'geometry_msgs/Vector3Stamped', 'nav_msgs/Odometry', 'sensor_msgs/Imu',
    'sensor_msgs/NavSatFix', 'sensor_msgs/TimeReference', 'std_msgs/Bool', 'std_msgs/Float32',
    'std_msgs/String', 'std_msgs/UInt32']
VALUES: dict[str, tuple[str, st.SearchStrategy[float]]] = {
    'boolean': ('?', st.booleans()), 'float': ('f', st.floats(width=32)),
    'double': ('d', st.floats()),
    'int8': ('b', st.integers(-2**7, 2**7 - 1)), 'uint8': ('B', st.integers(0, 2**8 - 1)),
    'uint16': ('H', st.integers(0, 2**16 - 1)), 'int32': ('i', st.integers(-2**31, 2**31 - 1)),
    'uint32': ('I', st.integers(0, 2**32 - 1))}
FIELD_TYPES = operator.methodcaller('get_fields_and_field_types')
TEXTS = st.text(st.characters(exclude_characters='\0', exclude_categories=['Cs']), max_size=9)


def message_class(name: str) -> type[object]:
    """Return the class of a type such as ``std_msgs/Bool``."""
    package, message = name.split('/')
    found = getattr(importlib.import_module(f'{package}.msg'), message)
    assert isinstance(found, type)
    return found


def drawn(data: st.DataObject, name: str, order: str, body: bytearray) -> None:
    """Append a drawn value of a type to the body of a message."""
    if array := re.fullmatch(r'(.+)\[(\d+)\]', name):
        for _ in range(int(array[2])):
            drawn(data, array[1], order, body)
    elif '/' in name:
        for field in FIELD_TYPES(message_class(name)).values():
            drawn(data, field, order, body)
    elif name == 'string':
        text = data.draw(TEXTS).encode() + b'\0'
        body += bytes(-len(body) % 4) + struct.pack(f'{order}I', len(text)) + text
    else:
        code, values = VALUES[name]
        value = struct.pack(order + code, data.draw(values))
        body += bytes(-len(body) % len(value)) + value


def text(type_name: str, value: object) -> str:
    """Return the values of a message of rclpy or of this package; NaN is equal to NaN."""
    if array := re.fullmatch(r'(.+)\[\d+\]', type_name):
        assert isinstance(value, Iterable)
        return str([text(array[1], one) for one in value])
    if '/' in type_name:
        types = FIELD_TYPES(message_class(type_name))
        return str({name: text(types[name], getattr(value, name)) for name in types})
    return repr(float(value) if isinstance(value, float) else value)


EACH = pytest.mark.parametrize('name', READ)


@EACH
@given(data=st.data(), big=st.booleans())
def test_message_of_either_byte_order_has_the_values_that_rclpy_reads(
        name: str, data: st.DataObject, big: bool) -> None:
    body, type_ = bytearray(), message_class(name)
    drawn(data, name, '>' if big else '<', body)
    serialized = bytes((0, not big, 0, 0)) + body

    assert text(name, deserializer(type_)(serialized)) == text(
        name, deserialize_message(serialized, type_))


@EACH
@given(st.data())
def test_message_that_is_cut_or_changed_is_read_or_a_value_error(
        name: str, data: st.DataObject) -> None:
    type_ = message_class(name)
    read = deserializer(type_)
    serialized = bytearray(serialize_message(type_()))
    assert text(name, read(bytes(serialized))) == text(name, type_())

    # rclpy pads to 4 bytes.
    cut = serialized[:data.draw(st.integers(0, len(serialized) - 4))]
    with pytest.raises(ValueError, match=f'{len(cut)} bytes that are not a serialised message'):
        read(bytes(cut))
    for place in data.draw(st.lists(st.integers(0, len(serialized) - 1), max_size=5)):
        serialized[place] = data.draw(st.integers(0, 255))
    with contextlib.suppress(ValueError):
        read(bytes(serialized))


@pytest.mark.parametrize('header', [b'\0\3\0\0', b'\0\7\0\0', b'\1\0\0\0'])
def test_message_in_another_encapsulation_is_a_value_error(header: bytes) -> None:
    with pytest.raises(ValueError, match='5 bytes that are not a serialised message'):
        deserializer(Bool)(header + b'\1')


def test_message_with_a_sequence_has_no_reader() -> None:
    with pytest.raises(TypeError, match='sequence<diagnostic_msgs/DiagnosticStatus>'):
        deserializer(DiagnosticArray)
