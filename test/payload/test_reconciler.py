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

"""
A reconciler moves a property to its desired value and answers each caller once, truthfully.

test/illuminator/test_requests.py has its answers, test/illuminator/test_truth.py its evidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import Any

from hypothesis import given, strategies
from illuminator_ros.mavlink.command_sender import CommandSender
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address, CommandAck
from illuminator_ros.payload.attempt import Result, StatusReport, Target
from illuminator_ros.payload.reconciler import decide, Desired, Reconciler
import pytest

US, DEVICE = Address(1, 193), Address(1, 7)
SET_LEVEL, OTHER_COMMAND, STATUS_ID = 31000, 31001, 40000
ACCEPTED, DENIED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED


@dataclass(frozen=True)
class Level:
    """A level of the device; 0 overtakes."""

    level: int
    note: str = ''
    position: None = None
    command: int = SET_LEVEL

    @property
    def params(self) -> tuple[float, ...]:
        return (float(self.level),)

    @property
    def goal(self) -> str:
        return f'level {self.level}'

    def shown_by(self, status: int) -> bool:
        return status == self.level

    def evidence(self, status: int) -> str:
        return 'confirmed by STATUS'

    def actual(self, status: int) -> str:
        return f'level {status}'


class Bench:
    """A reconciler, the device at the other end, and the time."""

    def __init__(self, status_id: int | None = STATUS_ID) -> None:
        self.now = 100.0
        self.sender = CommandSender(US)
        target = Target(DEVICE, self.sender, kind='device', status_id=status_id,
                        status_name='STATUS')
        self.reconciler: Reconciler[int] = Reconciler(
            target, overtakes=lambda change: change.params == (0.0,))

    def want(self, level: int, *, command: int = SET_LEVEL) -> list[Result]:
        """Want a level, and return the list that gets its results."""
        results: list[Result] = []
        self.reconciler.want(
            Desired(Level(level, command=command), since=self.now), self.now,
            lambda result, now: results.append(result))
        return results

    def report(self, level: int) -> None:
        self.reconciler.reported(StatusReport(level, self.now), self.now)

    def acknowledge(self, result: int = ACCEPTED, command: int = SET_LEVEL) -> None:
        self.sender.acknowledge(DEVICE, CommandAck(command, result, 0, 0, *US), self.now)

    def run(self, seconds: float) -> None:
        """Let time pass."""
        end = self.now + seconds
        while (due := min(self.reconciler.next_deadline(), self.sender.next_deadline())) <= end:
            self.now = max(self.now, due)
            self.sender.poll(self.now)
            self.reconciler.poll(self.now)
        self.now = end

    @property
    def sent(self) -> list[float]:
        """Return the levels that were sent, tries included."""
        messages: list[Any] = [message for _, message in self.sender.outgoing]
        return [message.param1 for message in messages
                if message.command in (SET_LEVEL, OTHER_COMMAND)]


@pytest.fixture
def bench() -> Bench:
    bench = Bench()
    bench.report(5)
    return bench


def messages(*answers: Sequence[Result]) -> list[str]:
    return [answer[0].message.partition(' (')[0] if answer else '' for answer in answers]


@pytest.mark.parametrize(('result', 'message', 'success'), [
    (ACCEPTED, 'MAV_RESULT_ACCEPTED', True), (DENIED, 'refused: MAV_RESULT_DENIED', False)])
def test_the_acknowledgement_decides_where_no_status_shows_the_property(
    result: int, message: str, success: bool,
) -> None:
    bench = Bench(status_id=None)
    for level in (1, 2):
        answer = bench.want(level)
        bench.acknowledge(result)
        assert messages(answer) == [message]
        assert answer[0].success is success


def test_a_newer_value_by_another_command_need_not_wait_for_the_acknowledgement() -> None:
    bench = Bench(status_id=None)
    older, answer = bench.want(1), bench.want(2, command=OTHER_COMMAND)
    bench.run(0.1)
    assert messages(older) == ['superseded by level 2']
    bench.acknowledge(command=OTHER_COMMAND)
    bench.run(10.0)
    assert (messages(answer), bench.sent) == (['MAV_RESULT_ACCEPTED'], [1.0, 2.0])


def test_an_answer_may_want_another_value_twice(bench: Bench) -> None:
    answers: list[list[Result]] = []
    bench.reconciler.want(
        Desired(Level(1)), bench.now,
        lambda result, now: answers.extend((bench.want(2), bench.want(3))))
    bench.acknowledge()
    bench.report(1)
    bench.acknowledge()
    bench.run(0.01)
    bench.acknowledge()
    bench.report(3)
    assert messages(*answers) == [
        'superseded by level 3', 'level 3, confirmed by STATUS: MAV_RESULT_ACCEPTED']


def test_the_first_rule_in_force_decides_and_a_later_one_is_named() -> None:
    first, second = Desired(Level(1), since=20.0), Desired(Level(2), since=5.0)
    rules = (lambda facts, now: first, lambda facts, now: None, lambda facts, now: second)
    assert decide(rules, None, 0.0) == (None, 5.0)
    assert decide(rules, None, 5.0) == (second, 20.0)
    assert decide(rules, None, 20.0) == (first, math.inf)


STEPS = strategies.lists(strategies.one_of(
    strategies.tuples(strategies.just('want'), strategies.integers(0, 2)),
    strategies.tuples(strategies.just('acknowledge'), strategies.sampled_from(
        [ACCEPTED, ACCEPTED, DENIED, mavlink.MAV_RESULT_TEMPORARILY_REJECTED,
         mavlink.MAV_RESULT_IN_PROGRESS])),
    strategies.tuples(strategies.just('report'), strategies.integers(0, 2)),
    strategies.tuples(strategies.just('run'), strategies.sampled_from([0.001, 0.3, 2.0, 7.0]))),
    max_size=40)


@given(STEPS)
def test_each_caller_is_answered_once_and_a_success_was_accepted_and_shown(
    steps: list[tuple[str, int | float]],
) -> None:
    bench = Bench()
    bench.report(5)
    asked: list[tuple[int, list[Result]]] = []
    accepted = False
    for act, value in steps:
        shown = None
        if act == 'run':
            bench.run(float(value))
            continue
        if act == 'acknowledge':
            bench.acknowledge(int(value))
            accepted |= value == ACCEPTED
        elif act == 'report':
            shown = int(value)
            bench.report(shown)
        else:
            asked.append((int(value), bench.want(int(value))))
        for level, answer in asked:
            assert len(answer) <= 1
            if answer and answer[0].success:
                assert (level, accepted) == (shown, True)
        asked = [one for one in asked if not one[1]]
    bench.run(120.0)
    assert [len(answer) for _, answer in asked] == [1] * len(asked)
    assert not bench.reconciler.is_busy
