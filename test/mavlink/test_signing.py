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

"""Message signing: what is signed how, what is believed, and what that changes."""

from __future__ import annotations

import hashlib
from typing import Any

from illuminator_ros.mavlink.frame import Decoder
from illuminator_ros.mavlink.messages import Address, encode_payload
from illuminator_ros.mavlink.signing import (
    KEY_SIZE,
    MAX_STREAMS,
    NEW_STREAM_TICKS,
    Signing,
    SigningCounters,
    SigningMode,
    ticks,
    TICKS_PER_SECOND,
)
import pytest
from support.frames import frame_of, LIGHT, only
from support.messages import decode_payload, EVERY_MESSAGE, STATUS
from support.reference_dialect import Peer, twin
from support.signers import checker, KEY, LAST_STAMP, NOW, signed, stamp_at, unsigned, WRONG_KEY

OFF, SIGN, REQUIRE = SigningMode
STAMP = stamp_at(NOW)


# Agreed with pymavlink

@pytest.mark.parametrize('message', EVERY_MESSAGE, ids=lambda message: message.name)
def test_pymavlink_believes_what_we_sign(message: Any) -> None:
    signing = checker(link_id=9)
    peer = Peer(key=KEY, timestamp=STAMP)
    for sequence in range(3):
        data = signing.sign(frame_of(message, sequence, signed=True), NOW)
        (read,) = peer.decode(data)
        assert read.get_type() == message.name
        assert (read.get_signed(), read.get_link_id()) == (True, 9)


@pytest.mark.parametrize('message', EVERY_MESSAGE, ids=lambda message: message.name)
def test_we_believe_what_pymavlink_signs(message: Any) -> None:
    peer = Peer(key=KEY, link_id=4, timestamp=STAMP)
    signing = checker()
    for sequence in range(3):
        frame = only(peer.encode(twin(message), sequence))
        assert signing.accepts(frame, NOW)
        assert encode_payload(decode_payload(frame.message_id, frame.payload)) == encode_payload(
            message)
    assert signing.counters == SigningCounters(good=3)


def test_signature_is_that_of_the_specification() -> None:
    data = checker(link_id=2).sign(frame_of(signed=True), NOW)
    frame, link_id, stamp, signature = data[:-13], data[-13:-12], data[-12:-6], data[-6:]
    assert frame == frame_of(signed=True)
    assert link_id == b'\2'
    assert int.from_bytes(stamp, 'little') == STAMP
    assert signature == hashlib.sha256(KEY + frame + link_id + stamp).digest()[:6]


def test_signing_adds_13_bytes() -> None:
    assert len(checker().sign(frame_of(signed=True), NOW)) == len(frame_of()) + 13


@pytest.mark.parametrize(('unix_time', 'stamp'), [
    (1_420_070_400.0, 0), (1_420_070_401.0, 100_000), (1_420_070_400.000_25, 25), (0.0, 0),
    (-5.0, 0), (1e12, LAST_STAMP)])
def test_time_stamps_count_10_microseconds_since_2015(unix_time: float, stamp: int) -> None:
    assert ticks(unix_time) == stamp


# Accepted frames of each mode

@pytest.mark.parametrize(('mode', 'good', 'without', 'wrong', 'again'), [
    (OFF, True, True, True, True),
    (SIGN, True, True, False, False),
    (REQUIRE, True, False, False, False)])
def test_mode_says_what_is_believed(
        mode: SigningMode, good: bool, without: bool, wrong: bool, again: bool) -> None:
    signing = checker(mode)
    assert signing.accepts(signed(STAMP), NOW) == good
    assert signing.accepts(unsigned(), NOW) == without
    assert signing.accepts(signed(STAMP + 5, key=WRONG_KEY), NOW) == wrong
    assert signing.accepts(signed(STAMP), NOW) == again
    assert signing.signs == (mode is not OFF)


def test_mavlink_1_cannot_be_signed_and_is_not_believed_where_that_is_required() -> None:
    frame = only(Peer().encode(twin(EVERY_MESSAGE[0]), version=1))
    assert not checker(REQUIRE).accepts(frame, NOW)


