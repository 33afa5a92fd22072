# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""One property: the command that is under way to it, the fence, and who is answered when."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import functools
import math
from typing import Any

from hypothesis import given, strategies
from illuminator_ros.payload.attempt import Change, FENCE, Served
from illuminator_ros.payload.device_property import LATE_TIME, MAX_VALUES, Property
from illuminator_ros.payload.requests import Goal, Request, Requests, Result, Why
import pytest
from support.level_device import ACCEPTED, DENIED, level_change, LevelBench

ROUND_TRIP = 0.02


def plan(goal: Goal) -> tuple[Change[int | None], Mapping[Request, Change[int | None]]]:
    change = level_change(goal.values)
    return change, dict.fromkeys(goal.serves, change)


class PropertyBench(LevelBench):
    """The level of the device as a property, and the requests for it."""

    def __init__(self, level: int | None = 0, *results: Any, **device: Any) -> None:
        super().__init__(level, *results, **device)
        self.table = Requests('device 1/7', None, lambda values: f'level {values["level"]}')
        self.property: Property[int | None] = Property(self.target(), plan)
        self.newest: int | None = None
        self.newest_at = -math.inf
        self.ends: list[Served[int | None]] = []

    def want(self, level: int, why: Why = Why.REQUEST, *, is_stream: bool = False,
             limit: float = math.inf) -> list[Result]:
        """Want a level, and return the list that gets its results."""
        results: list[Result] = []
        self.table.put(Request(
            {'level': level}, why, self.now, detail=why.name, is_call=not is_stream,
            done=lambda result, now: results.append(result), deadline=self.now + limit), self.now)
        self.steer()
        return results

    def steer(self, *ended: Served[int | None]) -> None:
        """End requests, and have what is wanted under way."""
        for one in ended:
            self.ends.append(one)
            self.table.end(one.request, one.result, self.now)
        gap = None if self.newest_at == -math.inf else self._gap
        served = self.property.steer(
            Goal.strongest(self.table.live(), 'level', self.now), self.now, self.newest, gap)
        for one in served:
            if one.request not in self.table.standing:
                self.table.end(one.request, one.result, self.now)
        self.table.send_replies(self.now)
        self.flush()

    _gap = 0.0

    def report(self, level: int | None = 0) -> PropertyBench:
        """Report a status out of turn."""
        self.reported(level)
        return self

    def withdraw(self) -> None:
        """End all requests, and send nothing more."""
        for one in [*self.table.standing]:
            self.table.end(one, Result(False, 'cancelled'), self.now)
        self.steer()

    def ended(self, level: int, **how: Any) -> tuple[bool, float]:
        """Want a level; return the success, and how long it took, s."""
        begun, results = self.now, self.want(level, **how)
        while not results:
            self.step()
        return results[0].success, round(self.now - begun, 3)

    def reported(self, level: int | None) -> None:
        self._gap = self.now - self.newest_at if self.newest_at != -math.inf else 0.0
        self.newest, self.newest_at = level, self.now
        self.steer(*self.property.reported(level, self._gap, self.now))

    def act(self) -> None:
        self.steer(*self.property.poll(self.now))

    @property
    def act_due(self) -> float:
        return self.property.due


def messages(*answers: Sequence[Result]) -> list[str]:
    return [answer[0].message.partition(' (')[0] if answer else '' for answer in answers]


# Requests

def test_a_value_replaces_another_and_an_equal_one_joins_the_next_command() -> None:
    bench = PropertyBench(executes=[]).report()
    first, second = bench.want(3), bench.want(3)
    assert len(bench.tries) == 1
    other = bench.want(4)
    assert messages(first, second, other) == ['superseded by level 4', 'superseded by level 4', '']
    assert first[0].superseded
    bench.run_until(10.0)
    assert messages(other) == [
        'level 4 not confirmed: MAV_RESULT_ACCEPTED, but STATUS shows level 0']
    assert len(bench.commands) == 0


@pytest.mark.parametrize('result', [ACCEPTED, DENIED])
def test_requests_for_an_equal_value_wait_for_a_command_sent_after_they_were_made(
    result: int,
) -> None:
    bench = PropertyBench(0, result).report()
    first = bench.want(3)
    bench.run_until(0.015)
    later = [bench.want(3) for _ in range(2)]
    bench.run_until(2 * FENCE)
    assert [one.status for one in bench.ends] == [3 if result == ACCEPTED else None] * 3
    assert [one[0].success for one in (first, *later)] == [result == ACCEPTED] * 3
    assert bench.tries[:2] == [0.0, ROUND_TRIP]


