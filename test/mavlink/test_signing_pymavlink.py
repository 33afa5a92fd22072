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

"""The defects of pymavlink's signing, each of which ours does not have."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st
from illuminator_ros.illuminator.messages import STATUS_ID
from illuminator_ros.mavlink import signing as module
from illuminator_ros.mavlink.frame import Decoder
from illuminator_ros.mavlink.messages import Address, encode_payload
from illuminator_ros.mavlink.signing import (
    MAX_STREAMS,
    Signing,
    SigningCounters,
    SigningMode,
)
import pytest
from support.frames import frame_of, only, raw_v2
from support.messages import EVERY_MESSAGE, STATUS
from support.reference_dialect import Peer, twin
from support.signers import checker, KEY, LAST_STAMP, NOW, signed, stamp_at, unsigned, WRONG_KEY

STAMP = stamp_at(NOW)


def test_1_one_forged_frame_blocks_no_stream() -> None:
    signing = checker()
    assert signing.accepts(signed(STAMP), NOW)
    assert not signing.accepts(signed(LAST_STAMP, key=WRONG_KEY), NOW)
    assert signing.accepts(signed(STAMP + 1), NOW)


def test_2_recorded_frame_of_any_age_is_not_believed_again() -> None:
    signing = checker()
    recorded = [signed(STAMP + number) for number in range(10)]
    assert all(signing.accepts(frame, NOW) for frame in recorded)
    assert not any(signing.accepts(frame, NOW) for frame in recorded)


def test_2_forged_first_frame_of_a_stream_does_not_spoil_it() -> None:
    signing = checker()
    assert not signing.accepts(signed(LAST_STAMP, key=WRONG_KEY), NOW)
    assert signing.accepts(signed(STAMP), NOW)


def test_3_forged_frames_do_not_fill_the_table_of_streams() -> None:
    signing = checker()
    for number in range(20_000):
        frame = signed(STAMP, key=WRONG_KEY, link_id=number % 7,
                       source=Address(number // 256, number % 256))
        assert not signing.accepts(frame, NOW)
    assert signing.counters == SigningCounters(bad=20_000)
    # There is room for as many genuine ones as ever.
    assert all(signing.accepts(signed(STAMP, source=Address(1, number)), NOW)
               for number in range(MAX_STREAMS))


def test_4_frame_with_an_unknown_id_is_never_handed_over_unchecked() -> None:
    assert Decoder().feed(raw_v2(99999, b'\1\2\3', crc_extra=0) + bytes(300)) == []


def test_4_illuminators_messages_are_checked_as_any_other() -> None:
    data = bytearray(raw_v2(STATUS_ID, encode_payload(STATUS)))
    assert not checker().accepts(only(bytes(data)), NOW)
    data[-1] ^= 1
    assert Decoder().feed(bytes(data) + bytes(300)) == []


def test_5_badly_signed_frame_is_not_believed_where_an_unsigned_one_is() -> None:
    signing = checker(SigningMode.SIGN)
    assert signing.accepts(unsigned(), NOW)
    assert not signing.accepts(signed(STAMP, key=WRONG_KEY), NOW)
    assert not signing.accepts(signed(STAMP - 100 * 60 * 100_000), NOW)
    assert signing.counters == SigningCounters(unsigned=1, bad=1, replayed=1)


def test_6_signatures_are_compared_in_constant_time(monkeypatch: pytest.MonkeyPatch) -> None:
    compared: list[tuple[bytes, bytes]] = []

    def compare(one: bytes, other: bytes) -> bool:
        compared.append((one, other))
        return one == other

    monkeypatch.setattr(module.hmac, 'compare_digest', compare)
    assert checker().accepts(signed(STAMP), NOW)
    assert not checker().accepts(signed(STAMP, key=WRONG_KEY), NOW)
    assert [len(one) for pair in compared for one in pair] == [6] * 4


@pytest.mark.parametrize('key', ['x' * 32, b'12345'], ids=['text', '5 bytes'])
def test_6_unusable_key_is_refused_at_once(key: bytes) -> None:
    with pytest.raises(ValueError, match='signing needs a key'):
        Signing(SigningMode.SIGN, key)


def test_7_change_of_the_protocol_version_loses_no_state() -> None:
    signing, decoder = checker(), Decoder()
    peer = Peer(key=KEY, timestamp=STAMP)
    heartbeat = EVERY_MESSAGE[0]
    old, first = Peer().encode(twin(heartbeat), version=1), peer.encode(twin(STATUS))
    stream = old + first + old + first + peer.encode(twin(STATUS))
    assert [signing.accepts(frame, NOW) for frame in decoder.feed(stream)] == [
        False, True, False, False, True]


# The store that pymavlink does not bound, with random input

SOURCES = [Address(1, number) for number in range(6)]


@given(st.lists(st.tuples(
    st.sampled_from(SOURCES),
    # s: where the clock is, forth and back, and how far a stream's own is from it.
    st.sampled_from([0, 20, 59, 60, 61, 120]), st.sampled_from([-60, -59, -30, 0, 1])),
    max_size=40))
@settings(derandomize=True, deadline=None, max_examples=100)
def test_nothing_is_ever_believed_twice_though_streams_are_forgotten(
        events: list[tuple[Address, float, float]]) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, 'MAX_STREAMS', 3)
        signing = checker()
        believed = []
        for source, clock, offset in events:
            now = NOW + clock
            frame = signed(stamp_at(now + offset), source=source)
            if signing.accepts(frame, now):
                believed.append(frame)
            assert not any(signing.accepts(old, now) for old in believed)


def test_frame_of_ours_that_comes_back_is_not_believed_twice() -> None:
    signing = checker()
    data = signing.sign(frame_of(signed=True), NOW)
    assert [signing.accepts(only(data), NOW) for _ in range(2)] == [True, False]
