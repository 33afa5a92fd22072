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

"""Lost, repeated and reordered frames, by the sequence numbers."""

from __future__ import annotations

from collections.abc import Iterable

from hypothesis import given, settings
from hypothesis import strategies as st
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.mavlink.statistics import (
    MAX_SOURCES,
    RECENT,
    SequenceCounter,
    Traffic,
    WINDOW,
    WindowedCounter,
)
import pytest

LIGHT = Address(1, 243)


def after(sequences: Iterable[int]) -> SequenceCounter:
    """Return a counter that has taken these numbers, modulo 256."""
    counter = SequenceCounter()
    for sequence in sequences:
        counter.add(sequence & 0xFF)
    return counter


def counts(counter: SequenceCounter) -> tuple[int, int, int, int]:
    """Return frames received, lost, duplicate and reordered."""
    return counter.received, counter.lost, counter.duplicate, counter.reordered


# Sequence numbers

@pytest.mark.parametrize(('sequences', 'expected'), [
    ([], (0, 0, 0, 0)),
    ([17], (1, 0, 0, 0)),
    ([0, 1, 2, 3], (4, 0, 0, 0)),
    ([0, 1, 4, 5], (4, 2, 0, 0)),
    ([254, 255, 256, 257], (4, 0, 0, 0)),
    ([254, 257], (2, 2, 0, 0)),
    ([7, 7], (2, 0, 1, 0)),
    ([7, 8, 8, 8, 9], (5, 0, 2, 0)),
    ([7, 8, 9, 7], (4, 0, 1, 0)),
    ([255, 256, 255], (3, 0, 1, 0)),
    ([7, 9, 8, 10], (4, 0, 0, 1)),
    ([255, 257, 256, 258], (4, 0, 0, 1)),
    ([1, 5, 4, 3, 2, 6], (6, 0, 0, 3)),
    ([1, 3, 2, 2], (4, 0, 1, 1)),
    ([1, 5, 3], (3, 2, 0, 1)),
    ([0, 100], (2, 99, 0, 0)),
    ([0, 128], (2, 127, 0, 0)),
])
def test_lost_duplicate_and_reordered_frames_are_told_apart(
        sequences: list[int], expected: tuple[int, int, int, int]) -> None:
    assert counts(after(sequences)) == expected


def test_nothing_is_lost_over_many_wraps() -> None:
    assert counts(after(range(10_000))) == (10_000, 0, 0, 0)


def test_every_second_frame_lost_is_half_lost() -> None:
    assert counts(after(range(0, 10_000, 2))) == (5000, 4999, 0, 0)


def test_late_frame_is_recognised_as_far_back_as_the_window() -> None:
    newest = 10 + WINDOW
    assert counts(after([10, *range(12, newest + 1), 11])) == (WINDOW + 1, 0, 0, 1)


# The sender has restarted and counts from 0 again: what was it at, and what is made of that.
@pytest.mark.parametrize(('last', 'lost', 'duplicate'), [
    (255, 0, 0), (250, 5, 0), (128, 127, 0), (127, 0, 0), (WINDOW, 0, 0), (30, 0, 31)])
def test_restart_of_the_sender_is_half_a_turn_of_losses_at_most(
        last: int, lost: int, duplicate: int) -> None:
    counter = after([*range(last - 20, last + 1), *range(100)])
    assert counts(counter) == (121, lost, duplicate, 0)


def test_frames_after_a_restart_are_counted_as_any_others() -> None:
    counter = after([*range(80, 101), 0, 1, 2, 2, 4, 3, 7])
    assert counts(counter) == (28, 2, 1, 1)


@st.composite
def journeys(draw: st.DrawFn) -> tuple[list[int], tuple[int, int, int, int]]:
    """Return the order in which frames arrive, and what is then to be counted."""
    first = draw(st.integers(0, 255))
    arrivals: list[tuple[float, int]] = [(first, first)]
    for number in range(first + 1, first + draw(st.integers(1, 400))):
        # At most 50 places late, so that the window covers it; some never come, some twice.
        for _ in range(draw(st.sampled_from([1, 1, 1, 1, 1, 0, 2]))):
            late = draw(st.sampled_from([0, 0, 0, 0, 3.5, 30.5, 50.5]))
            arrivals.append((number + late, number))
    order = [number for _, number in sorted(arrivals)]
    newest, seen, duplicate, reordered = first, {first}, 0, 0
    for number in order[1:]:
        if number in seen:
            duplicate += 1
        elif number < newest:
            reordered += 1
        newest, seen = max(newest, number), seen | {number}
    return order, (len(order), newest - first + 1 - len(seen), duplicate, reordered)


@given(journeys())
@settings(derandomize=True, deadline=None, max_examples=40)
def test_counts_agree_with_numbers_that_do_not_wrap(
        journey: tuple[list[int], tuple[int, int, int, int]]) -> None:
    order, expected = journey
    assert counts(after(order)) == expected


