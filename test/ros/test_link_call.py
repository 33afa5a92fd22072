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

"""Requests of ROS callbacks to the link: which of them wait for their answers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from illuminator_ros.mavlink.link import CALLER_WAIT
from illuminator_ros.ros.link_call import LinkCalls
import pytest


class CallerLink:
    """
    A link whose turns are those of callers.

    :ivar now: s.
    :ivar waited: whether each caller waited.
    :ivar is_done: of the last caller, None if it did not wait.
    :ivar answered: the answers that callers got.
    """

    def __init__(self) -> None:
        self.now = 0.0
        self.waited: list[bool] = []
        self.is_done: Callable[[], bool] | None = None
        self.answered: list[str] = []
        self._answers: list[Callable[[str], None]] = []

    def clock(self) -> float:
        return self.now

    def run_turn(
        self, function: Callable[[float], None], is_done: Callable[[], bool] | None = None,
    ) -> None:
        function(self.now)
        self.is_done = is_done
        self.waited.append(is_done is not None)

    def ask(self, calls: LinkCalls) -> None:
        def start(now: float, answer: Callable[[str], None]) -> None:
            self._answers.append(answer)

        calls.ask(start, self.answered.append, 'refused: {}'.format)

    def answer(self, after: float) -> None:
        self.now += after
        self._answers.pop(0)('done')


@pytest.fixture
def link() -> CallerLink:
    return CallerLink()


@pytest.fixture
def calls(link: CallerLink) -> LinkCalls:
    anything: Any = link
    return LinkCalls(anything, anything)


@pytest.mark.parametrize(('after', 'waits'), [
    (0.0, True), (0.9 * CALLER_WAIT, True), (1.1 * CALLER_WAIT, False), (1.0, False)])
def test_caller_waits_where_the_last_answer_came_soon(
        link: CallerLink, calls: LinkCalls, after: float, waits: bool) -> None:
    link.ask(calls)
    link.answer(after)
    link.ask(calls)
    assert link.waited == [False, waits]


def test_caller_does_not_wait_while_another_request_has_no_answer(
        link: CallerLink, calls: LinkCalls) -> None:
    link.ask(calls)
    link.answer(0.0)
    for _ in range(3):
        link.ask(calls)
    assert link.waited == [False, True, False, False]


def test_caller_that_waits_is_done_when_the_answer_has_come(
        link: CallerLink, calls: LinkCalls) -> None:
    link.ask(calls)
    link.answer(0.0)
    link.ask(calls)
    assert link.is_done is not None
    assert not link.is_done()
    link.answer(0.0)
    assert link.is_done()


def test_each_request_that_waits_is_refused_at_the_end_and_answered_once(
        link: CallerLink, calls: LinkCalls) -> None:
    for _ in range(3):
        link.ask(calls)
    link.answer(0.0)
    calls.refuse_waiting('the end')
    link.answer(0.0)
    calls.refuse_waiting('the end')
    assert link.answered == ['done', 'refused: the end', 'refused: the end']
