# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The schedule of a link."""

from __future__ import annotations

from collections.abc import Callable
import math

from illuminator_ros.mavlink.schedule import Call, Schedule
import pytest


class Calls:
    """A schedule, and the calls that it has made: a name and the time."""

    def __init__(self) -> None:
        self.schedule = Schedule()
        self.made: list[tuple[str, float]] = []
        self._named: dict[str, Call] = {}

    def __getitem__(self, name: str) -> Call:
        return self._named.setdefault(name, lambda now: self.made.append((name, now)))


@pytest.fixture
def calls() -> Calls:
    return Calls()


@pytest.mark.parametrize(('wanted', 'due'), [
    ([], math.inf),
    ([('at', 3.0), ('at', 4.0)], 4.0),
    ([('at', 3.0), ('at', 2.0)], 2.0),
    ([('at', 3.0), ('at', math.inf)], math.inf),
    ([('at', 3.0), ('by', 4.0)], 3.0),
    ([('at', 3.0), ('by', 2.0)], 2.0),
    ([('by', 4.0)], 4.0),
], ids=['nothing', 'at later', 'at earlier', 'at never', 'by later', 'by earlier', 'by alone'])
def test_a_function_is_called_once_at_the_time_that_it_wanted_last(
        calls: Calls, wanted: list[tuple[str, float]], due: float) -> None:
    for how, time in wanted:
        getattr(calls.schedule, how)(calls['one'], time)
    assert calls.schedule.due == due

    calls.schedule.run(math.nextafter(due, 0.0))
    assert not calls.made
    for _ in range(2):
        calls.schedule.run(5.0)
    assert calls.made == ([('one', 5.0)] if due < math.inf else [])
    assert calls.schedule.due == math.inf


def test_those_that_are_due_together_are_called_in_the_order_of_their_times(
        calls: Calls) -> None:
    for name, time in ('third', 2.0), ('first', -math.inf), ('second', 1.0), ('later', 2.1):
        calls.schedule.at(calls[name], time)

    calls.schedule.run(2.0)

    assert [name for name, _ in calls.made] == ['first', 'second', 'third']
    assert calls.schedule.due == 2.1


@pytest.mark.parametrize('change', [
    lambda calls: calls.schedule.at(calls['second'], math.inf),
    lambda calls: calls.schedule.at(calls['second'], 9.0)], ids=['never', 'later'])
def test_a_function_can_change_the_time_of_another_that_is_due(
        calls: Calls, change: Callable[[Calls], None]) -> None:
    calls.schedule.at(lambda now: change(calls), 1.0)
    calls.schedule.at(calls['second'], 2.0)

    calls.schedule.run(3.0)

    assert not calls.made


def test_a_function_that_raises_keeps_no_other_from_its_turn_and_is_called_again(
        calls: Calls) -> None:
    fails = [True, False]

    def fail(now: float) -> None:
        if fails.pop(0):
            raise RuntimeError('it fails')
        calls['again'](now)

    calls.schedule.at(fail, 1.0)
    calls.schedule.at(calls['other'], 2.0)
    with pytest.raises(RuntimeError, match='it fails'):
        calls.schedule.run(3.0)
    assert calls.made == [('other', 3.0)]
    assert calls.schedule.due == 3.0

    calls.schedule.run(3.5)
    assert calls.made == [('other', 3.0), ('again', 3.5)]
