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

"""Frames for others: checked, counted, and made nothing of where their source is known."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from hypothesis import given, settings
from hypothesis import strategies as st
from illuminator_ros.mavlink.frame import Decoder, DecoderCounters, FLAG_SIGNED, Frame
from illuminator_ros.mavlink.messages import Address, FOREIGN, HANDLED, LAYOUTS
from illuminator_ros.mavlink.receiver import Receiver, RENEWAL
from illuminator_ros.mavlink.signing import Signing, SigningMode
import pytest
from support.frames import AUTOPILOT, foreign_frame, frame_of, LIGHT, raw_v1, raw_v2, spoilt
from support.heartbeats import heartbeat_frame

UNIX = 1.7e9


def test_what_is_foreign_can_be_checked_and_is_not_handled() -> None:
    assert {int.from_bytes(id_, 'little') for id_ in FOREIGN} == set(LAYOUTS) - set(HANDLED)
    assert FOREIGN[(30).to_bytes(3, 'little')] == bytes((LAYOUTS[30].crc_extra,))


def pass_over(data: bytes) -> tuple[list[Frame], list[int]]:
    """Return the frames in the data, and the numbers of those of the autopilot passed over."""
    counted: list[int] = []
    return Decoder().feed(data, {bytes(AUTOPILOT): counted.append}), counted


def test_foreign_frames_of_a_known_source_are_only_counted() -> None:
    assert pass_over(foreign_frame(3) + foreign_frame(4)) == ([], [3, 4])


def test_what_is_handled_comes_through_between_them() -> None:
    data = foreign_frame(3) + frame_of(source=AUTOPILOT, sequence=4) + foreign_frame(5)
    found, counted = pass_over(data)
    assert ([frame.sequence for frame in found], counted) == ([4], [3, 5])


@pytest.mark.parametrize('before', [
    b'noise', b'\xfd\xfd', raw_v2(12345, b'\1' * 20, crc_extra=0), foreign_frame()[:20]],
    ids=['noise', 'start bytes', 'unknown message', 'cut frame'])
def test_they_are_passed_over_behind_anything(before: bytes) -> None:
    assert pass_over(before + foreign_frame(3) + bytes(300)) == ([], [3])


@pytest.mark.parametrize('frame', [
    foreign_frame(source=Address(8, 1)),
    raw_v1(30, bytes(28), source=AUTOPILOT),
    raw_v2(30, bytes(28), incompat=FLAG_SIGNED, source=AUTOPILOT) + bytes(13),
], ids=['other source', 'MAVLink 1', 'signed'])
def test_everything_else_is_looked_at(frame: bytes) -> None:
    found, counted = pass_over(frame)
    assert (len(found), counted) == (1, [])


@pytest.mark.parametrize('at', range(len(foreign_frame())))
def test_a_wrong_bit_anywhere_counts_for_nothing(at: int) -> None:
    assert pass_over(spoilt(foreign_frame(), at) + bytes(300)) == ([], [])


@pytest.mark.parametrize('flags', [2, 3, 0x80])
def test_an_unknown_incompatibility_flag_counts_for_nothing(flags: int) -> None:
    frame = raw_v2(30, bytes(28), incompat=flags, source=AUTOPILOT)
    assert pass_over(frame + bytes(300)) == ([], [])


pieces = st.one_of(
    st.integers(0, 255).map(foreign_frame),
    st.integers(0, 255).map(lambda n: foreign_frame(n, LIGHT)),
    st.integers(0, 255).map(lambda n: frame_of(sequence=n, source=AUTOPILOT)),
    st.binary(min_size=1, max_size=30).map(
        lambda payload: raw_v2(12345, payload, crc_extra=0, source=AUTOPILOT)),
    st.integers(0, 255).map(lambda n: raw_v1(30, bytes(28), sequence=n, source=AUTOPILOT)),
    st.integers(0, 255).map(lambda n: raw_v2(
        30, bytes(9), sequence=n, source=AUTOPILOT, incompat=FLAG_SIGNED) + bytes(range(13))),
    st.tuples(st.integers(0, 255), st.integers(0, 39)).map(
        lambda cut: foreign_frame(cut[0])[:cut[1]]),
    st.binary(max_size=20),
    st.sampled_from([b'\xfd', b'\xfe', b'\xfd\x1c\x00']))


@given(st.lists(pieces, max_size=20), st.lists(st.integers(1, 120), min_size=1, max_size=6))
@settings(derandomize=True, deadline=None, max_examples=300)
def test_nothing_is_lost_or_won_by_it_in_any_stream(
    stream: list[bytes], sizes: list[int],
) -> None:
    data = b''.join(stream) + bytes(300)
    passed: Counter[int] = Counter()
    plain, quick = DecoderCounters(), DecoderCounters()

    def count(sequence: int) -> None:
        passed[sequence] += 1

    every = in_pieces(data, sizes, Decoder(counters=plain).feed)
    decoder = Decoder(counters=quick)
    found = in_pieces(data, sizes, lambda d: decoder.feed(d, {bytes(AUTOPILOT): count}))

    assert handled(found) == handled(every)
    assert foreign(found) + passed == foreign(every)
    assert quick == plain


def in_pieces(
    data: bytes, sizes: list[int], feed: Callable[[bytes], list[Frame]],
) -> list[Frame]:
    """Return the frames in a stream that comes in pieces of these sizes, over and over."""
    found, at, turn = [], 0, 0
    while at < len(data):
        found += feed(data[at:at + sizes[turn % len(sizes)]])
        at, turn = at + sizes[turn % len(sizes)], turn + 1
    return found


def handled(frames: list[Frame]) -> list[Frame]:
    """Return those with messages that are something to us."""
    return [frame for frame in frames if frame.message_id in HANDLED]


def foreign(frames: list[Frame]) -> Counter[int]:
    """Return the sequence numbers of the others."""
    return Counter(frame.sequence for frame in frames if frame.message_id not in HANDLED)


class TestReception:

    @staticmethod
    def knowing(mode: SigningMode = SigningMode.OFF) -> tuple[Receiver, list[int]]:
        """Return the way in of a link that knows the autopilot on peer a; and what it counts."""
        reception = Receiver(Signing(mode, bytes(32)))
        counted: list[int] = []
        reception.take('a', heartbeat_frame(AUTOPILOT), 0.0, UNIX)
        reception.know('a', AUTOPILOT, counted.append)
        return reception, counted

    def test_a_source_is_known_on_the_peer_that_it_was_heard_on(self) -> None:
        reception, counted = self.knowing()
        assert len(reception.take('b', foreign_frame(1), 0.1, UNIX)) == 1
        assert reception.take('a', foreign_frame(2), 0.1, UNIX) == []
        assert counted == [2]

    def test_it_is_looked_at_again_after_a_while(self) -> None:
        reception, counted = self.knowing()
        assert reception.take('a', foreign_frame(1), RENEWAL - 0.01, UNIX) == []
        assert len(reception.take('a', foreign_frame(2), RENEWAL, UNIX)) == 1
        assert counted == [1]

    def test_nobody_is_known_on_a_link_that_was_closed(self) -> None:
        reception, _ = self.knowing()
        reception.clear()
        assert len(reception.take('a', foreign_frame(1), 0.1, UNIX)) == 1

    def test_where_signatures_matter_every_frame_is_looked_at(self) -> None:
        reception, counted = self.knowing(SigningMode.SIGN)
        assert len(reception.take('a', foreign_frame(1), 0.1, UNIX)) == 1
        assert counted == []
        unsigned = Signing(SigningMode.REQUIRE, bytes(32))
        strict = Receiver(unsigned)
        strict.take('a', b'', 0.0, UNIX)
        strict.know('a', AUTOPILOT, counted.append)
        assert strict.take('a', foreign_frame(1), 0.1, UNIX) == []
        assert (unsigned.counters.unsigned, counted) == (1, [])
