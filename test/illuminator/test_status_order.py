# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The order of the statuses of one light, and states that go back and forth."""

from __future__ import annotations

from typing import Any

from illuminator_ros.illuminator.model import Status
from illuminator_ros.illuminator.status_order import (
    CALM_TIME,
    ChangingStates,
    COPY_TIME,
    MAX_STATES,
    Order,
    StatusOrder,
)
import pytest
from support.fake_light import status_message

LETTERS = {Order.NEWEST: 'N', Order.LATE: 'L', Order.RESTARTED: 'R'}
LOST = 'lost'
OFF, ON = {'enable': 0}, {'enable': 1}
WRAP = 2 ** 32 / 1000


def status(uptime: float = 0.0, **fields: Any) -> Status:
    return Status.from_message(status_message(round(uptime * 1000) % 2 ** 32, **fields))


# When each status came and its uptime, s, or that the light was lost -> the place of each: newest,
# late or restarted.
@pytest.mark.parametrize(('statuses', 'places'), [
    ([(0, 100), (1, 101), (1.1, 101), (2, 102)], 'NNNN'),
    # Late ones of a path that does not keep the order.
    ([(0, 100), (1, 101), (1.1, 100.5), (2, 102), (2.5, 101.9)], 'NNLNL'),
    # The uptime is at most the time since the newest, and 5 s.
    ([(0, 100), (1, 6.0)], 'NR'), ([(0, 100), (1, 6.1)], 'NL'),
    ([(0, 100), (20, 25.0)], 'NR'), ([(0, 100), (20, 25.1)], 'NL'),
    # Two lights with one address, or statuses that overtake each other: one restart a second.
    ([(0, 100), (1, 0.1), (1.05, 102), (1.1, 0.2), (1.9, 103), (2.2, 1.3)], 'NRNLNR'),
    # Nothing but lower ones has come for 3 s.
    ([(0, 100), (1, 50), (2, 51), (3.9, 52.9), (4, 53), (4.1, 53.1)], 'NLLLRN'),
    ([(0, 100), (1, 50), (3, 103), (3.5, 52.5), (6.4, 55.4), (6.5, 55.5)], 'NLNLLR'),
    # After a loss it has advanced by less than half of the silence; a clock that is 20 % slow has
    # not restarted.
    ([(0, 100), LOST, (10, 105)], 'NN'), ([(0, 100), LOST, (10, 104.9)], 'NR'),
    ([(0, 100), LOST, (10, 108), (10.1, 108.08)], 'NNN'), ([(0, 100), LOST, (10, 99)], 'NR'),
    # A loss counts for the next status only.
    ([(0, 100), LOST, (10, 110), (11, 110)], 'NNN'), ([(0, 100), LOST, (10, 1), (11, 1)], 'NRN'),
    ([LOST, (0, 100)], 'N'),
    # The counter wraps.
    ([(0, WRAP - 1), (2, WRAP + 1), (2.5, WRAP - 0.5), (3, WRAP + 2)], 'NNLN'),
    ([(0, WRAP - 1), LOST, (20, WRAP + 19)], 'NN'),
    # The clock stands still, counts seconds, or runs slow or fast.
    ([(at, 0) for at in range(20)], 'N' * 20), ([(0, 0), LOST, (10, 0)], 'NR'),
    ([(at, 100 + at // 1000) for at in range(20)], 'N' * 20),
    ([(at, 100 + at * 0.8) for at in range(20)], 'N' * 20),
    ([(at, 100 + at * 1.2) for at in range(20)], 'N' * 20)])
def test_the_uptime_tells_which_status_is_late_and_which_the_first_of_a_restart(
    statuses: list[Any], places: str,
) -> None:
    order, found = StatusOrder(), ''
    for one in statuses:
        if one is LOST:
            order.lost()
        else:
            at, uptime = one
            found += LETTERS[order.add(status(uptime), 1000.0 + at, lambda status: False)]
    assert found == places


# When each status came, and its fields -> which counts. Without a clock all uptimes are 0.
@pytest.mark.parametrize(('statuses', 'places'), [
    ([(0, OFF), (1, ON), (1.6, OFF), (1.7, ON)], 'NNLN'),
    ([(0, OFF), (1, ON), (COPY_TIME, OFF)], 'NNL'),
    ([(0, OFF), (1, ON), (COPY_TIME + 0.1, OFF)], 'NNN'),
    # It is not the same byte for byte, or does not contradict.
    ([(0, OFF), (1, ON), (1.6, {**OFF, 'temp_c': 26.0})], 'NNN'),
    ([(0, OFF), (1, {**OFF, 'temp_c': 26.0}), (1.6, OFF)], 'NNN'),
    ([(0, {'brightness': 50.0}), (1, {'brightness': 60.0}), (1.6, {'brightness': 50.0})], 'NNL')])
def test_a_copy_by_a_second_path_that_contradicts_the_newest_status_is_late(
    statuses: list[tuple[float, dict[str, Any]]], places: str,
) -> None:
    order = StatusOrder()
    assert ''.join(LETTERS[order.add(status(**fields), 1000.0 + at, lambda status: False)]
                   for at, fields in statuses) == places


def test_a_copy_counts_if_a_command_expects_it_or_the_light_has_restarted() -> None:
    order = StatusOrder()
    for at, uptime, fields, is_expected, place in (
            (0.0, 1, OFF, False, Order.NEWEST), (1.0, 1, ON, False, Order.NEWEST),
            (1.1, 1, OFF, True, Order.NEWEST), (1.2, 1, ON, False, Order.LATE),
            (1.3, 0, OFF, False, Order.RESTARTED), (1.4, 1, ON, False, Order.NEWEST)):
        assert order.add(
            status(uptime, **fields), 1000.0 + at,
            lambda status, is_expected=is_expected: is_expected) is place  # type: ignore[misc]


# States

HOT = {'error_status': 1}
SYNC = {'mode': 2}


def levels(*values: float) -> list[dict[str, Any]]:
    return [{'brightness': value} for value in values]


# The states in intervals of some seconds, and those that our commands may have made -> the number
# of states after which they count as changing.
@pytest.mark.parametrize(('states', 'interval', 'commanded', 'count'), [
    ([OFF, ON] * 3, 1.0, (), 6), ([OFF, OFF, ON, ON] * 3, 1.0, (), 11),
    ([OFF, ON] * 10, 3.33, (), 6), ([OFF, ON] * 10, 3.34, (), None),
    (levels(10, 20, 30, 10, 20, 30, 10), 1.0, (), 7),
    # A value that returns after more others than are remembered does not go back.
    (levels(*range(0, 100, 100 // (MAX_STATES + 1))) * 4, 0.1, (), None),
    (levels(*range(0, 100, 4)), 0.1, (), None),
    # Of a state that a command of ours may have made no earlier one counts.
    ([OFF, ON] * 6, 1.0, range(12), None), ([OFF, ON] * 6, 1.0, (3,), 8),
    # Heat dims, and external sync follows another signal.
    ([OFF, {**ON, **HOT}] * 6, 1.0, (), None), ([OFF, {**ON, **SYNC}] * 6, 1.0, (), None)])
def test_a_state_that_goes_back_and_forth_four_times_in_10_s_is_changing(
    states: list[dict[str, Any]], interval: float, commanded: tuple[int, ...], count: int | None,
) -> None:
    changing = ChangingStates()
    found = None
    for number, fields in enumerate(states):
        changing.add(status(number, **fields), 1000.0 + number * interval,
                     is_commanded=number in commanded)
        if changing.are_changing and found is None:
            found = number + 1
            assert changing.until == pytest.approx(1000.0 + number * interval + CALM_TIME)
    assert found == count


def test_states_count_as_changing_until_10_s_of_calm_though_commands_of_ours_are_under_way(
) -> None:
    changing = ChangingStates()
    for number in range(20):
        changing.add(status(number, **(ON if number % 2 else OFF)), 1000.0 + number,
                     is_commanded=number > 8)
    assert changing.until == 1019.0 + CALM_TIME
    for number in range(5):
        changing.add(status(20 + number, **ON), 1020.0 + number, is_commanded=False)
    assert changing.until == 1019.0 + CALM_TIME
