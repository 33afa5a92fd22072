# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
A property moves a device to its desired value, and answers each caller once.

test_confirmed_command.py has the evidence for one command.
"""

from __future__ import annotations

from collections.abc import Sequence
import functools
import math
from typing import Any

from hypothesis import given, strategies
from illuminator_ros.payload.confirmed_command import Desired, FENCE, Result
from illuminator_ros.payload.device_property import (
    answer,
    Caller,
    LATE_TIME,
    MAX_CALLERS,
    MAX_VALUES,
    Outcome,
    Property,
)
import pytest
from support.level_device import ACCEPTED, Bench, DENIED, level_change

ROUND_TRIP = 0.02


class PropertyBench(Bench):
    """The level of the device as a property."""

    def __init__(self, level: int | None = 0, *results: Any, **device: Any) -> None:
        super().__init__(level, *results, **device)
        self.property: Property[int | None] = Property(self.target())

    def want(self, level: int, *, is_stream: bool = False, asked_at: float | None = None,
             **desired: Any) -> list[Result]:
        """Want a level, and return the list that gets its results."""
        results: list[Result] = []
        self.property.want(Desired(level_change(level), **desired), self.now, Caller(
            lambda result, now: results.append(result),
            self.now if asked_at is None else asked_at, is_stream=is_stream))
        self.flush()
        return results

    def report(self, level: int | None = 0) -> PropertyBench:
        """Report a status out of turn."""
        self.reported(level)
        return self

    def outcomes(self) -> list[Outcome[int | None]]:
        """Take the outcomes and answer their callers."""
        outcomes = list(self.property.outcomes)
        self.property.outcomes.clear()
        for outcome in outcomes:
            for caller in outcome.callers:
                caller.done(outcome.result, self.now)
        return outcomes

    def ended(self, level: int, **desired: Any) -> tuple[bool, float]:
        """Want a level; return the success, and how long it took, s."""
        begun, results = self.now, self.want(level, **desired)
        while not results:
            self.step()
            self.outcomes()
        return results[0].success, round(self.now - begun, 3)

    def reported(self, level: int | None) -> None:
        self.property.reported(level, self.now)

    def poll(self) -> None:
        self.property.poll(self.now)

    def next_deadline(self) -> float:
        command = self.property.command
        return math.inf if command is None else command.next_deadline()


def messages(*answers: Sequence[Result]) -> list[str]:
    return [answer[0].message.partition(' (')[0] if answer else '' for answer in answers]


# Callers

def test_a_value_replaces_another_and_an_equal_one_joins_the_next_command() -> None:
    bench = PropertyBench(executes=[]).report()
    first, second = bench.want(3), bench.want(3)
    assert len(bench.tries) == 1
    other = bench.want(4)
    bench.outcomes()
    assert messages(first, second, other) == ['superseded by level 4', 'superseded by level 4', '']
    assert first[0].superseded
    bench.run()
    reason = bench.want(5, reason='silence')
    last = bench.want(6, reason='the end')
    bench.outcomes()
    assert messages(other, reason, last) == [
        'level 4 not confirmed: MAV_RESULT_ACCEPTED, but STATUS shows level 0', 'the end', '']
    bench.property.cancel('held by joystick', bench.now)
    bench.outcomes()
    assert (messages(last), last[0].superseded) == (['held by joystick'], False)
    assert len(bench.commands) == 0


@pytest.mark.parametrize('result', [ACCEPTED, DENIED])
def test_callers_of_an_equal_value_wait_for_a_command_sent_after_they_asked(result: int) -> None:
    bench = PropertyBench(0, result).report()
    first = bench.want(3)
    bench.run(0.015)
    later = [bench.want(3) for _ in range(2)]
    bench.run(2 * FENCE)
    outcomes = bench.outcomes()
    assert [len(outcome.callers) for outcome in outcomes] == [1, 2]
    assert [outcome.status for outcome in outcomes] == [3 if result == ACCEPTED else None] * 2
    assert [one[0].success for one in (first, *later)] == [result == ACCEPTED] * 3
    assert bench.tries[:2] == [0.0, ROUND_TRIP]


def test_callers_are_bounded_and_of_a_stream_the_newest_waits() -> None:
    bench = PropertyBench().report()
    answers = [bench.want(3) for _ in range(MAX_CALLERS + 2)]
    bench.outcomes()
    assert [bool(answer) for answer in answers] == [*[False] * MAX_CALLERS, True, True]
    assert answers[-1][0].message == '32 requests are waiting for device 1/7 already'
    stream = [bench.want(3, is_stream=True) for _ in range(3)]
    bench.outcomes()
    assert messages(*stream) == ['superseded by level 3', 'superseded by level 3', '']
    bench.run(1.0)
    bench.outcomes()
    assert {len(answer) for answer in (*answers, *stream)} == {1}
    assert stream[-1][0].success
    assert len(bench.tries) == 2


def test_callers_who_ask_at_one_time_share_a_command_and_are_answered_in_that_order() -> None:
    bench, order = PropertyBench(executes=[]).report(), list[int]()
    for number in range(3):
        bench.property.want(Desired(level_change(3), limit=0.9), bench.now, Caller(
            functools.partial(lambda number, result, now: order.append(number), number),
            bench.now))
    bench.run(1.0)
    (outcome,) = bench.property.outcomes
    answer(outcome.callers, outcome.result, bench.now)

    assert order == [0, 1, 2]
    assert bench.tries == [0.0]


def test_a_caller_whose_time_is_over_gets_the_outcome_of_the_command_before() -> None:
    bench = PropertyBench(executes=[]).report()
    first = bench.want(3, limit=0.9)
    bench.run(0.015)
    second = bench.want(3, limit=0.9)
    bench.run(1.0)
    bench.outcomes()
    assert len(first) == len(second) == 1
    assert 'not confirmed: MAV_RESULT_ACCEPTED' in first[0].message == second[0].message


def test_the_time_of_the_last_try_is_kept_when_the_command_ends() -> None:
    bench = PropertyBench(0, *[None] * 9).report()
    bench.want(3)
    bench.run(1.8)
    assert bench.property.sent_at == 1.75
    bench.run(4.0)

    assert not bench.property.command
    assert bench.property.sent_at == 1.75


def test_the_limit_counts_from_the_request() -> None:
    bench = PropertyBench(executes=[]).report()
    bench.run(1.0)
    answer = bench.want(3, asked_at=0.8, limit=0.5)
    bench.run(1.31)
    bench.outcomes()
    assert answer[0].message.endswith('(1 try, 500 ms)')


@pytest.mark.parametrize('changes', [{'insists': True}, {'insists': True, 'is_last': True}])
def test_an_equal_value_that_is_sent_in_another_way_replaces_the_command(
    changes: dict[str, bool],
) -> None:
    bench = PropertyBench().report()
    bench.want(3)
    bench.want(3, reason='silence', **changes)
    (outcome,) = bench.outcomes()
    assert outcome.result.message == 'silence'
    assert bench.property.desired is not None
    assert bench.property.desired.insists


# The fence

# Values that are wanted one after the other, of which only the last one may end; the first status
# -> whether that is confirmed by its own try, or only after the fence.
@pytest.mark.parametrize('limit', [0.9, math.inf])
@pytest.mark.parametrize(('values', 'first', 'is_proved_at_once'), [
    # Only this value can have caused a status that shows it.
    ([3, 4], 0, True), ([3, 4, 5], 0, True), ([3, 3], 0, True),
    # The light shows it already, or has shown nothing.
    ([1, 0], 0, False), ([3, 4], 4, False), ([3, 4], None, False),
    # Another value was sent between an equal one and this one.
    ([3, 4, 3], 0, False), ([3, 4, 5, 4], 0, False),
    # Too many to remember.
    ([*range(1, MAX_VALUES + 1)], 0, True), ([*range(1, MAX_VALUES + 2)], 0, False)])
def test_within_the_fence_a_status_counts_that_only_this_value_can_have_caused(
    values: list[int], first: int | None, is_proved_at_once: bool, limit: float,
) -> None:
    bench = PropertyBench(0 if first is None else first)
    if first is not None:
        bench.report(first)
    for value in values[:-1]:
        bench.want(value)
        bench.property.cancel('', bench.now)
    if limit < FENCE:
        assert bench.ended(values[-1], limit=limit) == (
            (True, ROUND_TRIP) if is_proved_at_once else (False, limit))
    else:
        # It can await the end of the fence.
        assert bench.ended(values[-1]) == (True, FENCE + ROUND_TRIP)


@pytest.mark.parametrize(('results', 'between', 'seconds'), [
    # The end of the command before -> how long the next one takes, with the value between them.
    ([ACCEPTED], 0.0, ROUND_TRIP), ([DENIED, ACCEPTED], 0.0, ROUND_TRIP),
    ([None, None, None, None, ACCEPTED], 0.0, FENCE - 1.0),
    ([None, None, None, None, ACCEPTED], FENCE - 1.0, ROUND_TRIP)],
    ids=['confirmed', 'refused', 'not acknowledged', 'not acknowledged and waited'])
def test_the_fence_ends_1_5_s_after_the_last_frame_of_a_command_without_an_acknowledgement(
    results: list[int | None], between: float, seconds: float,
) -> None:
    bench = PropertyBench(0, *results).report()
    assert bench.ended(3)[0] is (results[0] == ACCEPTED)
    bench.run(bench.now + between)
    # The device shows this value already.
    bench.level = 0
    bench.report(0)
    success, took = bench.ended(0)
    assert success
    assert took == pytest.approx(seconds, abs=ROUND_TRIP + 0.001)


def test_acknowledgements_within_the_fence_do_not_count_as_those_of_the_command() -> None:
    # They may answer the command before, and tries of this one are still under way.
    bench = PropertyBench(0, None, None, None, None, ACCEPTED).report()
    assert not bench.ended(3)[0]
    bench.report(0)
    assert bench.ended(4)[0]
    last_sent = bench.tries[-1]

    success, took = bench.ended(3)
    assert success
    assert took == pytest.approx(last_sent + FENCE - (bench.now - took), abs=ROUND_TRIP + 0.001)


def test_values_from_before_the_fence_are_forgotten_after_it() -> None:
    bench = PropertyBench().report()
    bench.want(3)
    bench.want(4)
    bench.property.cancel('', bench.now)
    bench.run(FENCE)
    bench.results = [None, None, None, None, ACCEPTED]
    bench.report(0)
    assert not bench.ended(5)[0]
    # 3 and 4 are not under way any more, so that 3 can be proved.
    assert bench.ended(3, limit=0.9) == (True, ROUND_TRIP)


# Reports

@pytest.mark.parametrize(('event', 'after', 'remains'), [
    ('', 10.0, True), ('', LATE_TIME, True), ('', LATE_TIME + 0.1, False),
    ('shown', FENCE, False), ('shown', 0.0, True), ('contradicted', FENCE, True),
    ('another is confirmed', 0.0, False), ('another is refused', 0.0, False)])
def test_a_change_that_ended_unconfirmed_may_take_effect_until_a_status_shows_it(
    event: str, after: float, remains: bool,
) -> None:
    bench = PropertyBench(0, None).report()
    bench.want(3)
    bench.property.cancel('', bench.now)
    assert bench.property.unconfirmed(bench.now) == level_change(3)
    bench.run(after)
    if event.startswith('another'):
        bench.results = [ACCEPTED if event.endswith('confirmed') else DENIED]
        bench.ended(4)
    elif event:
        bench.report(3 if event == 'shown' else 0)
    assert bench.property.unconfirmed(bench.now) == (level_change(3) if remains else None)


@pytest.mark.parametrize(('reports', 'text'), [
    ([], 'accepted, not confirmed (the device sends no STATUS)'),
    ([0.0], 'no STATUS came within 1.00 s'), ([0.0, 0.9], 'no STATUS came within 1.00 s'),
    ([0.0, 10.0], 'its next status is due within 10 s'),
    ([0.0, 10.0, 10.5], 'no STATUS came within 1.00 s')])
def test_the_interval_of_the_statuses_tells_when_the_next_one_is_due(
    reports: list[float], text: str,
) -> None:
    bench = PropertyBench(sends_status=False)
    for at in reports:
        bench.run(at)
        bench.report(0)
    begun = bench.now
    answer = bench.want(3)
    bench.run(begun + 1.1)
    bench.outcomes()
    assert text in answer[0].message
    assert bench.property.newest_at == max(reports, default=-math.inf)


def test_the_first_status_after_a_restart_confirms_nothing_and_is_the_newest() -> None:
    bench = PropertyBench(sends_status=False).report()
    answer = bench.want(3)
    bench.run(0.1)
    bench.property.restarted(3, bench.now)
    assert (bench.property.newest, bench.property.newest_at) == (3, 0.1)
    assert not bench.property.outcomes
    bench.sends_status = True
    bench.run(3.0)
    bench.outcomes()
    assert answer[0].success
    assert 'the device restarted meanwhile (8 tries, 1.62 s)' in answer[0].message


@given(strategies.lists(strategies.tuples(
    strategies.sampled_from(['want', 'stream', 'report', 'ack', 'restart', 'cancel', 'wait']),
    strategies.integers(0, 3)), max_size=40))
def test_each_caller_is_answered_once_and_each_success_is_shown_after_it_was_asked(
    steps: list[tuple[str, int]],
) -> None:
    bench = PropertyBench(0, None, sends_status=False).report(9)
    answers: list[tuple[int, int, list[Result]]] = []
    shown: list[int] = []
    checked: set[int] = set()
    for action, number in [*steps, ('cancel', 0)]:
        if action in ('want', 'stream'):
            answers.append((number, len(shown), bench.want(
                number, is_stream=action == 'stream')))
        elif action == 'report':
            shown.append(number)
            bench.report(number)
        elif action == 'ack':
            bench.acknowledge(ACCEPTED if number else DENIED)
        elif action == 'restart':
            bench.property.restarted(number, bench.now)
        elif action == 'cancel':
            bench.property.cancel('cancelled', bench.now)
        else:
            bench.run(bench.now + 0.3 * number)
        bench.outcomes()
        for place, (level, since, results) in enumerate(answers):
            if results and place not in checked:
                checked.add(place)
                assert len(results) == 1
                assert not results[0].success or (level in shown[since:] and action == 'report')
    assert all(len(results) == 1 for _, _, results in answers)
    assert len(bench.commands) == 0