@pytest.mark.parametrize('mode', [SIGN, REQUIRE])
@pytest.mark.parametrize('key', [b'', b'short', bytes(31), bytes(33), 'x' * 32, bytearray(32)])
def test_nothing_starts_without_a_usable_key(mode: SigningMode, key: Any) -> None:
    with pytest.raises(ValueError, match='signing needs a key'):
        Signing(mode, key)


def test_no_key_is_needed_where_nothing_is_signed() -> None:
    assert not Signing().signs


def test_key_is_shown_by_nothing() -> None:
    key = b'a most secret key of 32 bytes :-'
    assert len(key) == KEY_SIZE
    shown = repr(Signing(REQUIRE, key))
    assert 'secret' not in shown
    assert key.hex() not in shown
    with pytest.raises(ValueError, match='not 31') as caught:
        Signing(REQUIRE, key[:31])
    assert 'secret' not in str(caught.value)


# In the right order: checksum, signature, time stamp, and only then is anything remembered

def test_frame_with_a_wrong_checksum_does_not_come_as_far_as_its_signature() -> None:
    data = bytearray(checker().sign(frame_of(signed=True), NOW))
    data[12] ^= 1
    assert Decoder().feed(bytes(data) + bytes(300)) == []


@pytest.mark.parametrize('at', range(13))
def test_every_bit_of_the_signature_counts(at: int) -> None:
    signing = checker()
    frame = signed(STAMP)
    assert frame.signature is not None
    changed = bytearray(frame.signature)
    changed[at] ^= 1
    frame.signature = bytes(changed)
    assert not signing.accepts(frame, NOW)
    assert signing.counters == SigningCounters(bad=1)


def test_replay_is_looked_for_only_in_what_is_rightly_signed() -> None:
    signing = checker()
    signing.accepts(signed(STAMP), NOW)
    signing.accepts(signed(STAMP), NOW)
    signing.accepts(signed(STAMP - 1, key=WRONG_KEY), NOW)
    assert signing.counters == SigningCounters(good=1, replayed=1, bad=1)


@pytest.mark.parametrize('stamp', [0, STAMP - 1, STAMP + 1, LAST_STAMP])
def test_forged_frame_moves_nothing(stamp: int) -> None:
    signing, untouched = checker(timestamp=STAMP), checker(timestamp=STAMP)
    for one in (signing, untouched):
        assert one.accepts(signed(STAMP), NOW)
    for source in (LIGHT, Address(9, 9)):
        assert not signing.accepts(signed(stamp, key=WRONG_KEY, source=source), NOW)
    assert signing.timestamp == untouched.timestamp
    assert signing.accepts(signed(STAMP + 1), NOW)
    assert signing.accepts(signed(STAMP, source=Address(9, 9)), NOW)


def test_replayed_frame_moves_nothing() -> None:
    signing = checker()
    frame = signed(STAMP)
    signing.accepts(frame, NOW)
    before = signing.timestamp
    assert not signing.accepts(frame, NOW)
    assert signing.timestamp == before


# Replays

def test_time_stamp_must_grow_within_a_stream() -> None:
    signing = checker()
    stamps = [STAMP, STAMP + 1, STAMP + 5, STAMP + 5, STAMP + 4, STAMP, STAMP + 6]
    assert [signing.accepts(signed(stamp), NOW) for stamp in stamps] == [
        True, True, True, False, False, False, True]


@pytest.mark.parametrize('other', [
    {'link_id': 1}, {'source': Address(1, 244)}, {'source': Address(2, 243)}])
def test_streams_are_told_apart_by_link_system_and_component(other: dict[str, Any]) -> None:
    signing = checker()
    assert signing.accepts(signed(STAMP + 100), NOW)
    assert signing.accepts(signed(STAMP, **other), NOW)
    assert not signing.accepts(signed(STAMP, **other), NOW)


@pytest.mark.parametrize(('behind', 'believed'), [
    (0, True), (NEW_STREAM_TICKS, True), (NEW_STREAM_TICKS + 1, False),
    (10 * NEW_STREAM_TICKS, False), (-10 * NEW_STREAM_TICKS, True)])
