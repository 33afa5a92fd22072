# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Lost, repeated and reordered frames by their sequence numbers, and rates."""

from __future__ import annotations

from collections.abc import Iterable

from hypothesis import given, settings
from hypothesis import strategies as st
from illuminator_ros.mavlink import statistics
from illuminator_ros.mavlink.frame import Frame
from illuminator_ros.mavlink.messages import Address
import pytest
from support.frames import LIGHT

Counts = tuple[int, int, int, int]


def after(sequences: Iterable[int]) -> statistics.SequenceCounter:
    """Return a counter that has taken these numbers, modulo 256."""
    counter = statistics.SequenceCounter()
    for sequence in sequences:
        counter.add(sequence & 0xFF)
    return counter


def counts(counter: statistics.SequenceCounter) -> Counts:
    """Return the numbers of received, lost, duplicate and reordered frames."""
    return counter.received, counter.lost, counter.duplicate, counter.reordered


@pytest.mark.parametrize(('sequences', 'expected'), [
    ([], (0, 0, 0, 0)), ([17], (1, 0, 0, 0)), ([0, 1, 4, 5], (4, 2, 0, 0)),
    ([254, 257], (2, 2, 0, 0)), ([7, 8, 8, 8, 9], (5, 0, 2, 0)), ([255, 256, 255], (3, 0, 1, 0)),
    ([255, 257, 256, 258], (4, 0, 0, 1)), ([1, 5, 4, 3, 2, 6], (6, 0, 0, 3)),
    ([1, 3, 2, 2], (4, 0, 1, 1)), ([1, 5, 3], (3, 2, 0, 1)), ([0, 128], (2, 0, 0, 0)),
    (range(10_000), (10_000, 0, 0, 0)),
    # A late frame is recognised as far back as the window.
    ([10, *range(12, 11 + statistics.WINDOW), 11], (statistics.WINDOW + 1, 0, 0, 1)),
    # The sender has restarted and counts from 0.
    *(([*range(last - 20, last + 1), *range(100)], (121, lost, duplicate, 0))
      for last, lost, duplicate in ((255, 0, 0), (250, 5, 0), (128, 0, 0), (127, 0, 0),
                                    (statistics.WINDOW, 0, 0), (30, 0, 31))),
    ([*range(80, 101), 0, 1, 2, 2, 4, 3, 7], (28, 2, 1, 1))])
def test_lost_duplicate_and_reordered_frames_are_counted_apart(
        sequences: Iterable[int], expected: Counts) -> None:
    assert counts(after(sequences)) == expected


@pytest.mark.parametrize(('frames', 'lost'), [
    # Numbers far apart.
    ([10, 100, 11, 101, 13, 102, 14], 0), ([10, 200, 11, 201, 12], 0),
    # One sender: late and lost frames, and a restart.
    ([10, 10, 12, 11, 11, 40], 27), ([10, 9, 11], 0), ([10, 11, 200, 201, 202], 0),
    # A frame later than the window.
    ([*(number for number in range(100, 195) if number not in (129, 192)), 129, 192, 200, 196,
      201], 70)])
def test_two_counters_of_one_address_lose_nothing_by_their_alternation(
        frames: list[int], lost: int) -> None:
    assert after(frames).lost == lost


@st.composite
def journeys(draw: st.DrawFn) -> tuple[list[int], Counts]:
    """Return the order in which frames arrive, and the counts that follow from it."""
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
        duplicate += number in seen
        reordered += number < newest and number not in seen
        newest, seen = max(newest, number), seen | {number}
    return order, (len(order), newest - first + 1 - len(seen), duplicate, reordered)


@given(journeys())
@settings(max_examples=15)
def test_counts_agree_with_numbers_that_do_not_wrap(journey: tuple[list[int], Counts]) -> None:
    order, expected = journey
    assert counts(after(order)) == expected


def recent_loss(counter: statistics.SequenceCounter, now: float) -> float:
    """Sample the recent loss, %."""
    loss = counter.snapshot(now).recent_loss
    assert loss is not None
    return loss


@given(runs=st.lists(st.tuples(
    st.sampled_from((0, 0, 1, -3, 100)), st.integers(1, 300)), max_size=6))
