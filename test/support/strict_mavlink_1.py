# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
A MAVLink 1 parser that accepts nothing else, and only the defined lengths.

pymavlink cannot see extension bytes in MAVLink 1 frames, which strict receivers drop.
"""

from __future__ import annotations

from typing import NamedTuple

from fastcrc.crc16 import mcrf4xx

# Payload length and CRC_EXTRA by message id, from MAVLink 1's definitions.
STRICT = {0: (9, 50), 2: (12, 137), 4: (14, 237), 24: (30, 24), 25: (101, 23), 30: (28, 39),
          33: (28, 104), 75: (35, 158), 76: (33, 152), 77: (3, 143), 155: (13, 22), 158: (14, 134),
          179: (29, 189), 180: (45, 52)}
OVERHEAD = 8


class StrictFrame(NamedTuple):
    """A frame: sequence number, address of the sender, message id, payload."""

    sequence: int
    system: int
    component: int
    message_id: int
    payload: bytes


def strict_frames(data: bytes) -> tuple[list[StrictFrame], bytes]:
    """Return the whole frames and the beginning of one more; an error for anything else."""
    found = []
    while len(data) >= OVERHEAD:
        stx, length, sequence, system, component, message_id = data[:6]
        assert (stx, length) == (0xFE, STRICT[message_id][0])
        if len(data) < length + OVERHEAD:
            break
        body, checksum = data[1:6 + length], data[6 + length:8 + length]
        assert mcrf4xx(body + bytes((STRICT[message_id][1],))) == int.from_bytes(
            checksum, 'little')
        found.append(StrictFrame(sequence, system, component, message_id, data[6:6 + length]))
        data = data[length + OVERHEAD:]
    return found, data


def parse_strictly(data: bytes) -> list[tuple[int, bytes]]:
    """Return id and payload of whole frames; an error for anything else."""
    frames, rest = strict_frames(data)
    assert not rest
    return [(frame.message_id, frame.payload) for frame in frames]
