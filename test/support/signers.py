# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Signed frames for tests."""

from __future__ import annotations

from typing import Any

from illuminator_ros.mavlink.frame import Frame
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.mavlink.signing import EPOCH, signature, Signing, SigningMode
from support.frames import frame_of, LIGHT, only

KEY = bytes(range(32))
WRONG_KEY = bytes(range(1, 33))
# Unix time, s, of a day long after the epoch of signing, and its time stamp; and the last stamp.
NOW = EPOCH + 400_000_000.0
STAMP = 40_000_000_000_000
LAST_STAMP = 2 ** 48 - 1
SECOND = 100_000


def signed(stamp: int, *, key: bytes = KEY, link_id: int = 0, source: Address = LIGHT) -> Frame:
    """Return a frame signed with any key and time stamp."""
    data = frame_of(source=source, signed=True) + bytes([link_id]) + stamp.to_bytes(6, 'little')
    return only(data + signature(key, data))


def checker(mode: SigningMode = SigningMode.REQUIRE, *, timestamp: int = 0,
            link_id: int = 0) -> Signing:
    """Return a signing state with the key."""
    return Signing(mode, KEY, link_id, timestamp)


def signed_frame(stamp: int, **options: Any) -> bytes:
    """Return the bytes of a signed frame."""
    return signed(stamp, **options).data
