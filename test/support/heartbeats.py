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

"""Heartbeats as bytes."""

from __future__ import annotations

from illuminator_ros.mavlink.frame import Decoder
from illuminator_ros.mavlink.messages import Address, heartbeat, MavType
from support.frames import frame_of, LIGHT


def heartbeat_frame(
    source: Address = LIGHT, sequence: int = 0, mav_type: int = MavType.ILLUMINATOR,
) -> bytes:
    """Return the heartbeat of a light, or of something else."""
    return frame_of(heartbeat(mav_type), sequence, source)


def numbered_frames(count: int, source: Address = LIGHT) -> list[bytes]:
    """Return heartbeats that can be told apart: each carries its number as its custom_mode."""
    frames = []
    for number in range(count):
        message = heartbeat(MavType.ILLUMINATOR)
        message.custom_mode = number
        frames.append(frame_of(message, number & 0xFF, source))
    return frames


def numbers_in(data: bytes) -> tuple[list[int], Decoder]:
    """Return the numbers of the numbered frames in a stream, and the decoder that read it."""
    decoder = Decoder()
    return [int.from_bytes(frame.payload[:4], 'little') for frame in decoder.feed(data)], decoder
