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

"""Copies of frames are recognised for half a second, whatever else comes."""

from __future__ import annotations

from illuminator_ros.mavlink.duplicate_filter import (
    DuplicateFilter,
    MAX_FRAMES,
    MAX_SOURCES,
    MEMORY,
    WRAP,
)
from illuminator_ros.mavlink.frame import Frame
from illuminator_ros.mavlink.messages import Address
import pytest
from support.frames import heartbeat_frame, LIGHT, only


def frame(sequence: int = 0, source: Address = LIGHT) -> Frame:
    return only(heartbeat_frame(source, sequence))


@pytest.mark.parametrize(('other', 'after', 'is_copy'), [
    (frame(), 0.0, True), (frame(), MEMORY - 0.01, True), (frame(), MEMORY, False),
    (frame(1), 0.0, False), (frame(source=Address(1, 244)), 0.0, False)])
def test_only_the_same_bytes_within_half_a_second_are_a_copy(
        other: Frame, after: float, is_copy: bool) -> None:
    filter_ = DuplicateFilter()
    assert not filter_.is_copy(frame(), 0, 1.0)
    assert filter_.has(other, 1.0 + after) is is_copy
    assert filter_.is_copy(other, 1, 1.0 + after) is is_copy
    assert filter_.copies == ({(0, 1): (1, 1.0 + after)} if is_copy else {})


def test_a_copy_does_not_prolong_the_memory_of_its_original() -> None:
    filter_ = DuplicateFilter()
    assert [filter_.is_copy(frame(), 0, now) for now in (0.0, 0.4, 0.6, 1.0)] == [
        False, True, False, True]


def test_equal_frames_of_a_sender_whose_sequence_numbers_have_wrapped_are_no_copies() -> None:
    filter_ = DuplicateFilter()
    found = [filter_.is_copy(frame(number & 0xFF), 0, 0.0) for number in range(1024)]
    assert not any(found)
    # The newest ones still have copies.
    newest = [filter_.has(frame((1023 - back) & 0xFF), 0.0) for back in (0, WRAP - 1, WRAP)]
    assert newest == [True, True, False]


def test_memory_is_bounded_against_any_number_of_frames_and_senders() -> None:
    filter_ = DuplicateFilter()
    for number in range(3 * MAX_FRAMES):
        filter_.is_copy(frame(number // 60000, Address(number >> 8 & 0xFF, number & 0xFF)), 0, 0.0)
    assert len(filter_) == len(filter_._order) == MAX_FRAMES
    assert len(filter_._counts) == MAX_SOURCES
    filter_.is_copy(frame(9), 0, MEMORY)
    assert len(filter_) == len(filter_._order) == 1
