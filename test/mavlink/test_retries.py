# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The policies of retries."""

from itertools import count, islice

from illuminator_ros.mavlink.retries import POLICIES, Retries, RetryPolicy
import pytest


@pytest.mark.parametrize(('first', 'longest', 'waits'), [
    (0.05, 0.25, [0.05, 0.1, 0.2, 0.25, 0.25]), (2.0, 2.0, [2.0, 2.0]), (3.0, 1.0, [3.0, 3.0])])
def test_each_wait_is_twice_the_one_before_up_to_the_longest_or_the_first(
        first: float, longest: float, waits: list[float]) -> None:
    policy = RetryPolicy('', first, longest)

    assert [*islice(map(policy.wait, count(1)), len(waits))] == waits


@pytest.mark.parametrize('policy', POLICIES, ids=lambda one: one.subject)
def test_a_try_is_due_at_once_and_after_each_wait_until_they_stop(policy: RetryPolicy) -> None:
    retries, now = Retries(policy), 5.0

    for tried in range(1, 20):
        assert retries.begin_try(now)
        assert not retries.begin_try(now + 0.99 * policy.wait(tried))
        assert retries.is_spent is (policy.tries is not None and tried >= policy.tries)
        now += policy.wait(tried)

    retries.stop()
    assert not retries.begin_try(1e9)
