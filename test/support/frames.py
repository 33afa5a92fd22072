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

"""Frames for tests, right ones and wrong ones."""

from __future__ import annotations

from typing import Any

from fastcrc.crc16 import mcrf4xx
from illuminator_ros.mavlink.frame import Decoder, encode_frame, Frame
from illuminator_ros.mavlink.messages import Address, encode_payload, LAYOUTS
from support.messages import STATUS

LIGHT = Address(1, 243)
AUTOPILOT = Address(7, 1)
# Never the beginning of a frame, and long enough to end the wait for the rest of any.
FILLER = bytes(300)


def frame_of(message: Any = STATUS, sequence: int = 0, source: Address = LIGHT, *,
             signed: bool = False) -> bytes:
    """Return a frame of ours, without the signature that a signed one still needs."""
    return encode_frame(
        message.id, encode_payload(message), sequence=sequence, source=source,
        crc_extra=LAYOUTS[message.id].crc_extra, signed=signed)


def raw_v2(message_id: int, payload: bytes, *, crc_extra: int | None = None, incompat: int = 0,
           compat: int = 0, sequence: int = 0, source: Address = LIGHT) -> bytes:
    """Return a MAVLink 2 frame as it is not written by us: any flags, any length, any seed."""
    if crc_extra is None:
        crc_extra = LAYOUTS[message_id].crc_extra
    header = bytes((len(payload), incompat, compat, sequence, *source))
    body = header + message_id.to_bytes(3, 'little') + payload
    return b'\xfd' + body + mcrf4xx(body + bytes((crc_extra,))).to_bytes(2, 'little')


def foreign_frame(sequence: int = 0, source: Address = AUTOPILOT) -> bytes:
    """Return a frame with a message that is nothing to us: ATTITUDE."""
    return raw_v2(30, bytes(range(1, 29)), sequence=sequence & 0xFF, source=source)


def raw_v1(message_id: int, payload: bytes, *, crc_extra: int | None = None, sequence: int = 0,
           source: Address = LIGHT) -> bytes:
    """Return a MAVLink 1 frame of any length."""
    if crc_extra is None:
        crc_extra = LAYOUTS[message_id].crc_extra
    body = bytes((len(payload), sequence, *source, message_id)) + payload
    return b'\xfe' + body + mcrf4xx(body + bytes((crc_extra,))).to_bytes(2, 'little')


def spoilt(frame: bytes, at: int = -1) -> bytes:
    """Return a frame with one bit wrong, in the checksum or elsewhere."""
    changed = bytearray(frame)
    changed[at] ^= 0x40
    return bytes(changed)


def only(data: bytes) -> Frame:
    """Return the one frame that the data holds."""
    (frame,) = Decoder().feed(data)
    return frame


def decoded(data: bytes) -> list[Frame]:
    """Return the frames that a stream holds which ends with the data."""
    return Decoder().feed(data + FILLER)
