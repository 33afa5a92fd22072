# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Message signing: agreed with pymavlink, without the defects of pymavlink's own."""

from __future__ import annotations

import hashlib
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from illuminator_ros.mavlink import signing as module
from illuminator_ros.mavlink.messages import Address, Message
from illuminator_ros.mavlink.signing import (
    MAX_STREAMS,
    NEW_STREAM_TICKS,
    Signing,
    SigningCounters,
    SigningMode,
    ticks,
)
import pytest
from support.frames import frame_of, LIGHT, only
from support.messages import EVERY_MESSAGE
from support.reference_dialect import Peer, twin
from support.signers import checker, KEY, LAST_STAMP, NOW, SECOND, signed, STAMP, WRONG_KEY

OFF, SIGN, REQUIRE = SigningMode
UNSIGNED = only(frame_of())


def stamp_signed(signing: Signing, unix_time: float) -> int:
    """Return the time stamp of a frame that is signed now."""
    return int.from_bytes(signing.sign(frame_of(signed=True), unix_time)[-12:-6], 'little')


# Agreed with pymavlink and the specification

@pytest.mark.parametrize('message', EVERY_MESSAGE, ids=lambda message: message.msgname)
def test_signatures_are_accepted_by_pymavlink_and_those_of_pymavlink_by_us(
        message: Message) -> None:
    signing, peer = checker(link_id=9), Peer(key=KEY, link_id=4, timestamp=STAMP)
    for sequence in range(3):
        (read,) = peer.decode(signing.sign(frame_of(message, sequence, signed=True), NOW))
        assert (read.get_type(), read.get_signed(), read.get_link_id()) == (message.msgname, True,
                                                                            9)
        assert signing.accepts(only(peer.encode(twin(message), sequence)), NOW)
    assert signing.counters == SigningCounters(good=3)


def test_signature_is_that_of_the_specification() -> None:
    data = checker(link_id=2).sign(frame_of(signed=True), NOW)
    signed_part = frame_of(signed=True) + b'\2' + STAMP.to_bytes(6, 'little')
    assert data == signed_part + hashlib.sha256(KEY + signed_part).digest()[:6]


@pytest.mark.parametrize(('unix_time', 'stamp'), [
    (1_420_070_400.0, 0), (1_420_070_401.0, 100_000), (1_420_070_400.000_25, 25), (0.0, 0),
    (-5.0, 0), (1e12, LAST_STAMP), (NOW, STAMP)])
def test_time_stamps_count_10_microseconds_since_2015(unix_time: float, stamp: int) -> None:
    assert ticks(unix_time) == stamp


# Modes and keys

@pytest.mark.parametrize(('mode', 'accepted', 'counters'), [
    (OFF, [True] * 4, SigningCounters(unchecked=3)),
    (SIGN, [True, True, False, False], SigningCounters(1, 1, 1, 1)),
    (REQUIRE, [True, False, False, False], SigningCounters(1, 1, 1, 1))])
def test_mode_decides_which_frames_are_accepted(
        mode: SigningMode, accepted: list[bool], counters: SigningCounters) -> None:
    signing = checker(mode)
    assert [signing.accepts(frame, NOW) for frame in (
        signed(STAMP), UNSIGNED, signed(STAMP + 5, key=WRONG_KEY), signed(STAMP))] == accepted
    assert (signing.counters, signing.signs) == (counters, mode is not OFF)


@pytest.mark.parametrize('mode', [SIGN, REQUIRE])
@pytest.mark.parametrize('key', [b'', b'short', bytes(31), bytes(33), 'x' * 32, bytearray(32)])
def test_signing_without_usable_key_is_refused(mode: SigningMode, key: Any) -> None:
    with pytest.raises(ValueError, match='signing needs a key'):
        Signing(mode, key)
    assert not Signing().signs


def test_key_is_not_shown() -> None:
    key = b'a most secret key of 32 bytes :-'
    with pytest.raises(ValueError, match='not 31') as caught:
        Signing(REQUIRE, key[:31])
    for shown in (repr(Signing(REQUIRE, key)), str(caught.value)):
        assert 'secret' not in shown
        assert key.hex() not in shown


# Order of the checks: checksum, signature, time stamp; nothing is stored before all are valid

@pytest.mark.parametrize('at', range(-13, 0))
def test_frame_with_a_wrong_bit_in_its_signature_is_refused(at: int) -> None:
    signing, frame = checker(), signed(STAMP)
    assert frame.signature is not None
    changed = bytearray(frame.signature)
    changed[at] ^= 1
    assert not signing.accepts(frame._replace(signature=bytes(changed)), NOW)
    assert signing.counters == SigningCounters(bad=1)


@pytest.mark.parametrize('first', [[], [signed(STAMP)]], ids=['new stream', 'known stream'])
@pytest.mark.parametrize('forged', [
    *(signed(stamp, key=WRONG_KEY) for stamp in (0, STAMP - 1, STAMP + 1, LAST_STAMP)),
    signed(LAST_STAMP, key=WRONG_KEY, source=Address(9, 9))])
def test_forged_frame_changes_nothing(first: list[Any], forged: Any) -> None:
    signing = checker(timestamp=STAMP)
    for frame in first:
        assert signing.accepts(frame, NOW)
    assert not signing.accepts(forged, NOW)
    assert signing.timestamp == STAMP
    assert signing.accepts(signed(STAMP + 1), NOW)
    assert signing.accepts(signed(STAMP, source=Address(9, 9)), NOW)


# Replays

