# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""In-memory channels."""

from __future__ import annotations

from support.open_channel import Open


def test_frames_reach_all_other_open_channels_of_the_name(channel: Open) -> None:
    one, gone, another = (channel('memory://one') for _ in range(3))
    other_name = channel('memory://other')
    gone.close()
    one.broadcast(b'frame')
    assert another.receive_bytes(5) == b'frame'
    assert (one.turn(), other_name.turn(), one.channel.dropped) == ([], [], 0)


def test_frames_beyond_what_is_read_are_dropped_and_counted(channel: Open) -> None:
    one, other = channel('memory://one'), channel('memory://one')
    while not one.channel.dropped:
        one.broadcast(bytes(280))
    assert len(other.turn()) > 1
