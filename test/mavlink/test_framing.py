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

"""Single frames: what is read and written, agreed with pymavlink, and what is refused."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from illuminator_ros.illuminator.messages import STATUS_ID
from illuminator_ros.mavlink.frame import Decoder, encode_frame
from illuminator_ros.mavlink.messages import (
    Address,
    CommandAck,
    CommandLong,
    encode_payload,
    Heartbeat,
    LAYOUTS,
)
from illuminator_ros.mavlink.signing import signature
import pytest
from support.frames import decoded, frame_of, LIGHT, only, raw_v1, raw_v2, spoilt
from support.messages import decode_payload, EVERY_MESSAGE, STATUS
from support.reference_dialect import fields_of, Peer, twin

KEY = bytes(range(32))
FOREIGN_ID = 12345
# pymavlink cannot put a message id above 255 into MAVLink 1, and neither can anybody.
FITS_V1 = [message for message in EVERY_MESSAGE if message.id < 256]


def name(message: Any) -> str:
    """Return the name of a message, for the name of a test."""
    return str(message.name)


# Agreed with pymavlink

@pytest.mark.parametrize('message', EVERY_MESSAGE, ids=name)
def test_pymavlink_reads_what_we_write(message: Any) -> None:
    (read,) = Peer().decode(frame_of(message, 200, Address(7, 9)))
    assert fields_of(read) == asdict(message)
    assert (read.get_seq(), read.get_srcSystem(), read.get_srcComponent()) == (200, 7, 9)


@pytest.mark.parametrize('message', EVERY_MESSAGE, ids=name)
def test_we_write_what_pymavlink_writes(message: Any) -> None:
    assert frame_of(message, 17, LIGHT) == Peer(LIGHT).encode(twin(message), 17)


@pytest.mark.parametrize(('version', 'message'), [
    *((1, message) for message in FITS_V1), *((2, message) for message in EVERY_MESSAGE),
], ids=lambda value: name(value) if hasattr(value, 'crc_extra') else f'v{value}')
def test_we_read_what_pymavlink_writes(version: int, message: Any) -> None:
    frame = only(Peer(Address(255, 0)).encode(twin(message), 99, version=version))
    assert (frame.version, frame.sequence, frame.source) == (version, 99, Address(255, 0))
    assert frame.signature is None
    assert encode_payload(decode_payload(frame.message_id, frame.payload)) == encode_payload(
        message)


@pytest.mark.parametrize('message', EVERY_MESSAGE, ids=name)
def test_we_read_what_pymavlink_signs(message: Any) -> None:
    data = Peer(key=KEY, link_id=3, timestamp=0x0102030405).encode(twin(message))
    frame = only(data)
    assert frame.signed_part + (frame.signature or b'') == data
    assert frame.signature is not None
    assert frame.signature[:7] == bytes.fromhex('03 05 04 03 02 01 00')
    assert frame.signature[7:] == signature(KEY, frame.signed_part + frame.signature[:7])
    assert encode_payload(decode_payload(frame.message_id, frame.payload)) == encode_payload(
        message)


# Trailing zeros, and lengths that are not the known one

def test_trailing_zeros_of_a_payload_are_not_sent() -> None:
    assert len(frame_of(Heartbeat(0, 0, 0, 1, 0, 0))) == 10 + 1 + 2


def test_first_byte_of_a_payload_is_sent_even_if_it_is_zero() -> None:
    assert len(frame_of(Heartbeat(0, 0, 0, 0, 0, 0))) == 10 + 1 + 2


def test_message_id_takes_three_bytes() -> None:
    data = encode_frame(0x123456, b'\1', sequence=0, source=LIGHT, crc_extra=0)
    assert data[7:10] == bytes.fromhex('56 34 12')


@pytest.mark.parametrize('size', [0, 1, 9, 10, 254, 255])
def test_mavlink_2_payload_of_any_length_is_read(size: int) -> None:
    # Extension fields that we do not know yet make it longer than it was.
    payload = bytes(range(1, size + 1)) if size < 255 else bytes([7]) * 255
    assert only(raw_v2(Heartbeat.id, payload)).payload == payload


@pytest.mark.parametrize('size', [3, 10])
def test_mavlink_1_payload_with_or_without_extension_fields_is_read(size: int) -> None:
    payload = encode_payload(CommandAck(405, 4, 0, 0, 1, 1))[:size]
    assert only(raw_v1(CommandAck.id, payload)).payload == payload


def test_mavlink_1_payload_longer_than_the_known_one_is_noise() -> None:
    assert decoded(raw_v1(Heartbeat.id, bytes(10))) == []


def test_payload_of_more_than_255_bytes_cannot_be_sent() -> None:
    with pytest.raises(ValueError, match='range'):
        encode_frame(STATUS_ID, b'\1' * 256, sequence=0, source=LIGHT, crc_extra=66)


# Refused frames

@pytest.mark.parametrize('at', [1, 4, 5, 6, 7, 12, -1, -2])
@pytest.mark.parametrize('version', [1, 2])
def test_wrong_bit_anywhere_refuses_the_frame(at: int, version: int) -> None:
    message = CommandLong(1, 243, 406, 0, 1.0, 50.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    data = Peer().encode(twin(message), version=version)
    assert len(decoded(data)) == 1
    assert decoded(spoilt(data, at)) == []


@pytest.mark.parametrize('flag', [1 << bit for bit in range(1, 8)])
@pytest.mark.parametrize('signed', [0, 1])
def test_incompatibility_flag_that_is_not_known_refuses_the_frame(
        flag: int, signed: int) -> None:
    data = raw_v2(STATUS_ID, encode_payload(STATUS), incompat=flag | signed)
    assert decoded(data + bytes(13) * signed) == []


@pytest.mark.parametrize('flags', [1, 2, 0x80, 0xFF])
def test_compatibility_flags_do_not_matter(flags: int) -> None:
    assert only(raw_v2(STATUS_ID, encode_payload(STATUS), compat=flags)).message_id == STATUS_ID


def test_wrong_checksum_seed_refuses_the_frame() -> None:
    assert decoded(raw_v2(STATUS_ID, encode_payload(STATUS), crc_extra=67)) == []


@pytest.mark.parametrize('crc_extra', [0, 66])
def test_message_id_that_is_not_known_cannot_be_checked_and_is_refused(crc_extra: int) -> None:
    # pymavlink hands such frames over unchecked.
    decoder = Decoder()
    data = raw_v2(FOREIGN_ID, b'\1\2\3', crc_extra=crc_extra)
    assert decoder.feed(data + frame_of()) == [only(frame_of())]
    assert decoder.counters.unknown_ids == 1


def test_message_that_is_checked_but_not_handled_is_handed_over() -> None:
    attitude = 30
    payload = bytes(range(LAYOUTS[attitude].size))
    assert only(raw_v2(attitude, payload)).message_id == attitude


# Counters

def test_counters_tell_frames_and_faults_apart() -> None:
    decoder = Decoder()
    good, bad = frame_of(), spoilt(frame_of())
    decoder.feed(b'noise' + good + bad + raw_v2(FOREIGN_ID, b'\1', crc_extra=0) + good)
    counters = decoder.counters
    assert (counters.frames, counters.crc_errors, counters.unknown_ids) == (2, 1, 1)
    assert counters.skipped_bytes == len(b'noise') + len(bad) + 13


def test_unknown_ids_of_mavlink_1_are_counted_too() -> None:
    decoder = Decoder()
    assert 255 not in LAYOUTS
    decoder.feed(raw_v1(255, b'\1', crc_extra=0) + frame_of())
    assert (decoder.counters.unknown_ids, decoder.counters.frames) == (1, 1)


def test_counters_do_not_depend_on_the_pieces() -> None:
    foreign = raw_v2(FOREIGN_ID, b'\1\2\3', crc_extra=0)
    data = b'\xfd\xfe noise' + frame_of() + spoilt(frame_of()) + foreign + frame_of()
    whole, bytewise = Decoder(), Decoder()
    whole.feed(data)
    for at in range(len(data)):
        bytewise.feed(data[at:at + 1])
    assert bytewise.counters == whole.counters