@pytest.mark.parametrize(('stamps', 'accepted'), [
    ([0, 1, 5, 5, 4, 0, 6], [True, True, True, False, False, False, True]),
    # A new stream may lag by at most a minute; a known one with a slow clock may lag further.
    ([-60 * SECOND], [True]), ([-60 * SECOND - 1], [False]), ([-600 * SECOND], [False]),
    ([600 * SECOND], [True]), ([-60 * SECOND, -60 * SECOND + 1], [True, True])])
def test_time_stamps_of_a_stream_must_grow_from_at_most_a_minute_ago(
        stamps: list[int], accepted: list[bool]) -> None:
    signing = checker()
    assert [signing.accepts(signed(STAMP + stamp), NOW) for stamp in stamps] == accepted
    assert NEW_STREAM_TICKS == 60 * SECOND


@pytest.mark.parametrize('other', [
    {'link_id': 1}, {'source': Address(1, 244)}, {'source': Address(2, 243)}])
def test_streams_are_told_apart_by_link_system_and_component(other: dict[str, Any]) -> None:
    signing = checker()
    assert signing.accepts(signed(STAMP + 100), NOW)
    assert signing.accepts(signed(STAMP, **other), NOW)
    assert not signing.accepts(signed(STAMP, **other), NOW)
    assert signing.accepts(signed(STAMP + 101), NOW + 86_400)


def test_own_frame_that_returns_is_accepted_once() -> None:
    signing = checker()
    data = signing.sign(frame_of(signed=True), NOW)
    assert [signing.accepts(only(data), NOW) for _ in range(2)] == [True, False]


@given(st.lists(st.tuples(
    st.integers(0, 5), st.sampled_from([0, 20, 59, 60, 61, 120]),
    st.sampled_from([-60, -59, -30, 0, 1])), max_size=40))
def test_no_frame_is_accepted_twice_though_streams_are_forgotten_and_clocks_step(
        events: list[tuple[int, int, int]]) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, 'MAX_STREAMS', 3)
        signing, accepted = checker(), []
        for component, clock, offset in events:
            now = NOW + clock
            frame = signed(STAMP + (clock + offset) * SECOND, source=Address(1, component))
            if signing.accepts(frame, now):
                accepted.append(frame)
            assert not any(signing.accepts(old, now) for old in accepted)


# Our own time stamps

@pytest.mark.parametrize(('first', 'times', 'steps'), [
    (0, [0.0, 1.0, 60.0], [0, SECOND, 60 * SECOND]),
    # The clock stands still or goes back.
    (0, [0.0, 0.0, -1000.0, -NOW, 0.0], [0, 1, 2, 3, 4]),
    (STAMP + 12345, [0.0], [12346]), (LAST_STAMP - 1, [0.0] * 3, [LAST_STAMP - STAMP] * 3)])
def test_our_time_stamps_follow_the_clock_and_always_grow(
        first: int, times: list[float], steps: list[int]) -> None:
    signing = checker(timestamp=first)
    assert [stamp_signed(signing, NOW + time) - STAMP for time in times] == steps


@pytest.mark.parametrize(('ahead', 'followed'), [
    (500, True), (9 * 365 * 86_400 * SECOND, True), (11 * 365 * 86_400 * SECOND, False),
    (LAST_STAMP - STAMP, False)])
def test_our_time_stamps_follow_a_peer_that_is_ahead_by_less_than_10_years(
        ahead: int, followed: bool) -> None:
    signing = checker()
    assert signing.accepts(signed(STAMP + ahead), NOW)
    assert stamp_signed(signing, NOW) == (STAMP + ahead + 1 if followed else STAMP)


def test_a_clock_before_2015_follows_a_peer_at_any_distance_and_names_itself() -> None:
    signing = checker()
    assert signing.clock_fault(NOW) == ''
    assert 'clock of this computer is before 2015' in signing.clock_fault(86_400.0)

    assert stamp_signed(signing, 86_400.0) == 1
    assert signing.accepts(signed(STAMP), 86_400.0)
    assert stamp_signed(signing, 86_401.0) == STAMP + 1
    # Old frames of other streams are not valid, though the clock would accept them.
    assert not signing.accepts(signed(STAMP - 61 * SECOND, link_id=9), 86_401.0)


@pytest.mark.parametrize(('ahead', 'accepted'), [(3600, True), (2 * 86_400, False)])
def test_clock_that_is_right_again_accepts_streams_unless_it_was_not_set(
        ahead: int, accepted: bool) -> None:
    # A clock that is days behind our own time stamps was not set, so it proves nothing.
    assert checker(timestamp=STAMP + ahead * SECOND).accepts(signed(STAMP), NOW) == accepted


# Bounded memory

def fill(signing: Signing, now: float) -> None:
    """Accept as many streams as are stored at a time."""
    for number in range(MAX_STREAMS):
        assert signing.accepts(
            signed(ticks(now), source=Address(100 + number // 256, number % 256)), now)


@pytest.mark.parametrize(('seconds', 'accepted'), [(0, False), (60, False), (61, True)])
def test_full_table_accepts_a_new_stream_once_old_ones_cannot_be_replayed(
        seconds: int, accepted: bool) -> None:
    signing, old = checker(), Address(100, 0)
    fill(signing, NOW)
    assert signing.accepts(signed(STAMP + seconds * SECOND, source=LIGHT),
                           NOW + seconds) == accepted
    for now in (NOW + seconds, NOW, NOW - 3600):
        assert not signing.accepts(signed(STAMP, source=old), now)
    assert accepted or signing.accepts(signed(STAMP + 1, source=old), NOW)
