# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The receiver: it assembles the frames of each peer, and drops false beginnings in time."""

from __future__ import annotations

from collections.abc import Collection
import math

from illuminator_ros.mavlink.dialect import CRC_EXTRA
from illuminator_ros.mavlink.frame import Frame
from illuminator_ros.mavlink.frame_writer import FrameWriter
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.mavlink.receiver import MAX_DECODERS, Receiver, STALL
from illuminator_ros.mavlink.signing import Signing
import pytest
from support.frames import heartbeat_frame, LIGHT, raw_v1

UNIX = 1.7e9
FRAME = heartbeat_frame()
# The beginnings of frames of 250 bytes, MAVLink 1 and 2, that are never completed.
FALSE_STARTS = [b'\xfe\xfa\x00\x01\x01\x6e', b'\xfd\xfa\x00\x00\x00\x01\x01\x6e\x00\x00']


def make(signing: Signing, handled: Collection[int] = CRC_EXTRA) -> Receiver:
    return Receiver(signing, handled, FrameWriter(signing), lambda: UNIX, {})


@pytest.fixture
def receiver() -> Receiver:
    return make(Signing())


def sources(frames: list[Frame] | None) -> list[Address]:
    return [frame.source for frame in frames or ()]


def test_pieces_are_put_together_for_each_peer_and_counted_over_all(receiver: Receiver) -> None:
    frames = {peer: heartbeat_frame(Address(1, peer)) for peer in (1, 2)}
    for peer, frame in frames.items():
        assert receiver.feed(peer, frame[:9], 0.0) is None
    for peer, frame in frames.items():
        assert sources(receiver.feed(peer, frame[9:], 0.1)) == [Address(1, peer)]
    assert receiver.traffic.frames_received == 2


@pytest.mark.parametrize('noise', [*FALSE_STARTS, b''.join(FALSE_STARTS * 5)])
def test_good_frame_behind_false_starts_comes_after_the_stall_time_without_more_bytes(
        receiver: Receiver, noise: bytes) -> None:
    assert receiver.feed('a', noise + FRAME, 0.0) is None
    assert receiver.due == STALL
    assert receiver.give_up(STALL - 0.01) == []
    assert [(peer, sources(frames)) for peer, frames in receiver.give_up(STALL)] == [
        ('a', [LIGHT])]
    assert receiver.due == math.inf


def test_frame_that_began_behind_a_false_start_is_still_awaited(receiver: Receiver) -> None:
    receiver.feed('a', FALSE_STARTS[0], 0.0)
    receiver.feed('a', FRAME[:9], 0.4)
    assert receiver.due == STALL
    assert receiver.give_up(STALL) == []
    assert sources(receiver.feed('a', FRAME[9:], STALL + 0.1)) == [LIGHT]


def test_wait_begins_anew_with_the_next_frame(receiver: Receiver) -> None:
    receiver.feed('a', FRAME[:9], 0.0)
    receiver.feed('a', FRAME[9:] + FRAME[:9], 0.4)
    assert receiver.due == 0.4 + STALL


def test_longest_frame_at_9600_baud_is_not_given_up(receiver: Receiver) -> None:
    found = []
    for number, byte in enumerate(raw_v1(110, bytes(range(1, 251)))):
        now = number * 0.00104
        assert receiver.give_up(now) == []
        found += receiver.feed('a', bytes((byte,)), now) or []
    assert sources(found) == [LIGHT]


def test_garbage_of_many_peers_costs_a_good_peer_nothing(receiver: Receiver) -> None:
    receiver.feed('good', FRAME + FRAME[:9], 0.0)
    for number in range(10 * MAX_DECODERS):
        receiver.feed(number, FALSE_STARTS[0], 0.0)
    assert sources(receiver.feed('good', FRAME[9:], 0.1)) == [LIGHT]
    assert sources(receiver.feed(0, FRAME, 0.1)) == [LIGHT]
    assert receiver.give_up(STALL) == []


def test_closed_link_awaits_nothing(receiver: Receiver) -> None:
    receiver.feed('a', FRAME[:9], 0.0)
    receiver.clear()
    assert receiver.due == math.inf
    assert receiver.feed('a', FRAME[9:], 0.1) is None


@pytest.mark.parametrize(('frames', 'seconds'), [(0, 0.0), (100, 0.0), (101, 0.02), (1280, 0.01)])
def test_more_than_1000_foreign_frames_a_second_are_read_each_20_ms_or_128_frames(
        frames: int, seconds: float) -> None:
    receiver = make(Signing(), ())
    receiver.feed('a', FRAME, 0.0)
    assert receiver.pause(1.0) == 0.0
    receiver.feed('a', FRAME * frames, 1.0)
    assert receiver.pause(1.1) == pytest.approx(seconds)
