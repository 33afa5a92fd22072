# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Frames: agreed with pymavlink, and found in any stream of bytes."""

from __future__ import annotations

import cProfile
from dataclasses import replace

from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from illuminator_ros.illuminator.messages import STATUS_ID
from illuminator_ros.mavlink.dialect import CRC_EXTRA, encode, mavlink
from illuminator_ros.mavlink.frame import (
    Decoder,
    DecoderCounters,
    encode_frame,
    FLAG_SIGNED,
    ForeignFrames,
    Frame,
    MAX_FRAME,
)
from illuminator_ros.mavlink.messages import (
    Address,
    CommandAck,
    Heartbeat,
    Message,
)
from illuminator_ros.mavlink.signing import signature
import pytest
from support.frames import decoded, FILLER, frame_of, LIGHT, only, raw_v1, raw_v2, spoilt
from support.messages import decode_payload, EVERY_MESSAGE, STATUS
from support.reference_dialect import fields_of, Peer, twin

KEY = bytes(range(32))
FOREIGN_ID = 12345
# One in 65,536 damaged frames has the right checksum by chance; conftest.py fixes the examples.
PROPERTY = settings(max_examples=60)


@pytest.mark.parametrize('message', EVERY_MESSAGE, ids=lambda message: message.msgname)
def test_frames_are_those_of_pymavlink_in_both_directions(message: Message) -> None:
    data = frame_of(message, 200, Address(7, 9))
    assert data == Peer(Address(7, 9)).encode(twin(message), 200)
    (read,) = Peer().decode(data)
    assert fields_of(read) == fields_of(message)
    assert (read.get_seq(), read.get_srcSystem(), read.get_srcComponent()) == (200, 7, 9)

    signing = Peer(key=KEY, link_id=3, timestamp=0x0102030405)
    for version, peer in ((1, Peer()), (2, Peer()), (2, signing)):
        if version == 1 and message.id > 255:
            continue
        data = peer.encode(twin(message), 99, version=version)
        frame = only(data)
        assert (frame.version, frame.sequence, frame.source) == (version, 99, LIGHT)
        assert encode(decode_payload(frame.message_id, frame.payload)) == encode(message)
        assert frame.data == data
        assert (frame.signature is None) == (peer is not signing)


def test_payload_is_sent_without_trailing_zeros_but_with_its_first_byte() -> None:
    assert [len(frame_of(Heartbeat(0, 0, 0, mode, 0, 0))) for mode in (0, 1, 256)] == [13, 13, 14]


def test_message_id_takes_three_bytes() -> None:
    data = encode_frame(0x123456, b'\1', sequence=0, source=LIGHT, crc_extra=0)
    assert data[7:10] == bytes.fromhex('56 34 12')


@pytest.mark.parametrize(('payload', 'options', 'reason'), [
    (b'\1' * 256, {}, 'range'), (b'', {'version': 1}, 'MAVLink 1 carries no message 440'),
    (b'', {'version': 1, 'signed': True}, 'MAVLink 1 frames cannot be signed')])
