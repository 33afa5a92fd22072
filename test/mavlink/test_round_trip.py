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

"""Time-outs that follow the round-trip times, and which round trips are measured."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from illuminator_ros.mavlink.command_sender import (
    ACK_LIFETIME,
    MAX_SAMPLES,
    MIN_SAMPLES,
    MIN_TIMEOUT,
    RttEstimator,
)
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address
import pytest
from support.command_rig import ACCEPTED, IN_PROGRESS, LIGHT, REJECTED, Rig


def of(*seconds: float) -> RttEstimator:
    """Return an estimator with these samples."""
    estimator = RttEstimator()
    for sample in seconds:
        estimator.add(sample, 0.0)
    return estimator


@pytest.mark.parametrize(('samples', 'longest', 'timeout'), [
    *(([0.01] * known, 0.5, 0.5) for known in range(MIN_SAMPLES)),
    # Four times the round trip, at least the floor and at most the given time-out, which may be
    # below the floor.
    ([0.001] * 4, 0.5, 0.2), ([0.06] * 4, 0.5, 0.24), ([0.125] * 4, 0.5, 0.5),
    ([0.4] * 4, 0.5, 0.5), ([0.001] * 10, 0.05, 0.05),
    # One slow answer among many does not count, four do; old samples are dropped.
    ([0.06] * 30 + [0.45], 2.0, 0.24), ([0.06] * 30 + [0.45] * 4, 2.0, 1.8),
    ([0.45] * MAX_SAMPLES + [0.06] * MAX_SAMPLES, 2.0, 0.24)])
def test_timeout_is_four_times_the_95th_percentile_within_bounds(
        samples: list[float], longest: float, timeout: float) -> None:
    assert of(*samples).timeout(longest) == pytest.approx(timeout)


@given(st.lists(st.floats(0, 10), min_size=1, max_size=100), st.floats(0.01, 5))
def test_timeout_and_quantiles_stay_within_bounds_for_any_samples(
        samples: list[float], longest: float) -> None:
    estimator, last = of(*samples), sorted(samples[-MAX_SAMPLES:])
    assert min(MIN_TIMEOUT, longest) <= estimator.timeout(longest) <= longest
    for share in (0.0, 0.5, 0.95, 1.0):
        assert estimator.quantile(share) == last[min(int(share * len(last)), len(last) - 1)]


def test_quantile_of_no_sample_is_unknown() -> None:
    assert of().quantile(0.5) is None


def test_shortest_comes_from_unambiguous_samples_and_is_0_while_none_is_ambiguous() -> None:
    estimator = of(*[0.4] * 6)
    assert estimator.shortest(0.0) == 0.0
    estimator.expect_ambiguous(0.0)
    estimator.add(0.001, ACK_LIFETIME - 0.1)
    assert (estimator.shortest(ACK_LIFETIME - 0.1), estimator.shortest(ACK_LIFETIME)) == (0.4, 0.0)


def test_a_resend_before_the_first_sample_makes_that_ambiguous() -> None:
    rig = Rig()
    rig.start()
    rig.run(0.6)
    rig.ack(ACCEPTED)
    rig.start()
    rig.run(0.01)
    rig.ack(ACCEPTED)
    estimator = rig.sender.round_trip(LIGHT)
    assert len(estimator) == 1
    assert estimator.shortest(rig.now) == pytest.approx(0.01)


def taught(seconds: float, timeout: float) -> Rig:
    """Return a rig that has enough samples of this round-trip time, s."""
    rig = Rig(timeout=timeout)
    for _ in range(MIN_SAMPLES):
        rig.start()
        rig.now += seconds
        rig.ack(ACCEPTED)
    return rig


def test_a_line_that_becomes_slower_than_the_wait_is_measured_again() -> None:
    rig = taught(0.02, 0.5)
    tries = []
    for _ in range(5):
        run = rig.start()
        rig.run(0.4)
        rig.ack(ACCEPTED)
        if len(run.frames) > 1:
            # Acknowledge the second try, which was not needed.
            rig.run(0.2)
            rig.ack(ACCEPTED)
        tries.append(run.outcome.tries)
    assert (tries[0], tries[-1]) == (2, 1)


def test_a_copy_of_an_acknowledgement_is_not_taken_for_that_of_another_try() -> None:
    rig = taught(0.02, 0.5)
    for _ in range(5):
        run = rig.start()
        rig.run(0.4)
        rig.ack(ACCEPTED)
        rig.run(0.05)
        rig.ack(ACCEPTED)
        rig.run(1.0)
        assert run.outcome.tries == 2


@pytest.mark.parametrize(('seconds', 'timeout', 'times'), [
    # Each wait is twice the one before it, up to the given time-out.
    (0.06, 1.0, [0.0, 0.24, 0.72, 1.68, 2.68]), (0.4, 0.5, [0.0, 0.5, 1.0, 1.5, 2.0])])
def test_resends_follow_the_round_trip_times_of_the_target(
        seconds: float, timeout: float, times: list[float]) -> None:
    rig = taught(seconds, timeout)
    begun, run = rig.now, rig.ended()
    assert [*(time - begun for time, _ in run.frames), run.ended_at - begun] == pytest.approx(
        times)
    assert rig.sender.round_trip(Address(1, 244)).timeout(0.5) == 0.5


def test_wait_after_a_rejected_try_is_not_longer() -> None:
    rig = taught(0.06, 1.0)
    run = rig.start()
    rig.ack(REJECTED)
    rig.run(0.1)
    assert rig.sender.next_deadline() == pytest.approx(run.frames[1][0] + 0.24)


# An acknowledgement after a resend may belong to either try (Karn's algorithm).
@pytest.mark.parametrize(('answers', 'samples'), [
    ([(0.01, ACCEPTED)], [0.01]), ([(0.6, ACCEPTED)], []),
    ([(0.01, IN_PROGRESS), (0.05, ACCEPTED)], [0.01]),
    ([(0.01, REJECTED), (0.05, ACCEPTED)], [0.01]),
    ([(0.01, mavlink.MAV_RESULT_COMMAND_INT_ONLY), (0.01, ACCEPTED)], [0.01])])
def test_only_the_first_answer_to_the_only_try_is_measured(
        answers: list[tuple[float, int]], samples: list[float]) -> None:
    rig = Rig()
    rig.start()
    for after, result in answers:
        rig.run(after)
        rig.ack(result)
    estimator = rig.sender.round_trip(LIGHT)
    assert len(estimator) == len(samples)
    assert samples == [] or estimator.quantile(1.0) == pytest.approx(samples[0])