def test_new_stream_may_be_a_minute_behind_and_no_more(behind: int, believed: bool) -> None:
    assert checker().accepts(signed(STAMP - behind), NOW) == believed


def test_known_stream_may_be_as_far_behind_as_it_wants() -> None:
    # Its clock is slow; what it sends is new nonetheless.
    signing = checker()
    signing.accepts(signed(STAMP), NOW)
    assert signing.accepts(signed(STAMP + 1), NOW + 86_400)


# Our own time stamps

def test_our_time_stamps_follow_the_clock() -> None:
    signing = checker()
    for seconds in (0.0, 1.0, 60.0):
        signing.sign(frame_of(signed=True), NOW + seconds)
        assert signing.timestamp == STAMP + int(seconds * TICKS_PER_SECOND)


def test_our_time_stamps_grow_by_one_while_the_clock_stands_still_or_goes_back() -> None:
    signing = checker()
    stamps = []
    for time in (NOW, NOW, NOW - 1000, 0.0, NOW):
        data = signing.sign(frame_of(signed=True), time)
        stamps.append(int.from_bytes(data[-12:-6], 'little'))
    assert stamps == [STAMP + step for step in range(5)]


def test_our_time_stamps_go_on_from_the_stored_one() -> None:
    signing = checker(timestamp=STAMP + 12345)
    data = signing.sign(frame_of(signed=True), NOW)
    assert int.from_bytes(data[-12:-6], 'little') == STAMP + 12346


def test_our_time_stamps_follow_a_peer_whose_clock_is_ahead() -> None:
    signing = checker()
    signing.accepts(signed(STAMP + 500), NOW)
    data = signing.sign(frame_of(STATUS, signed=True), NOW)
    assert int.from_bytes(data[-12:-6], 'little') == STAMP + 501


def test_last_time_stamp_there_is_ends_nothing() -> None:
    signing = checker(timestamp=LAST_STAMP - 1)
    for _ in range(3):
        assert len(signing.sign(frame_of(signed=True), NOW)) == len(frame_of()) + 13


# Bounded memory

def fill(signing: Signing, now: float) -> None:
    """Have as many streams as are remembered heard at a time."""
    for number in range(MAX_STREAMS):
        assert signing.accepts(
            signed(stamp_at(now), source=Address(100 + number // 256, number % 256)), now)


def test_table_that_is_full_of_live_streams_takes_no_other() -> None:
    signing = checker()
    fill(signing, NOW)
    assert not signing.accepts(signed(STAMP + 1), NOW)
    # Nor does it forget any, whose frames could then be replayed.
    assert not signing.accepts(signed(STAMP, source=Address(100, 0)), NOW)
    assert signing.accepts(signed(STAMP + 1, source=Address(100, 0)), NOW)


def test_streams_that_have_fallen_silent_make_room() -> None:
    signing = checker()
    fill(signing, NOW)
    assert signing.accepts(signed(stamp_at(NOW + 61)), NOW + 61)


def test_stream_is_not_forgotten_as_long_as_it_would_be_believed_as_a_new_one() -> None:
    signing = checker()
    fill(signing, NOW)
    assert not signing.accepts(signed(stamp_at(NOW + 60)), NOW + 60)


@pytest.mark.parametrize('newcomer', [1, 61])
def test_forgotten_stream_lets_no_replay_in_even_if_the_clock_steps_back(
        newcomer: float) -> None:
    signing = checker()
    fill(signing, NOW)
    assert signing.accepts(signed(stamp_at(NOW + newcomer)), NOW + 61)
    for now in (NOW + 61, NOW, NOW - 3600):
        assert not signing.accepts(signed(STAMP, source=Address(100, 0)), now)


def test_a_mad_clock_is_believed_and_not_followed() -> None:
    signing = checker()
    assert signing.accepts(signed(LAST_STAMP), NOW)
    assert signing.timestamp <= STAMP
    assert signing.accepts(signed(STAMP, source=Address(1, 9)), NOW)