def test_requests_of_one_time_share_a_command_and_are_answered_in_their_order() -> None:
    bench, order = PropertyBench(executes=[]).report(), list[int]()
    for number in range(3):
        done = functools.partial(lambda number, result, now: order.append(number), number)
        bench.table.put(Request({'level': 3}, Why.REQUEST, bench.now, done=done, is_call=True,
                                deadline=0.9), bench.now)
    bench.steer()
    bench.run_until(1.0)

    assert order == [0, 1, 2]
    assert bench.tries[0] == 0.0


def test_the_time_of_the_last_try_is_kept_when_the_command_ends() -> None:
    bench = PropertyBench(0, *[None] * 9).report()
    bench.want(3)
    bench.run_until(1.8)
    assert bench.property.sent_at == 1.75
    bench.run_until(4.0)

    assert not bench.property.attempt
    assert bench.property.sent_at == 1.75


def test_a_request_that_insists_waits_for_an_equal_command_and_the_end_does_not() -> None:
    bench = PropertyBench(executes=[]).report()
    bench.want(3)
    bench.want(3, Why.SILENCE)
    assert len(bench.tries) == 1
    bench.want(3, Why.END)
    assert len(bench.tries) == 2


# The fence

# Values that are wanted one after the other, of which only the last one may end; the first status
# -> whether that is confirmed by its own try, or only after the fence.
@pytest.mark.parametrize('limit', [0.9, math.inf])
@pytest.mark.parametrize(('values', 'first', 'is_proved_at_once'), [
    # Only this value can have caused a status that shows it.
    ([3, 4], 0, True), ([3, 4, 5], 0, True), ([3, 3], 0, True),
    # All values are equal, and one is acknowledged.
    ([0, 0], 0, True), ([3, 3], 3, True), ([3, 3], None, True),
    # The light shows it already, or has shown nothing.
    ([1, 0], 0, False), ([3, 4], 4, False), ([3, 4], None, False),
    # Another value was sent between an equal one and this one.
    ([3, 4, 3], 0, False), ([3, 4, 5, 4], 0, False),
    # Too many to remember.
    ([*range(1, MAX_VALUES + 1)], 0, True), ([*range(1, MAX_VALUES + 2)], 0, False)])
def test_within_the_fence_a_status_counts_that_no_other_value_can_have_caused(
    values: list[int], first: int | None, is_proved_at_once: bool, limit: float,
) -> None:
    bench = PropertyBench(0 if first is None else first)
    if first is not None:
        bench.report(first)
    for value in values[:-1]:
        bench.want(value)
        bench.withdraw()
    if limit < FENCE:
        assert bench.ended(values[-1], limit=limit) == (
            (True, ROUND_TRIP) if is_proved_at_once else (False, limit))
    else:
        # It can await the end of the fence.
        assert bench.ended(values[-1]) == (True, FENCE + ROUND_TRIP)


def test_within_the_fence_of_an_equal_value_a_status_without_an_acknowledgement_proves_nothing(
) -> None:
    bench = PropertyBench(0, None).report(0)
    bench.want(0)
    bench.withdraw()

    assert bench.ended(0, limit=0.9) == (False, 0.9)


# The values before that were withdrawn, whether the command had begun before the restart, and
# whether it is acknowledged after it -> whether the next status proves it.
@pytest.mark.parametrize(('before', 'is_under_way', 'is_acknowledged', 'is_proved'), [
    ([], True, True, True), ([], True, False, False), ([3, 4], True, True, False),
    ([4], False, True, True), ([4], False, False, False), ([3, 4], False, True, False)])
def test_after_a_restart_a_status_and_an_acknowledgement_prove_a_set_that_no_other_can_have_caused(
    before: list[int], is_under_way: bool, is_acknowledged: bool, is_proved: bool,
) -> None:
    bench = PropertyBench(0, None, sends_status=False).report(0)
    for value in before:
        bench.want(value)
        bench.withdraw()
    answer = bench.want(3, limit=0.9) if is_under_way else []
    bench.property.restarted(0, bench.now)
    if not is_under_way:
        answer = bench.want(3, limit=0.9)
    if is_acknowledged:
        bench.acknowledge(ACCEPTED)

    # It may be from before the restart.
    bench.report(3)

    assert [one.success for one in answer] == [True] * is_proved


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
    bench.run_until(bench.now + between)
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


