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

"""No good frame is lost, whatever stands around it and in whatever pieces it comes."""

from __future__ import annotations

import random

from hypothesis import example, given, settings
from hypothesis import strategies as st
from illuminator_ros.mavlink.frame import Decoder, FLAG_SIGNED, ForeignFrames, Frame, MAX_FRAME
from illuminator_ros.mavlink.messages import LAYOUTS
from illuminator_ros.mavlink.signing import signature
import pytest
from support.frames import FILLER, frame_of, raw_v1, raw_v2
from support.messages import EVERY_MESSAGE
from support.reference_dialect import Peer, twin

# Always the same examples: one in 65,536 damaged frames has the right checksum by chance.
PROPERTY = settings(derandomize=True, deadline=None, max_examples=150)
KEY = bytes(range(32))


def _frames() -> list[bytes]:
    signing = Peer(key=KEY)
    frames = []
    for number, message in enumerate(EVERY_MESSAGE):
        frames += [frame_of(message, number), signing.encode(twin(message), number)]
        if message.id < 256:
            frames.append(Peer().encode(twin(message), number, version=1))
    return [*frames, raw_v2(0, b'\1' * 255), raw_v2(0, b''), raw_v1(0, b'')]


FRAMES = _frames()
V2 = [frame for frame in FRAMES if frame[0] == 0xFD]
SIGNED = [frame for frame in V2 if frame[2] == FLAG_SIGNED]
UNSIGNED = [frame for frame in FRAMES if frame not in SIGNED]
known_ids = st.sampled_from(sorted(LAYOUTS))
bytes_ = st.integers(0, 255)
# The beginning of a frame that does not go on: a message id that exists, any length.
false_v2 = st.builds(
    lambda length, flags, rest, id_: bytes((0xFD, length, flags, *rest))
    + id_.to_bytes(3, 'little'),
    bytes_, st.sampled_from([0, 1]), st.tuples(bytes_, bytes_, bytes_, bytes_), known_ids)
false_v1 = known_ids.filter(lambda id_: id_ < 256).flatmap(lambda id_: st.builds(
    lambda length, rest: bytes((0xFE, length, *rest, id_)),
    st.integers(0, LAYOUTS[id_].size), st.tuples(bytes_, bytes_, bytes_)))
noise = st.one_of(
    st.binary(max_size=40), false_v2, false_v1,
    st.lists(st.sampled_from([0xFD, 0xFE, 0, 255]), max_size=40).map(bytes),
    st.sampled_from(UNSIGNED).flatmap(
        lambda frame: st.integers(0, min(len(frame) - 1, 40)).map(lambda end: frame[:end])))
frames = st.sampled_from(FRAMES)


def in_pieces(data: bytes, sizes: list[int]) -> list[Frame]:
    """Return the frames in a stream that comes in pieces of these sizes, over and over."""
    decoder, found, at, turn = Decoder(), [], 0, 0
    while at < len(data):
        size = sizes[turn % len(sizes)]
        found += decoder.feed(data[at:at + size])
        at, turn = at + size, turn + 1
    return found


def authentic(frame: Frame) -> bool:
    """Return whether a frame is not signed, or rightly."""
    if frame.signature is None:
        return True
    return frame.signature[7:] == signature(KEY, frame.signed_part + frame.signature[:7])


def bytes_of(frame: Frame) -> bytes:
    """Return a frame as it was sent."""
    build = raw_v1 if frame.version == 1 else raw_v2
    if frame.signature is not None:
        return frame.signed_part + frame.signature
    return build(frame.message_id, frame.payload, sequence=frame.sequence, source=frame.source)


@given(st.lists(st.tuples(noise, frames), max_size=12), noise,
       st.lists(st.integers(1, 400), min_size=1, max_size=8))
@PROPERTY
def test_every_good_frame_between_noise_is_found(
        stream: list[tuple[bytes, bytes]], end: bytes, sizes: list[int]) -> None:
    data = b''.join(before + frame for before, frame in stream) + end + FILLER
    assert [bytes_of(frame) for frame in in_pieces(data, sizes)] == [
        frame for _, frame in stream]


