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

"""The way in of a link: many peers, noise, and signatures."""

from __future__ import annotations

from illuminator_ros.mavlink.messages import Address, LAYOUTS
from illuminator_ros.mavlink.receiver import MAX_DECODERS, Receiver, STALL
from illuminator_ros.mavlink.signing import Signing, SigningMode
import pytest
from support.frames import LIGHT, raw_v1
from support.heartbeats import heartbeat_frame

UNIX = 1.7e9
# The beginnings of what would be frames of 250 bytes, MAVLink 1 and 2, if more came.
FALSE_STARTS = [b'\xfe\xfa\x00\x01\x01\x6e', b'\xfd\xfa\x00\x00\x00\x01\x01\x6e\x00\x00']


@pytest.fixture
def reception() -> Receiver:
    """Return the way in of a link without signing."""
    return Receiver(Signing(), LAYOUTS)


def sources(frames: list) -> list[Address]:
    """Return where frames come from."""
    return [frame.source for frame in frames]


def test_pieces_of_one_peer_are_put_together(reception: Receiver) -> None:
    frame = heartbeat_frame()
    assert reception.take('a', frame[:9], 0.0, UNIX) == []
    assert sources(reception.take('a', frame[9:], 0.1, UNIX)) == [LIGHT]


def test_pieces_of_different_peers_are_kept_apart(reception: Receiver) -> None:
    one, other = heartbeat_frame(Address(1, 1)), heartbeat_frame(Address(2, 2))
    reception.take('a', one[:9], 0.0, UNIX)
    reception.take('b', other[:9], 0.0, UNIX)
    assert sources(reception.take('a', one[9:], 0.1, UNIX)) == [Address(1, 1)]
    assert sources(reception.take('b', other[9:], 0.1, UNIX)) == [Address(2, 2)]


@pytest.mark.parametrize('noise', FALSE_STARTS, ids=['MAVLink 1', 'MAVLink 2'])
def test_good_frames_behind_a_false_start_come_without_more_bytes(
    reception: Receiver, noise: bytes,
) -> None:
    assert reception.take('a', noise + heartbeat_frame(), 0.0, UNIX) == []
    assert reception.next_deadline() == STALL
    assert reception.give_up(STALL - 0.01, UNIX) == []
    assert [(peer, frame.source) for peer, frame in reception.give_up(STALL, UNIX)] == [
        ('a', LIGHT)]


def test_a_chain_of_false_starts_is_given_up_as_a_whole(reception: Receiver) -> None:
    reception.take('a', b''.join(FALSE_STARTS * 5) + heartbeat_frame(), 0.0, UNIX)
    assert len(reception.give_up(STALL, UNIX)) == 1


def test_a_frame_that_has_only_begun_since_is_waited_for(reception: Receiver) -> None:
    frame = heartbeat_frame()
    reception.take('a', FALSE_STARTS[0], 0.0, UNIX)
    reception.take('a', frame[:9], 0.4, UNIX)
    assert reception.give_up(STALL, UNIX) == []
    assert sources(reception.take('a', frame[9:], STALL + 0.1, UNIX)) == [LIGHT]


def test_nothing_is_awaited_once_it_was_given_up(reception: Receiver) -> None:
    reception.take('a', FALSE_STARTS[0], 0.0, UNIX)
    reception.give_up(STALL, UNIX)
    assert reception.next_deadline() == float('inf')


def test_a_slow_frame_is_not_given_up(reception: Receiver) -> None:
    # 9600 baud: a byte takes 1 ms, and the longest frame 0.27 s.
    frame = raw_v1(110, bytes(range(1, 251)))
    found = []
    for number in range(len(frame)):
        now = number * 0.00104
        assert reception.give_up(now, UNIX) == []
        found += reception.take('a', frame[number:number + 1], now, UNIX)
    assert sources(found) == [LIGHT]


def test_the_wait_begins_anew_with_another_frame(reception: Receiver) -> None:
    frame = heartbeat_frame()
    reception.take('a', frame[:9], 0.0, UNIX)
    reception.take('a', frame[9:] + frame[:9], 0.4, UNIX)
    assert reception.next_deadline() == 0.4 + STALL


def test_the_wait_goes_on_while_pieces_of_the_same_frame_come(reception: Receiver) -> None:
    reception.take('a', FALSE_STARTS[0], 0.0, UNIX)
    reception.take('a', heartbeat_frame(), 0.4, UNIX)
    assert reception.next_deadline() == STALL


def test_the_peers_that_are_kept_apart_are_bounded(reception: Receiver) -> None:
    for number in range(10 * MAX_DECODERS):
        reception.take(number, heartbeat_frame()[:9], 0.0, UNIX)
    assert len(reception) == MAX_DECODERS
    # Nothing is left of those that had to go.
    assert len(reception.give_up(STALL, UNIX)) == 0


def test_a_peer_that_had_to_go_is_heard_again(reception: Receiver) -> None:
    for number in range(10 * MAX_DECODERS):
        reception.take(number, b'', 0.0, UNIX)
    assert sources(reception.take(0, heartbeat_frame(), 0.0, UNIX)) == [LIGHT]


def test_garbage_of_many_peers_does_not_cost_a_good_one_its_incomplete_frame(
    reception: Receiver,
) -> None:
    frame = heartbeat_frame()
    reception.take('a', frame + frame[:9], 0.0, UNIX)
    for number in range(10 * MAX_DECODERS):
        reception.take(number, FALSE_STARTS[0], 0.0, UNIX)
    assert len(reception) == MAX_DECODERS
    assert sources(reception.take('a', frame[9:], 0.1, UNIX)) == [LIGHT]


def test_what_is_not_to_be_believed_does_not_come_through() -> None:
    reception = Receiver(Signing(SigningMode.REQUIRE, bytes(32)), LAYOUTS)
    assert reception.take('a', heartbeat_frame(), 0.0, UNIX) == []
    reception.take('a', FALSE_STARTS[0] + heartbeat_frame(), 0.0, UNIX)
    assert reception.give_up(STALL, UNIX) == []


def test_a_link_that_was_closed_awaits_nothing(reception: Receiver) -> None:
    frame = heartbeat_frame()
    reception.take('a', frame[:9], 0.0, UNIX)
    reception.clear()
    assert reception.next_deadline() == float('inf')
    assert reception.take('a', frame[9:], 0.1, UNIX) == []


def test_all_peers_are_counted_together(reception: Receiver) -> None:
    reception.take('a', heartbeat_frame(), 0.0, UNIX)
    reception.take('b', heartbeat_frame(), 0.0, UNIX)
    assert reception.counters.frames == 2
