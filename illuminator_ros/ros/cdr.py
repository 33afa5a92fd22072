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

"""Serialised messages (CDR, little endian): publishing bytes takes half the time."""

from __future__ import annotations

from collections.abc import Callable
import struct

from std_msgs.msg import Bool, Float32, Float64, String, UInt32

_HEADER = b'\0\1\0\0'


def serializer(type_: type) -> Callable[[object], object]:
    """
    Return what a publisher publishes for a value of ``data``.

    :param type_: a message class; messages of unknown classes are not serialised.
    """
    pack = _PACK.get(type_)
    if pack is not None:
        return lambda value: pack(_HEADER, value)
    return _string if type_ is String else lambda message: message


def _string(value: object) -> bytes:
    text = str(value).encode()
    return _HEADER + struct.pack(f'<I{len(text) + 1}s', len(text) + 1, text)


def temperature(celsius: float, nanoseconds: int, frame_id: str) -> bytes:
    """
    Return a sensor_msgs/Temperature of unknown variance.

    :param nanoseconds: of the stamp, ROS time.
    """
    name = frame_id.encode() + b'\0'
    seconds, rest = divmod(nanoseconds, 1_000_000_000)
    head = struct.pack(f'<iII{len(name)}s', seconds, rest, len(name), name)
    return _HEADER + head + bytes(-len(head) % 8) + struct.pack('<dd', celsius, 0.0)


_PACK: dict[type, Callable[..., bytes]] = {
    Bool: struct.Struct('<4s?3x').pack, Float32: struct.Struct('<4sf').pack,
    UInt32: struct.Struct('<4sI').pack, Float64: struct.Struct('<4sd').pack}