def test_runs_of_numbers_count_as_the_same_numbers_one_by_one(
        runs: list[tuple[int, int]]) -> None:
    counter, sequences, expected = statistics.SequenceCounter(), bytearray(), 250
    for gap, count in runs:
        first, expected = expected + gap, expected + gap + count
        run = bytes(number & 0xFF for number in range(first, expected))
        counter.add_run(run)
        sequences += run
    assert counter == after(sequences)


@pytest.mark.parametrize(('before', 'sequences', 'loss'), [
    ([], [], 0.0), ([], range(0, 80, 2), 100 * 39 / 79),
    # Duplicates do not hide a loss, and a late earlier frame does not make a loss negative.
    ([], [0, 0, 0, 0, 2, 2, 2, 2], 100 / 3), ([0, 2], [1], 0.0)])
def test_recent_loss_is_the_share_of_the_frames_sent_lately(
        before: list[int], sequences: Iterable[int], loss: float) -> None:
    counter = after(before)
    recent_loss(counter, 0.0)
    for number in sequences:
        counter.add(number)
    assert recent_loss(counter, 1.0) == pytest.approx(loss)


def test_recent_loss_is_shown_for_10_s_and_forgotten_after_20_s_or_a_restart() -> None:
    counter, losses = statistics.SequenceCounter(), []
    for second in range(30):
        counter.add(second if second < 2 else second + 10)
        losses.append(recent_loss(counter, float(second)))
    assert losses[10] == pytest.approx(100 * 10 / 20)
    assert losses[2:11] == sorted(losses[2:11], reverse=True)
    assert losses[21:] == [0.0] * 9
    counter.add(60)
    assert recent_loss(counter, 30.0) > 0
    counter.reset_loss()
    assert recent_loss(counter, 30.0) == 0.0


@pytest.mark.parametrize('interval', [0.5, 1.0, 7.0])
def test_rate_is_that_of_the_last_seconds(interval: float) -> None:
    traffic, now, rates = statistics.Traffic(), 0.0, []
    while now < 100.0:
        # 1000 a second at first, then 10.
        traffic.bytes_sent += int((1000 if now < 50.0 else 10) * interval)
        now += interval
        rates.append((now, traffic.snapshot(now).sent_rate))
    # The rate is unknown before any time has passed.
    assert rates[0][1] == 0.0
    assert all(rate == pytest.approx(1000) for now, rate in rates[1:] if now < 50.0)
    assert all(rate == pytest.approx(10) for now, rate in rates if now > 80.0)


def test_snapshot_of_traffic_has_rates_and_does_not_change() -> None:
    traffic = statistics.Traffic()
    traffic.snapshot(0.0)
    traffic.bytes_received, traffic.bytes_sent = 5000, 200
    snapshot = traffic.snapshot(2.0)
    traffic.count_run(LIGHT, b'\0')
    assert (snapshot.received_rate, snapshot.sent_rate, snapshot.sources) == (2500.0, 100.0, {})


def test_traffic_counts_each_source_apart_and_over_interruptions() -> None:
    traffic = statistics.Traffic()
    traffic.count_run(LIGHT, bytes((10, 13)))
    traffic.count_run(Address(1, 1), bytes((20, 26)))
    for counter in traffic.sources.values():
        counter.restart()
    traffic.count_run(LIGHT, bytes((90, 92)))
    assert counts(traffic.sources[LIGHT]) == (4, 3, 0, 0)
    assert counts(traffic.sources[Address(1, 1)]) == (2, 5, 0, 0)
    assert traffic.snapshot(0.0).frames_received == 6


@pytest.mark.parametrize('in_runs', [False, True])
def test_sources_beyond_the_bound_count_in_the_total_only(in_runs: bool) -> None:
    traffic = statistics.Traffic()

    def count(source: Address, sequence: int) -> None:
        if in_runs:
            traffic.count_run(source, bytes((sequence,)))
        else:
            traffic.count(Frame(2, sequence, source, 0, b''))

    for number in range(2 * statistics.MAX_SOURCES):
        count(Address(2 + number // 256, number % 256), 0)
    count(Address(2, 0), 1)
    assert (len(traffic.sources), traffic.snapshot(0.0).frames_received) == (
        statistics.MAX_SOURCES, 2 * statistics.MAX_SOURCES + 1)
    assert traffic.sources[Address(2, 0)].received == 2
