# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Our own frames that return are distinguished from frames of another sender with our address."""

from __future__ import annotations

from typing import Any

from illuminator_ros.mavlink import frame_writer
from illuminator_ros.mavlink.frame import Frame
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.mavlink.signing import Signing, SigningMode
import pytest
from support.frames import LIGHT, only
from support.messages import STATUS

OURS = Address(1, 193)
FRAME = Frame(2, 7, OURS, 0, b'\x01\x02')


@pytest.mark.parametrize(('changes', 'after', 'is_ours'), [
    ({}, 0.0, True), ({}, frame_writer.MEMORY, True), ({'payload': b'\x01\x02\0\0'}, 0.1, True),
    ({'sequence': 8}, 0.1, False), ({'payload': b'\x01\x03'}, 0.1, False),
    ({'message_id': 76}, 0.1, False), ({'source': Address(1, 195)}, 0.1, False),
    ({}, frame_writer.MEMORY + 0.1, False)])
def test_unsigned_frame_is_ours_if_it_equals_one_sent_within_a_second(
        changes: dict[str, Any], after: float, is_ours: bool) -> None:
    loopback = frame_writer.LoopbackFilter()
    loopback.sent(OURS, 7, 0, b'\x01\x02\0\0', 100.0)
    assert [loopback.has(FRAME._replace(**changes), 100.0 + after) for _ in range(2)] == [
        is_ours, is_ours]
    for number in range(frame_writer.MAX_FRAMES):
        loopback.sent(OURS, number, 76, b'\x01', 100.0)
    assert not loopback.has(FRAME, 100.0)


def test_signed_frame_that_returns_late_is_ours_until_many_have_followed() -> None:
    writer = frame_writer.FrameWriter(Signing(SigningMode.REQUIRE, bytes(range(32))))
    first, *others = [only(writer.frame(LIGHT, STATUS, 0.0, 1.7e9))
                      for _ in range(frame_writer.MAX_STAMPS)]
    assert writer.is_loopback(first, 3600.0)
    writer.frame(LIGHT, STATUS, 0.0, 1.7e9)
    assert [writer.is_loopback(frame, 3600.0) for frame in (first, others[0])] == [False, True]