@pytest.mark.parametrize(('results', 'is_fenced'), [
    ([ACCEPTED], False), ([ACCEPTED, None, ACCEPTED], True),
    ([ACCEPTED, (ACCEPTED, ACCEPTED), ACCEPTED], True),
    ([ACCEPTED, (ACCEPTED, ACCEPTED), None, ACCEPTED], True)],
    ids=['each answered', 'one lost', 'one copied', 'one copied and one lost'])
def test_a_command_that_is_shown_after_its_fence_leaves_one_only_if_a_frame_may_be_under_way(
    results: list[Any], is_fenced: bool,
) -> None:
    bench = PropertyBench(0, *results).report()
    bench.want(3)
    assert bench.ended(4) == (True, FENCE + ROUND_TRIP)

    success, took = bench.ended(5)
    assert success
    assert took == pytest.approx(FENCE if is_fenced else ROUND_TRIP)


def test_a_set_that_is_proved_within_the_fence_does_not_lengthen_it() -> None:
    bench = PropertyBench().report()
    bench.want(3)
    bench.withdraw()
    bench.run_until(0.5)
    assert bench.ended(4, limit=0.9) == (True, ROUND_TRIP)
    bench.withdraw()

    success, took = bench.ended(5)
    assert success
    assert took == pytest.approx(FENCE - 0.5)


def test_an_equal_set_that_an_earlier_frame_may_have_caused_lengthens_the_fence() -> None:
    bench = PropertyBench(0).report(0)
    bench.want(0)
    bench.withdraw()
    bench.run_until(1.0)
    assert bench.ended(0, limit=0.9) == (True, ROUND_TRIP)

    success, took = bench.ended(5)
    assert success
    assert took == pytest.approx(FENCE)


def test_values_from_before_the_fence_are_forgotten_after_it() -> None:
    bench = PropertyBench().report()
    bench.want(3)
    bench.want(4)
    bench.withdraw()
    bench.run_until(FENCE)
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
    bench.withdraw()
    assert bench.property.unconfirmed(bench.now) == level_change(3)
    bench.run_until(after)
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
        bench.run_until(at)
        bench.report(0)
    begun = bench.now
    answer = bench.want(3)
    bench.run_until(begun + 1.1)
    assert text in answer[0].message


def test_the_first_status_after_a_restart_confirms_nothing() -> None:
    bench = PropertyBench(sends_status=False).report()
    answer = bench.want(3)
    bench.run_until(0.1)
    bench.newest, bench.newest_at = 3, bench.now
    bench.property.restarted(3, bench.now)
    assert not answer
    bench.sends_status = True
    bench.run_until(3.0)
    assert answer[0].success
    assert 'the device restarted meanwhile (8 tries, 1.62 s)' in answer[0].message


@given(strategies.lists(strategies.tuples(
    strategies.sampled_from(
        ['want', 'set', 'stream', 'report', 'ack', 'restart', 'cancel', 'wait']),
    strategies.integers(0, 3)), max_size=40))
def test_each_request_is_answered_once_and_each_success_is_shown_after_it_was_made(
    steps: list[tuple[str, int]],
) -> None:
    bench = PropertyBench(0, None, sends_status=False).report(9)
    answers: list[tuple[int, int, list[Result]]] = []
    shown: list[int] = []
    checked: set[int] = set()
    for action, number in [*steps, ('cancel', 0)]:
        if action in ('want', 'set', 'stream'):
            answers.append((number, len(shown), bench.want(
                number, is_stream=action == 'stream',
                limit=0.9 if action == 'set' else math.inf)))
        elif action == 'report':
            shown.append(number)
            bench.report(number)
        elif action == 'ack':
            bench.acknowledge(ACCEPTED if number else DENIED)
        elif action == 'restart':
            bench.property.restarted(number, bench.now)
        elif action == 'cancel':
            bench.withdraw()
        else:
            bench.run_until(bench.now + 0.3 * number)
        for place, (level, since, results) in enumerate(answers):
            if results and place not in checked:
                checked.add(place)
                assert len(results) == 1
                assert not results[0].success or (level in shown[since:] and action == 'report')
    assert all(len(results) == 1 for _, _, results in answers)
    # A try that a status has confirmed awaits its acknowledgement.
    bench.run_until(bench.now + 1.0)
    assert len(bench.commands) == 0