def test_frame_that_cannot_be_sent_is_refused_with_the_reason(
        payload: bytes, options: dict[str, int], reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        encode_frame(STATUS_ID, payload, sequence=0, source=LIGHT, crc_extra=66,
                     **options)  # type: ignore[arg-type]


ACK = encode(CommandAck(405, 4, 0, 0, 1, 1))
ATTITUDE = 30


# Any length of MAVLink 2, with extension fields that are not known; MAVLink 1 without them.
@pytest.mark.parametrize(('data', 'payload'), [
    *((raw_v2(Heartbeat.id, b'\7' * size), b'\7' * size) for size in (0, 1, 9, 10, 254, 255)),
    *((raw_v1(CommandAck.id, ACK[:size]), ACK[:size]) for size in (3, 10)),
    *((raw_v2(Heartbeat.id, b'\7', compat=flags), b'\7') for flags in (1, 2, 0x80, 0xFF)),
    (raw_v2(ATTITUDE, b'\7' * 28), b'\7' * 28)])
def test_frame_of_unusual_length_flags_or_message_is_read(data: bytes, payload: bytes) -> None:
    assert only(data).payload == payload


STATUS_BYTES = encode(STATUS)


@pytest.mark.parametrize('data', [
    *(spoilt(frame_of(), at) for at in (1, 4, 5, 6, 7, 12, -1, -2)),
    *(spoilt(raw_v1(CommandAck.id, ACK), at) for at in (1, 4, 5, 6, 7, 12, -1, -2)),
    *(raw_v2(STATUS_ID, STATUS_BYTES, incompat=1 << bit) for bit in range(1, 8)),
    *(raw_v2(STATUS_ID, STATUS_BYTES, incompat=1 << bit | 1) + bytes(13) for bit in range(1, 8)),
    raw_v2(STATUS_ID, STATUS_BYTES, crc_extra=67), raw_v1(Heartbeat.id, bytes(10)),
    *(raw_v2(FOREIGN_ID, b'\1\2\3', crc_extra=seed) for seed in (0, 66))])
def test_frame_with_wrong_bit_flag_seed_length_or_unknown_id_is_refused(data: bytes) -> None:
    assert decoded(data) == []


def test_counters_distinguish_frames_and_faults() -> None:
    decoder, foreign = Decoder(), raw_v2(FOREIGN_ID, b'\1', crc_extra=0)
    assert 255 not in CRC_EXTRA
    decoder.feed(b'noise' + frame_of() + spoilt(frame_of()) + foreign
                 + frame_of() + raw_v1(255, b'\1', crc_extra=0) + frame_of())
    assert decoder.counters == DecoderCounters(foreign=0, crc_errors=1)


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
known_ids = st.sampled_from(sorted(mavlink.mavlink_map))
bytes_ = st.integers(0, 255)
# The beginning of a frame that is never completed: an existing message id, any length.
false_v2 = st.builds(
    lambda length, flags, rest, id_: bytes((0xFD, length, flags, *rest))
    + id_.to_bytes(3, 'little'),
    bytes_, st.sampled_from([0, 1]), st.tuples(bytes_, bytes_, bytes_, bytes_), known_ids)
false_v1 = known_ids.filter(lambda id_: id_ < 256).flatmap(lambda id_: st.builds(
    lambda length, rest: bytes((0xFE, length, *rest, id_)),
    st.integers(0, mavlink.mavlink_map[id_].unpacker.size), st.tuples(bytes_, bytes_, bytes_)))
noise = st.one_of(
    st.binary(max_size=40), false_v2, false_v1,
    st.lists(st.sampled_from([0xFD, 0xFE, 0, 255]), max_size=40).map(bytes),
    st.sampled_from(UNSIGNED).flatmap(
        lambda frame: st.integers(0, min(len(frame) - 1, 40)).map(lambda end: frame[:end])))
frames = st.sampled_from(FRAMES)
sizes_ = st.lists(st.integers(1, 400), min_size=1, max_size=8)


def in_pieces(data: bytes, sizes: list[int], decoder: Decoder) -> list[Frame]:
    """Return the frames in a stream that arrives in pieces of these sizes, cyclically."""
    found, at, turn = list[Frame](), 0, 0
    while at < len(data):
        size = sizes[turn % len(sizes)]
        found += decoder.feed(data[at:at + size])
        at, turn = at + size, turn + 1
        held = len(decoder.rest)
        assert held < MAX_FRAME
        assert decoder.incomplete == (decoder.taken - held if held else None)
    return found


def bytes_of(frame: Frame) -> bytes:
    """Return a frame as it was sent."""
    return frame.data


def authentic(found: list[Frame]) -> list[bytes]:
    """Return the frames that are unsigned or have a valid signature."""
    return [bytes_of(frame) for frame in found if frame.signature is None
            or frame.signature[7:] == signature(KEY, frame.data[:-6])]


@given(st.lists(st.tuples(noise, frames), max_size=12), noise, sizes_)
@PROPERTY
def test_every_good_frame_between_noise_is_found_whatever_the_pieces(
        stream: list[tuple[bytes, bytes]], end: bytes, sizes: list[int]) -> None:
    data = b''.join(before + frame for before, frame in stream) + end + FILLER
    assert [bytes_of(frame) for frame in in_pieces(data, sizes, Decoder())] == [
        frame for _, frame in stream]


@given(st.lists(noise | frames, max_size=20).map(b''.join), sizes_)
@PROPERTY
def test_pieces_make_no_difference_and_all_bytes_can_be_given_up(
        data: bytes, sizes: list[int]) -> None:
    pieces, whole = Decoder(), Decoder()
    found = in_pieces(data, sizes, pieces)
    assert (found, pieces.counters) == (whole.feed(data), whole.counters)
    found += pieces.give_up(pieces.taken)
    assert (pieces.incomplete, pieces.taken) == (None, len(data))


@given(st.lists(noise | frames, max_size=10).map(b''.join), st.lists(st.integers(1, 60)))
@PROPERTY
def test_counting_foreign_frames_finds_the_same_frames_as_reading_them(
        data: bytes, sizes: list[int]) -> None:
    foreign = {id_: bytes((crc_extra,))
               for id_, crc_extra in CRC_EXTRA.items() if id_ not in (0, 77)}
    reading, counting, at = Decoder(), Decoder(), 0
    for size in [*sizes, len(data)]:
        piece, at = data[at:at + size], at + size
        found = [(one.source, number) for one in counting.sort(piece, foreign)
                 for number in (one.sequences if isinstance(one, ForeignFrames)
                                else [one.sequence])]
        assert found == [(one.source, one.sequence) for one in reading.feed(piece)]
    assert replace(counting.counters, foreign=0) == reading.counters


def test_foreign_frames_around_another_of_their_source_stay_in_order() -> None:
    data = b''.join(encode_frame(
        id_, b'\1', sequence=sequence, source=Address(1, 1), crc_extra=CRC_EXTRA[id_])
        for sequence, id_ in enumerate((1, 0, 1)))
    found = Decoder().sort(data, {1: bytes((CRC_EXTRA[1],))})
    assert [one.sequences if isinstance(one, ForeignFrames) else one.sequence
            for one in found] == [b'\0', 1, b'\2']


# A signature, which the checksum does not cover, can only be cut short by a MAVLink 2 frame.
@given(st.one_of(st.tuples(st.sampled_from(SIGNED), st.lists(st.sampled_from(V2), max_size=5)),
                 st.tuples(st.sampled_from(UNSIGNED), st.lists(frames, max_size=5))),
       st.binary(min_size=1, max_size=40), st.booleans(), st.data())
@PROPERTY
def test_frame_that_is_cut_short_or_has_noise_inside_costs_no_other(
        sent: tuple[bytes, list[bytes]], inserted: bytes, is_cut: bool,
        data: st.DataObject) -> None:
    victim, others = sent
    where = data.draw(st.integers(0, len(others)))
    inside = data.draw(st.integers(1, len(victim) - 1))
    damaged = victim[:inside] + (b'' if is_cut else inserted + victim[inside:])
    assume(victim not in damaged)
    found = Decoder().feed(b''.join([*others[:where], damaged, *others[where:], FILLER]))
    assert authentic(found) == others


@pytest.mark.parametrize('missing', [1, 6, 12])
def test_a_signature_that_is_cut_short_costs_no_frame_after_it(missing: int) -> None:
    found = Decoder().feed(SIGNED[0][:-missing] + SIGNED[1] + V2[0])
    assert authentic(found) == [SIGNED[1], V2[0]]


@given(st.lists(st.tuples(frames, st.binary(min_size=6, max_size=6)), min_size=1, max_size=8))
@example([(SIGNED[0], b'\xfd\xb5\x00\xbe\x8a\xdc'), (SIGNED[0], bytes(6))])
@PROPERTY
def test_frame_comes_with_its_last_byte_whatever_its_signature_looks_like(
        sent: list[tuple[bytes, bytes]]) -> None:
    decoder = Decoder()
    for frame, mark in sent:
        whole = frame[:-6] + mark if frame[0] == 0xFD and frame[2] == FLAG_SIGNED else frame
        assert [bytes_of(found) for found in decoder.feed(whole)] == [whole]


@pytest.mark.parametrize('noise', [b'\xfd', b'\xfd\x01', b'\xfd\xff\x02'])
def test_noise_that_cannot_begin_a_frame_costs_no_calls(noise: bytes) -> None:
    def calls(data: bytes) -> int:
        profile = cProfile.Profile()
        profile.runcall(Decoder().feed, data)
        return sum(entry.callcount for entry in profile.getstats())

    # The last bytes may be the beginning of a header.
    assert calls(noise * 1000) == calls(noise * 100)


def test_longest_frame_is_read_and_a_chain_of_false_beginnings_takes_no_more_memory() -> None:
    decoder, longest = Decoder(), raw_v2(0, b'\1' * 255, incompat=FLAG_SIGNED) + bytes(13)
    assert len(longest) == MAX_FRAME == 280
    assert len(in_pieces(longest, [7], decoder)) == 1
    decoder.feed(bytes((0xFD, 255, 1, 0, 0, 1, 1, 0, 0, 0)) * 300)
    assert decoder.incomplete is not None
    assert decoder.taken - decoder.incomplete < MAX_FRAME