@given(st.lists(st.integers(0, 255), max_size=300))
@settings(derandomize=True, deadline=None)
def test_any_numbers_give_counts_that_make_sense(sequences: list[int]) -> None:
    counter = after(sequences)
    assert counter.received == len(sequences)
    assert counter.lost >= 0
    assert counter.duplicate + counter.reordered <= max(len(sequences) - 1, 0)


def recent_loss(counter: SequenceCounter, now: float) -> float:
    """Sample the recent loss, %."""
    counter.sample(now)
    return counter.recent_loss


def test_share_lost_is_that_of_what_was_sent_lately() -> None:
    counter = SequenceCounter()
    assert recent_loss(counter, 0.0) == 0.0
    for number in range(0, 80, 2):
        counter.add(number)
    assert recent_loss(counter, 1.0) == pytest.approx(100 * 39 / 79)


def test_duplicates_hide_no_loss() -> None:
    counter = SequenceCounter()
    recent_loss(counter, 0.0)
    for number in [0, 0, 0, 0, 2, 2, 2, 2]:
        counter.add(number)
    assert recent_loss(counter, 1.0) == pytest.approx(100 / 3)


def test_frame_that_comes_late_after_all_makes_no_negative_loss() -> None:
    counter = after([0, 2])
    recent_loss(counter, 0.0)
    counter.add(1)
    assert recent_loss(counter, 1.0) == 0.0


def test_loss_is_shown_for_a_while() -> None:
    counter = SequenceCounter()
    losses = []
    for second in range(int(RECENT) + 1):
        counter.add(second if second < 2 else second + 10)
        losses.append(recent_loss(counter, float(second)))
    assert losses[2:] == sorted(losses[2:], reverse=True)
    assert losses[-1] == pytest.approx(100 * 10 / 20)


def test_old_losses_are_forgotten() -> None:
    counter = SequenceCounter()
    recent_loss(counter, 0.0)
    counter.add(0)
    counter.add(100)
    assert recent_loss(counter, 1.0) > 90.0
    number = 100
    for second in range(1, int(3 * RECENT)):
        number += 1
        counter.add(number & 0xFF)
        loss = recent_loss(counter, float(second))
    assert loss == 0.0


@pytest.mark.parametrize('interval', [0.5, 1.0, 7.0])
def test_rate_is_that_of_the_last_seconds(interval: float) -> None:
    window, now, count, rates = WindowedCounter(), 0.0, 0, []
    while now < 100.0:
        # 1000 a second at first, then 10.
        count += int((1000 if now < 50.0 else 10) * interval)
        now += interval
        window = window.sample(count, now)
        rates.append((now, window.rate))
    assert all(rate == pytest.approx(1000) for now, rate in rates[1:] if now < 50.0)
    assert all(rate == pytest.approx(10) for now, rate in rates if now > 50.0 + 3 * RECENT)


def test_rate_is_zero_before_any_time_has_passed() -> None:
    first = WindowedCounter().sample(100, 5.0)
    assert [first.rate, first.sample(200, 5.0).rate] == [0.0, 0.0]


# A whole link

def test_rates_of_a_link_are_bytes_per_second() -> None:
    traffic = Traffic()
    traffic.snapshot(0.0)
    traffic.bytes_received, traffic.bytes_sent = 5000, 200
    snapshot = traffic.snapshot(2.0)
    assert (snapshot.received_rate, snapshot.sent_rate) == (2500.0, 100.0)
    traffic.count(LIGHT, bytes((0,)))
    assert snapshot.sources == {}


def test_each_source_has_its_own_sequence() -> None:
    traffic = Traffic()
    for number in range(10):
        traffic.count(LIGHT, bytes((number,)))
        traffic.count(Address(1, 1), bytes((3 * number,)))
    assert counts(traffic.sources[LIGHT]) == (10, 0, 0, 0)
    assert counts(traffic.sources[Address(1, 1)]) == (10, 18, 0, 0)
    assert traffic.frames_received == 20


def test_sources_beyond_the_bound_count_in_the_total_only() -> None:
    traffic = Traffic()
    traffic.count(LIGHT, bytes((0,)))
    for number in range(2 * MAX_SOURCES):
        traffic.count(Address(2 + number // 256, number % 256), bytes((0,)))
    traffic.count(LIGHT, bytes((1,)))
    assert len(traffic.sources) == MAX_SOURCES
    assert traffic.frames_received == 2 * MAX_SOURCES + 2
    assert traffic.sources[LIGHT].received == 2


def test_interruption_of_the_link_is_no_loss() -> None:
    traffic = Traffic()
    traffic.count(LIGHT, bytes((10,)))
    traffic.count(LIGHT, bytes((13,)))
    traffic.restart()
    traffic.count(LIGHT, bytes((90,)))
    traffic.count(LIGHT, bytes((92,)))
    assert counts(traffic.sources[LIGHT]) == (4, 3, 0, 0)