# A signature, which the checksum does not cover, can only be cut short by a MAVLink 2 frame.
victim_and_others = st.one_of(
    st.tuples(st.sampled_from(SIGNED), st.lists(st.sampled_from(V2), max_size=5)),
    st.tuples(st.sampled_from(UNSIGNED), st.lists(frames, max_size=5)))


@given(victim_and_others, st.binary(min_size=1, max_size=40), st.data())
@PROPERTY
def test_noise_inside_a_frame_costs_no_frame_but_that_one(
        sent: tuple[bytes, list[bytes]], inserted: bytes, data: st.DataObject) -> None:
    victim, others = sent
    where = data.draw(st.integers(0, len(others)))
    inside = data.draw(st.integers(1, len(victim) - 1))
    damaged = victim[:inside] + inserted + victim[inside:]
    found = in_pieces(b''.join([*others[:where], damaged, *others[where:], FILLER]), [64])
    assert [bytes_of(frame) for frame in found if authentic(frame)] == others


@given(victim_and_others, st.data())
@PROPERTY
def test_frame_that_is_cut_short_costs_no_other(
        sent: tuple[bytes, list[bytes]], data: st.DataObject) -> None:
    victim, others = sent
    where = data.draw(st.integers(0, len(others)))
    cut = victim[:data.draw(st.integers(0, len(victim) - 1))]
    found = in_pieces(b''.join([*others[:where], cut, *others[where:], FILLER]), [1000])
    assert [bytes_of(frame) for frame in found if authentic(frame)] == others


@given(st.lists(st.tuples(frames, st.binary(min_size=6, max_size=6)), min_size=1, max_size=8))
@example([(SIGNED[0], b'\xfd\xb5\x00\xbe\x8a\xdc'), (SIGNED[0], bytes(6))])
@PROPERTY
def test_frames_come_with_their_last_byte_whatever_their_signatures_look_like(
        sent: list[tuple[bytes, bytes]]) -> None:
    # On a link of their own: no noise that they could be taken for.
    decoder = Decoder()
    for frame, mark in sent:
        whole = frame[:-6] + mark if frame[0] == 0xFD and frame[2] == FLAG_SIGNED else frame
        assert [bytes_of(found) for found in decoder.feed(whole)] == [whole]


@given(st.binary(max_size=2000), st.lists(st.integers(1, 300), min_size=1, max_size=5))
@PROPERTY
def test_pieces_make_no_difference(data: bytes, sizes: list[int]) -> None:
    assert in_pieces(data, sizes) == in_pieces(data, [len(data) or 1])


@pytest.mark.parametrize('seed', range(3))
def test_all_of_2000_frames_are_found_with_up_to_40_random_bytes_between_them(seed: int) -> None:
    # pymavlink finds 70 % of them.
    chance = random.Random(seed)
    sent = [frame_of(chance.choice(EVERY_MESSAGE), number % 256) for number in range(2000)]
    data = b''.join(chance.randbytes(chance.randrange(41)) + frame for frame in sent) + FILLER
    assert [bytes_of(frame) for frame in in_pieces(data, [97])] == sent


# Delayed frames

def test_longest_frame_there_is_has_280_bytes() -> None:
    longest = raw_v2(0, b'\1' * 255, incompat=FLAG_SIGNED) + bytes(13)
    assert len(longest) == MAX_FRAME == 280
    assert len(in_pieces(longest, [7])) == 1


@given(st.lists(st.one_of(noise, frames), max_size=20),
       st.lists(st.integers(1, 300), min_size=1, max_size=5))
@PROPERTY
def test_less_than_one_longest_frame_is_kept_back(
        stream: list[bytes], sizes: list[int]) -> None:
    data, decoder, at, turn = b''.join(stream), Decoder(), 0, 0
    frame_bytes = 0
    while at < len(data):
        piece = data[at:at + sizes[turn % len(sizes)]]
        frame_bytes += sum(len(bytes_of(frame)) for frame in decoder.feed(piece))
        at, turn = at + len(piece), turn + 1
        held = at - frame_bytes - decoder.counters.skipped_bytes
        assert 0 <= held < MAX_FRAME
        assert decoder.incomplete == (at - held if held else None)


