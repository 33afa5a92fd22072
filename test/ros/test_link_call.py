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

"""Requests of ROS callbacks to the link: each is answered once, and too many are refused."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from illuminator_ros.ros.link_call import LinkCalls, MAX_PENDING
import pytest


class CallerLink:
    """
    A link that calls functions at once, and answers requests when it is told to.

    :ivar answered: the answers that callers got.
    """

    def __init__(self) -> None:
        self.answered: list[str] = []
        self._answers: list[Callable[[str], None]] = []

    def call(self, function: Callable[[float], None]) -> None:
        function(0.0)

    def ask(self, calls: LinkCalls) -> None:
        calls.ask(lambda now, answer: self._answers.append(answer), self.answered.append,
                  'refused: {}'.format)

    def answer(self) -> None:
        self._answers.pop(0)('done')


@pytest.fixture
def link() -> CallerLink:
    return CallerLink()


@pytest.fixture
def calls(link: CallerLink) -> LinkCalls:
    anything: Any = link
    return LinkCalls(anything, anything)


def test_request_beyond_the_limit_is_refused_at_once_until_another_is_answered(
        link: CallerLink, calls: LinkCalls) -> None:
    for _ in range(MAX_PENDING + 1):
        link.ask(calls)
    assert link.answered == [
        f'refused: busy: {MAX_PENDING} requests wait for an answer already']
    link.answer()
    link.ask(calls)
    assert link.answered[1:] == ['done']


def test_each_request_that_waits_is_refused_at_the_end_and_answered_once(
        link: CallerLink, calls: LinkCalls) -> None:
    for _ in range(3):
        link.ask(calls)
    link.answer()
    calls.refuse_waiting('the end')
    link.answer()
    calls.refuse_waiting('the end')
    assert link.answered == ['done', 'refused: the end', 'refused: the end']
