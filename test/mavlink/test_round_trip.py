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

from hypothesis import given, settings
from hypothesis import strategies as st
from illuminator_ros.mavlink.command import MAX_SAMPLES, MIN_SAMPLES, MIN_TIMEOUT, RttEstimator
from illuminator_ros.mavlink.messages import Address, MavResult
import pytest
from support.command_rig import ACCEPTED, IN_PROGRESS, LIGHT, REJECTED, Rig


def of(*seconds: float) -> RttEstimator:
    """Return what is known after these round trips."""
    round_trip = RttEstimator()
    for sample in seconds:
        round_trip.add(sample)
    return round_trip


# The time-out

@pytest.mark.parametrize('known', range(MIN_SAMPLES))
def test_given_timeout_holds_until_enough_is_known(known: int) -> None:
    assert of(*[0.01] * known).timeout(0.5) == 0.5


@pytest.mark.parametrize(('round_trip', 'timeout'), [
    (0.001, MIN_TIMEOUT), (0.05, 0.2), (0.06, 0.24), (0.1, 0.4), (0.125, 0.5), (0.4, 0.5)])
def test_timeout_is_four_round_trips_between_the_floor_and_the_given_one(
        round_trip: float, timeout: float) -> None:
    assert of(*[round_trip] * MIN_SAMPLES).timeout(0.5) == pytest.approx(timeout)


def test_given_timeout_below_the_floor_holds() -> None:
    assert of(*[0.001] * 10).timeout(0.05) == 0.05


def test_one_slow_answer_in_many_does_not_slow_all_down() -> None:
    assert of(*[0.06] * 30, 0.45).timeout(2.0) == pytest.approx(0.24)


def test_slow_answers_that_are_no_exception_count() -> None:
    assert of(*[0.06] * 30, *[0.45] * 4).timeout(2.0) == pytest.approx(1.8)


def test_old_round_trips_are_forgotten() -> None:
    assert of(*[0.45] * MAX_SAMPLES, *[0.06] * MAX_SAMPLES).quantile(1.0) == 0.06


def test_nothing_is_known_at_first() -> None:
    assert of().quantile(0.5) is None


@pytest.mark.parametrize(('share', 'value'), [
    (0.0, 1.0), (0.5, 33.0), (0.95, 61.0), (1.0, 64.0)])
def test_quantile_is_that_of_the_samples(share: float, value: float) -> None:
    samples = [float(number) for number in range(64, 0, -1)]
    assert of(*samples).quantile(share) == value


@given(st.lists(st.floats(0, 10), min_size=1, max_size=100), st.floats(0.01, 5))
@settings(derandomize=True, deadline=None)
def test_timeout_is_never_outside_its_bounds(samples: list[float], longest: float) -> None:
    assert min(MIN_TIMEOUT, longest) <= of(*samples).timeout(longest) <= longest


# In the sender

def answered(rig: Rig, after: float) -> None:
    """Have a command accepted after a time, s."""
    rig.start()
    rig.now += after
    rig.ack(ACCEPTED)


def test_sender_resends_sooner_once_the_target_has_answered_fast() -> None:
    rig = Rig(timeout=1.0)
    for _ in range(MIN_SAMPLES):
        answered(rig, 0.06)
    run = rig.ended()
    times = [time - run.frames[0][0] for time, _ in run.frames]
    # Each wait is twice the one before it, up to the given time-out.
    assert times == pytest.approx([0.0, 0.24, 0.72, 1.68])
    assert run.outcome.elapsed == pytest.approx(2.68)


def test_try_that_was_rejected_makes_the_next_wait_no_longer() -> None:
    rig = Rig(timeout=1.0)
    for _ in range(MIN_SAMPLES):
        answered(rig, 0.06)
    run = rig.start()
    rig.ack(REJECTED)
    rig.run(0.1)
    assert len(run.frames) == 2
    assert rig.sender.next_deadline() == pytest.approx(run.frames[1][0] + 0.24)


def test_sender_never_waits_longer_than_the_given_timeout() -> None:
    rig = Rig(timeout=0.5)
    for _ in range(MIN_SAMPLES):
        answered(rig, 0.4)
    assert rig.sender.round_trip(LIGHT).quantile(0.5) == pytest.approx(0.4)
    assert rig.ended().outcome.elapsed == pytest.approx(2.0)


def test_one_target_does_not_teach_about_another() -> None:
    rig = Rig()
    for _ in range(MIN_SAMPLES):
        answered(rig, 0.01)
    assert rig.sender.round_trip(Address(1, 244)).timeout(0.5) == 0.5


def test_answer_to_a_first_try_is_measured() -> None:
    rig = Rig()
    answered(rig, 0.01)
    assert len(rig.sender.round_trip(LIGHT)) == 1


def test_answer_after_a_resend_is_not_measured() -> None:
    # It may be the answer to either try (Karn's algorithm).
    rig = Rig()
    rig.start()
    rig.run(0.6)
    rig.ack(ACCEPTED)
    assert len(rig.sender.round_trip(LIGHT)) == 0


@pytest.mark.parametrize('first', [IN_PROGRESS, REJECTED])
def test_only_the_first_answer_to_a_try_is_measured(first: int) -> None:
    rig = Rig()
    rig.start()
    rig.now += 0.01
    rig.ack(first)
    rig.now += 0.05
    rig.ack(ACCEPTED)
    assert len(rig.sender.round_trip(LIGHT)) == 1
    assert rig.sender.round_trip(LIGHT).quantile(0.0) == pytest.approx(0.01)


def test_answer_to_the_command_int_that_follows_is_not_measured() -> None:
    rig = Rig()
    rig.start()
    rig.now += 0.01
    rig.ack(MavResult.COMMAND_INT_ONLY)
    rig.now += 0.01
    rig.ack(ACCEPTED)
    assert len(rig.sender.round_trip(LIGHT)) == 1


def test_answer_that_does_not_count_is_not_measured() -> None:
    rig = Rig()
    rig.start()
    rig.ack(ACCEPTED, target=Address(255, 190))
    rig.ack(ACCEPTED, 406)
    assert len(rig.sender.round_trip(LIGHT)) == 0
