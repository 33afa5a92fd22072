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

"""Pauses between the answers of a service with many clients."""

from __future__ import annotations

from collections.abc import Callable

from illuminator_ros.ros.answer_queue import (
    AnswerQueue,
    CLIENT_COUNT_INTERVAL,
    MAX_SPREAD,
    MAX_UNSPACED,
    MAX_WAITING,
    PAUSE_PER_CLIENT,
)
import pytest

NOW = 100.0


class Answers:
    """The answers of a queue, numbered in the order of their requests."""

    def __init__(self, clients: int, requests: int) -> None:
        self.queue = AnswerQueue()
        self.sent: list[int] = []
        self.queue.count_clients(lambda: clients, NOW)
        for _ in range(requests):
            self.queue.note_request()

    def give(self, number: int, now: float) -> bool:
        """Answer a request; return whether the answer was sent."""
        return self.queue.send_or_queue(self.answer(number), now)

    def answer(self, number: int) -> Callable[[], None]:
        return lambda: self.sent.append(number)


@pytest.mark.parametrize(('clients', 'requests', 'pause'), [
    (MAX_UNSPACED, MAX_UNSPACED, 0.0), (MAX_UNSPACED + 1, 2, MAX_UNSPACED + 1),
    (1, MAX_UNSPACED + 1, MAX_UNSPACED + 1), (20, 30, 30), (30, 20, 30),
    (100, 50, MAX_SPREAD / 100 / PAUSE_PER_CLIENT)])
def test_a_pause_follows_an_answer_where_there_are_many_clients_or_open_requests(
    clients: int, requests: int, pause: float,
) -> None:
    answers = Answers(clients, requests)
    until = NOW + pause * PAUSE_PER_CLIENT

    assert [answers.give(number, NOW) for number in range(2)] == [True, not pause]

    if pause:
        assert answers.queue.next_deadline() == pytest.approx(until)
    answers.queue.poll(until - 1e-6)
    assert answers.sent == [0, 1][:2 - bool(pause)]
    answers.queue.poll(until + 1e-6)
    assert (answers.sent, len(answers.queue)) == ([0, 1], 0)


def test_answers_are_sent_in_their_order_after_the_pause_too() -> None:
    answers = Answers(clients=20, requests=5)
    pause = 20 * PAUSE_PER_CLIENT
    for number in range(3):
        answers.give(number, NOW)
    assert not answers.give(3, NOW + 1.5 * pause)
    for periods in (1.5, 2.6, 3.7):
        answers.queue.poll(NOW + periods * pause)
    assert answers.give(4, NOW + 5 * pause)
    assert answers.sent == [0, 1, 2, 3, 4]


@pytest.mark.parametrize('requests', [20, 50, 200])
def test_the_answers_to_requests_that_came_together_are_sent_within_the_limit(
    requests: int,
) -> None:
    answers = Answers(clients=requests, requests=requests)
    for number in range(requests):
        answers.give(number, NOW)
    now = NOW
    while len(answers.queue):
        now = answers.queue.next_deadline()
        answers.queue.poll(now)
    assert answers.sent == list(range(requests))
    assert now <= NOW + MAX_SPREAD


def test_answers_above_the_limit_are_sent_without_a_pause() -> None:
    answers = Answers(clients=20, requests=MAX_WAITING + 3)
    for number in range(MAX_WAITING + 3):
        answers.give(number, NOW)
    answers.queue.poll(NOW)
    assert (answers.sent, len(answers.queue)) == ([0, 1, 2], MAX_WAITING)


def test_an_answer_that_comes_while_another_one_is_sent_waits_for_the_next_pause() -> None:
    answers = Answers(clients=20, requests=3)
    queue, pause = answers.queue, 20 * PAUSE_PER_CLIENT

    def second() -> None:
        assert not answers.give(2, NOW + pause)
        answers.sent.append(1)

    assert (answers.give(0, NOW), queue.send_or_queue(second, NOW)) == (True, False)
    queue.poll(NOW + pause)
    assert (answers.sent, len(queue)) == ([0, 1], 1)
    queue.poll(NOW + 2.1 * pause)
    assert (answers.sent, len(queue)) == ([0, 1, 2], 0)


def test_clients_are_counted_at_an_interval_and_a_failure_leaves_the_last_count() -> None:
    answers, counts = Answers(clients=20, requests=2), [40, None]
    left = []
    for intervals in (0.5, 1.1, 1.6, 2.2):
        answers.queue.count_clients(lambda: counts.pop(0), NOW + intervals * CLIENT_COUNT_INTERVAL)
        left.append(len(counts))
    answers.give(0, NOW)
    answers.give(1, NOW)
    assert left == [2, 1, 1, 0]
    assert answers.queue.next_deadline() == pytest.approx(NOW + 40 * PAUSE_PER_CLIENT)