def test_memory_does_not_grow_with_what_is_no_frame() -> None:
    decoder = Decoder()
    decoder.feed(bytes((0xFD, 255, 1, 0, 0, 1, 1, 0, 0, 0)) * 10_000)
    assert decoder.incomplete is not None
    assert decoder.taken - decoder.incomplete < MAX_FRAME


def test_good_frame_behind_a_false_beginning_comes_with_the_bytes_that_would_end_that() -> None:
    decoder, frame = Decoder(), frame_of()
    assert decoder.feed(bytes((0xFD, 100, 0, 0, 0, 1, 1, 0, 0, 0)) + frame) == []
    assert decoder.feed(bytes(102 - len(frame) - 1)) == []
    assert [bytes_of(found) for found in decoder.feed(b'\0')] == [frame]


def test_good_frames_behind_a_false_beginning_come_when_it_is_given_up() -> None:
    decoder = Decoder()
    decoder.feed(bytes((0xFD, 255, 0, 0, 0, 1, 1, 0, 0, 0)) + frame_of() + frame_of(sequence=1))
    assert [frame.sequence for frame in decoder.give_up(decoder.taken)] == [0, 1]
    assert decoder.incomplete is None


def test_frame_that_has_only_begun_since_is_not_given_up() -> None:
    decoder, frame = Decoder(), frame_of(sequence=2)
    decoder.feed(bytes((0xFD, 255, 0, 0, 0, 1, 1, 0, 0, 0)))
    noise_taken = decoder.taken
    decoder.feed(frame_of(sequence=1) + frame[:20])
    assert [found.sequence for found in decoder.give_up(noise_taken)] == [1]
    assert [found.sequence for found in decoder.feed(frame[20:])] == [2]


def test_frame_that_begins_where_the_noise_ends_is_not_given_up() -> None:
    decoder, frame = Decoder(), frame_of()
    decoder.feed(bytes((0xFD, 255, 0, 0, 0, 1, 1, 0, 0, 0)))
    noise_taken = decoder.taken
    decoder.feed(frame[:20])
    assert decoder.give_up(noise_taken) == []
    assert len(decoder.feed(frame[20:])) == 1


@given(st.lists(st.one_of(noise, frames), max_size=10))
@PROPERTY
def test_giving_up_leaves_nothing_and_counts_each_byte_once(stream: list[bytes]) -> None:
    decoder, data = Decoder(), b''.join(stream)
    found = decoder.feed(data)
    found += decoder.give_up(decoder.taken)
    assert decoder.incomplete is None
    assert decoder.taken == len(data)
    assert decoder.counters.frames == len(found)
    assert decoder.counters.skipped_bytes == len(data) - sum(
        len(bytes_of(frame)) for frame in found)


@given(st.lists(st.one_of(noise, frames), max_size=10), st.lists(st.integers(1, 60), min_size=1))
@PROPERTY
def test_counting_foreign_frames_finds_the_same_frames_as_reading_them(
    stream: list[bytes], sizes: list[int],
) -> None:
    foreign = {id_.to_bytes(3, 'little'): bytes((layout.crc_extra,))
               for id_, layout in LAYOUTS.items() if id_ not in (0, 77)}
    reading, counting = Decoder(), Decoder()
    data, at = b''.join(stream), 0
    for size in [*sizes, len(data)]:
        piece, at = data[at:at + size], at + size
        found: list[tuple[object, int]] = []
        for one in counting.sort(piece, foreign):
            numbers = one.sequences if isinstance(one, ForeignFrames) else (one.sequence,)
            found += [(one.source, number) for number in numbers]
        assert found == [(one.source, one.sequence) for one in reading.feed(piece)]
    assert counting.counters.frames == reading.counters.frames
    assert counting.counters.skipped_bytes == reading.counters.skipped_bytes
