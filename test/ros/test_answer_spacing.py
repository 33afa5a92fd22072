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

"""Times of the answers of a service with many clients."""

from __future__ import annotations

from illuminator_ros.ros.answer_spacing import (
    AnswerSpacing,
    MAX_SPREAD,
    MAX_UNSPACED,
    PAUSE_PER_CLIENT,
)
import pytest

NOW = 100.0


def spaced(clients: int, requests: int) -> AnswerSpacing:
    """Return the spacing of a service that has taken some requests."""
    spacing = AnswerSpacing()
    spacing.clients = clients
    for _ in range(requests):
        spacing.note_request()
    return spacing


@pytest.mark.parametrize(('clients', 'requests', 'pause'), [
    (MAX_UNSPACED, MAX_UNSPACED, 0.0), (MAX_UNSPACED + 1, 2, MAX_UNSPACED + 1),
    (1, MAX_UNSPACED + 1, MAX_UNSPACED + 1), (20, 30, 30), (30, 20, 30),
    (100, 50, MAX_SPREAD / 100 / PAUSE_PER_CLIENT)])
def test_pause_follows_an_answer_where_there_are_many_clients_or_open_requests(
    clients: int, requests: int, pause: float,
) -> None:
    spacing = spaced(clients, requests)

    times = [spacing.time_of_answer(NOW) for _ in range(2)]

    assert times == pytest.approx([NOW, NOW + pause * PAUSE_PER_CLIENT])


def test_answer_after_the_pause_is_sent_at_once() -> None:
    spacing = spaced(20, 2)
    spacing.time_of_answer(NOW)
    assert spacing.time_of_answer(NOW + 21 * PAUSE_PER_CLIENT) == NOW + 21 * PAUSE_PER_CLIENT


@pytest.mark.parametrize('clients', [1, 20, 500])
@pytest.mark.parametrize('requests', [20, 50, 200, 1000])
def test_answers_to_requests_that_came_together_are_spread_over_the_limit_at_most(
    clients: int, requests: int,
) -> None:
    spacing = spaced(clients, requests)

    times = [spacing.time_of_answer(NOW) for _ in range(requests)]

    assert times == sorted(times)
    assert times[-1] <= NOW + MAX_SPREAD
    # No two of them are so close that a client with ten places loses one.
    assert all(later > earlier for earlier, later in zip(
        times[:-MAX_UNSPACED], times[1:], strict=False))
