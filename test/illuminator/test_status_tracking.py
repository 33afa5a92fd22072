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

"""Statuses in time: restarts, late frames, sending times, several lights at one address."""

from __future__ import annotations

import random
from typing import Any

from illuminator_ros.illuminator.model import Status
from illuminator_ros.illuminator.status_tracker import (
    AddressConflict,
    SendingTimes,
    Uptime,
    UptimeClock,
    WRAP_MS,
)
import pytest
from support.fake_light import status_message

RUNNING, RESTARTED, LATE = Uptime
HOUR_MS, DAY_MS = 3_600_000, 86_400_000
Fields = dict[str, Any]
OFF: Fields = {'enable': 0}
ON: Fields = {'enable': 1}
DIM: Fields = {'brightness': 20.0}


def status(uptime_ms: int, fields: Fields = {}) -> Status:  # noqa: B006 - it is not changed
    """Return a status."""
    return Status.from_message(status_message(uptime_ms, **fields))


# Uptimes

def meanings(*statuses: tuple[int, float]) -> list[Uptime]:
    """Return the meanings of uptimes, ms, that come at times, s."""
    clock = UptimeClock()
    return [clock.take(uptime_ms, now) for uptime_ms, now in statuses]


@pytest.mark.parametrize(('last_ms', 'new_ms', 'elapsed', 'meaning'), [
    # A stream, and the effects of clocks and lines on it.
    (10_000, 11_000, 1.0, RUNNING),
    (10_000, 11_000, 0.2, RUNNING),
    (10_000, 11_000, 2.5, RUNNING),
    (10_000, 10_001, 0.001, RUNNING),
    (HOUR_MS, 2 * HOUR_MS + 100_000, 3600.0, RUNNING),
    (HOUR_MS, 2 * HOUR_MS - 100_000, 3600.0, RUNNING),
    # The next status, in time, after a status that was 4 s late.
    (10_000, 14_100, 0.1, RUNNING),
    # The same one twice.
    (10_000, 10_000, 0.0, RUNNING),
    # A wrap after 49.7 days.
    (WRAP_MS - 500, 500, 1.0, RUNNING),
    (WRAP_MS - HOUR_MS, HOUR_MS, 7200.0, RUNNING),
    # Late frames: newer ones have arrived earlier, however old these are.
    (10_000, 9_000, 0.1, LATE),
    (10_000, 4_000, 0.1, LATE),
    (DAY_MS, DAY_MS - 20_000, 1.0, LATE),
    (500, WRAP_MS - 500, 0.1, LATE),
    # A frame from the start of a recently started light may be late, too.
    (10_000, 300, 1.0, LATE),
    (200, 100, 0.001, LATE),
    (10_000, 50_000, 100.0, LATE),
    # Restarts: a frame is never late by that much.
    (DAY_MS, 0, 1.0, RESTARTED),
    (DAY_MS, 1_500, 2.0, RESTARTED),
    (DAY_MS, HOUR_MS, 2 * 3600.0, RESTARTED),
    # A light without a clock.
    (0, 0, 1.0, RUNNING),
    (0, 0, 2.0, RUNNING),
    (7, 7, 10.0, RUNNING),
])
def test_an_uptime_shows_a_restart_a_late_frame_or_no_clock(
    last_ms: int, new_ms: int, elapsed: float, meaning: Uptime,
) -> None:
    assert meanings((last_ms, 100.0), (new_ms, 100.0 + elapsed))[-1] is meaning


@pytest.mark.parametrize(('statuses', 'meaning'), [
    # A second status continues the first one, which a delayed frame does not.
    ([(10_000, 100.0), (300, 101.0), (450, 101.15)], RESTARTED),
    # A second restart 1.1 s after the first, whose first status comes late.
    ([(DAY_MS, 97.0), (30, 100.0), (1_080, 102.18), (1_200, 102.3)], RESTARTED),
    # A light that was lost, restarted, and has now run for longer than before.
    ([(10_000, 100.0), (90_000, 200.0), (90_200, 200.2)], RESTARTED),
    # Frames that were queued while this process was suspended come in a burst.
    ([(1_000, 100.0), (2_000, 105.0), (3_000, 105.01), (4_000, 105.02)], LATE),
    # One late frame from the start of a light, before the stream continues.
    ([(9_000, 100.0), (500, 101.0), (10_010, 101.01)], RUNNING),
    # A clock that was set back is accepted after some time.
    ([(DAY_MS, 100.0), (HOUR_MS, 101.0), (HOUR_MS + 1000, 102.0)], LATE),
    ([(DAY_MS, 100.0), (HOUR_MS, 101.0), (HOUR_MS + 5100, 106.1)], RESTARTED),
])
def test_several_uptimes_show_what_one_cannot(
    statuses: list[tuple[int, float]], meaning: Uptime,
) -> None:
    assert meanings(*statuses)[-1] is meaning


@pytest.mark.parametrize(('uptimes', 'meaning'), [
    # The line delivers delayed statuses in a burst, and then the present one.
    ([(91_000, 110.0), (92_000, 110.001), (93_000, 110.002)], LATE),
    ([(91_000, 110.0), (91_001, 110.001)], LATE),
    ([(91_000, 110.0), (92_000, 110.001), (100_100, 110.1)], RUNNING),
    ([(91_000, 110.0), (92_000, 110.001), (3_000, 110.1)], RESTARTED),
    # The clock of the light stood still while it was lost.
    ([(91_000, 110.0), (91_150, 110.15)], RUNNING),
    # It is slow by 1 %.
    ([(189_000, 200.0)], RUNNING),
    # It counts seconds instead of milliseconds.
    ([(90_010 + number, 110.0 + number) for number in range(5)], LATE),
    ([(90_010 + number, 110.0 + number) for number in range(6)], RUNNING),
])
def test_a_status_that_a_stalled_line_held_back_does_not_show_that_a_lost_light_runs_on(
    uptimes: list[tuple[int, float]], meaning: Uptime,
) -> None:
    clock = UptimeClock()
    clock.take(90_000, 100.0)

    assert [clock.take(uptime_ms, now, was_lost=True)
            for uptime_ms, now in uptimes][-1] is meaning
    assert clock.is_suspecting is (meaning is LATE)


@pytest.mark.parametrize('drift', [0.96, 1.0, 1.04])
@pytest.mark.parametrize('interval', [0.02, 1.0, 10.0, 3600.0])
def test_a_clock_that_is_a_little_wrong_shows_no_restart(drift: float, interval: float) -> None:
    statuses = [(int(1000 * n * interval * drift), 50.0 + n * interval) for n in range(1, 200)]
    assert set(meanings(*statuses)) == {RUNNING}


# Sending times

@pytest.mark.parametrize(('statuses', 'sent_by', 'is_told'), [
    ([(5000, 100.0)], 100.0, False),
    ([(5000, 100.0), (6001, 101.0), (6301, 103.3)], 101.301, True),
    # A delayed status does not make the next delayed one look new.
    ([(5000, 100.0), (6001, 101.0), (6301, 103.3), (6401, 103.4)], 101.401, True),
    # Nor does the time since the last status without delay, which a clock error may explain.
    ([(5000, 100.0), (6001, 101.0), (9301, 104.36), (9901, 104.95)], 104.901, True),
    # A status of the same millisecond as another one was sent before that one was received.
    ([(5000, 100.0), (6001, 101.0), (6304, 101.302), (6304, 101.5, ON)], 101.302, True),
    # Nor does a pause make a delayed status look new, unless it is long.
    ([(5000, 100.0), (6001, 101.0), (8802, 108.9)], 103.802, True),
    ([(5000, 100.0), (6001, 101.0), (8802, 109.1)], 109.1, False),
    # A status in time, at regular intervals, does not look older than it is.
    ([(5000, 100.0), (6000, 101.0), (7000, 102.0)], 102.0, True),
    ([(5000, 100.0), (6000, 101.0), (7000, 102.9)], 102.001, True),
    # Without a clock the time of arrival counts; with a clock in seconds, its second counts too.
    ([(7, 100.0), (7, 101.0), (7, 107.0)], 107.0, False),
    ([(5000, 100.2), (5000, 100.9, ON), (6000, 101.3), (7000, 103.8)], 103.2, False),
    # A repeated frame does not show that the clock counts in seconds.
    ([(5000, 100.0), (5000, 100.9), (6000, 101.0), (7000, 102.9)], 102.001, True),
])
def test_the_sending_time_of_a_delayed_status_follows_from_its_uptime(
    statuses: list[tuple[Any, ...]], sent_by: float, is_told: bool,
) -> None:
    times = SendingTimes()
    by, told = [times.take(status(uptime, *fields), at)
                for uptime, at, *fields in statuses][-1]
    assert by == pytest.approx(sent_by)
    assert told is is_told


@pytest.mark.parametrize(('rate', 'older', 'newer'), [
    (1.0, 0.0, 0.025), (0.98, 0.21, 0.025), (1.02, 0.0, 0.08)])
@pytest.mark.parametrize('step_ms', [1, 10])
@pytest.mark.parametrize('boot', [0.0, -WRAP_MS / 1000 + 130.0])
def test_a_status_is_taken_neither_for_newer_than_it_is_nor_for_older_where_the_clock_is_right(
    step_ms: int, rate: float, boot: float, older: float, newer: float,
) -> None:
    draw = random.Random(f'{step_ms} {rate} {boot}')
    times, sent_at, arrivals = SendingTimes(), 100.0, []
    for _ in range(3000):
        sent_at += draw.choice((0.01, 0.3, 1.0))
        arrivals.append((sent_at + draw.choice((0.001, 0.01, draw.uniform(0, 3))), sent_at))
    newest = 0.0
    for at, sent_at in sorted(arrivals):
        # Overtaken statuses do not reach SendingTimes.
        if sent_at >= newest:
            newest = sent_at
            uptime = int((sent_at - boot) * rate * 1000 / step_ms) * step_ms
            sent_by, is_told = times.take(status(uptime % WRAP_MS), at)
            # Before that all statuses may have been delayed.
            if sent_at > 110.0:
                assert is_told
                assert -older - 1e-6 <= sent_by - sent_at <= newer


# Several lights at one address

class Observed:
    """Statuses in the order of their arrival, by default one a second."""

    def __init__(self) -> None:
        self.conflict = AddressConflict()
        self.now = 1000.0

    def see(
        self, *shown: Fields, starts: tuple[float, ...] = (0.0,), commanded: bool = False,
        late: float = 0.0, has_clock: bool = True,
    ) -> AddressConflict:
        """Take statuses with these values, in turn from lights with these starting times."""
        for number, fields in enumerate(shown):
            self.now += 1.0
            uptime = int((self.now - starts[number % len(starts)] - late) * 1000) % WRAP_MS
            self.conflict.take(
                status(int(uptime * has_clock), fields), self.now,
                commanded=commanded)
        return self.conflict


@pytest.mark.parametrize('shown', [
    [OFF, ON] * 3,
    [{'brightness': 100.0}, {'brightness': 40.0}] * 3,
    [{'mode': 1}, {'mode': 2}] * 3,
    [{'strobe_period': 0.0}, {'strobe_period': 0.5}] * 3,
    [{'strobe_duty_cycle': 0.0}, {'strobe_duty_cycle': 50.0}] * 3,
    [{**ON, 'brightness': 90.0}, {**OFF, 'brightness': 0.0}] * 3,
    [{'brightness': 100.0}, {'brightness': 50.0}, DIM] * 3,
    # A lost status delays the detection only.
    [*[OFF, ON] * 4, ON, *[OFF, ON] * 4, ON],
])
@pytest.mark.parametrize('has_clock', [True, False])
def test_statuses_that_alternate_are_those_of_several_lights(
    shown: list[Fields], has_clock: bool,
) -> None:
    assert Observed().see(*shown, has_clock=has_clock).detected


@pytest.mark.parametrize('shown', [
    [OFF] * 20,
    [OFF] * 5 + [ON] * 5,
    [OFF, ON, OFF],
    [OFF, ON, OFF, ON, OFF],
    [OFF, OFF, ON, ON] * 5,
    [OFF, OFF, ON] * 8,
    [{'brightness': float(value)} for value in range(0, 100, 5)],
    [{'brightness': 50.0}, {'brightness': 50.3}] * 5,
    [{'error_status': 1, 'brightness': 100.0}, {'error_status': 1, 'brightness': 80.0}] * 5,
    [{'error_status': 0, 'brightness': 100.0}, {'error_status': 1, 'brightness': 80.0}] * 5,
    [{'error_status': 2, 'enable': 1}, {'error_status': 2, 'enable': 0}] * 5,
    [{'mode': 2, 'enable': 1, 'brightness': 100.0}, {'mode': 2, 'enable': 0}] * 5,
    [{'temp_c': 20.0}, {'temp_c': 40.0}] * 5,
    [{'brightness': float('nan')}, {'brightness': 50.0}] * 5,
    [{'enable': 7}, {'enable': 1}] * 5,
], ids=[
    'no change', 'one change', 'there and back', 'twice there and back', 'changed each second',
    'flashed', 'a ramp', 'rounding', 'dimmed by heat', 'dimmed and not', 'shut down by heat',
    'external sync', 'temperature', 'implausible brightness', 'implausible enable'])
def test_one_light_that_changes_is_not_taken_for_several(shown: list[Fields]) -> None:
    assert not Observed().see(*shown).detected


def test_our_own_changes_are_not_evidence_of_several_lights() -> None:
    observed = Observed()
    for _ in range(10):
        for fields in (OFF, ON):
            observed.see(fields, commanded=True)
            observed.see(OFF if fields is ON else ON)
    assert not observed.conflict.detected


@pytest.mark.parametrize('apart', [2.0, 4.0, 60.0, 50 * 24 * 3600.0])
def test_two_lights_that_show_the_same_are_told_apart_by_their_uptimes(apart: float) -> None:
    assert Observed().see(*[OFF] * 7, starts=(0.0, -apart)).detected


@pytest.mark.parametrize(('starts', 'late'), [
    ((0.0, 1000.0, 1003.0, 1006.0, 1009.0, 1012.0), 0.0), ((0.0,) * 4, 3.0),
    ((1005.0 - WRAP_MS / 1000.0,) * 6, 0.0)], ids=['restarts', 'late frames', 'wrap'])
def test_one_light_with_odd_uptimes_is_not_taken_for_several(
    starts: tuple[float, ...], late: float,
) -> None:
    observed = Observed()
    for start in starts:
        observed.see(OFF, OFF, OFF, starts=(start,))
        if late:
            observed.see(OFF, starts=(start,), late=late)
    assert not observed.conflict.detected


def test_a_conflict_ends_when_the_statuses_agree_again() -> None:
    observed = Observed()
    observed.see(*[OFF, ON] * 6)
    assert observed.see(*[OFF] * 3).detected
    assert not observed.see(OFF).detected


@pytest.mark.parametrize(('shown', 'can_follow'), [
    ([OFF], True), ([OFF, ON], True), ([OFF, ON, OFF], False), ([OFF, ON, OFF, OFF], True),
    ([OFF, ON, OFF, DIM], False), ([OFF, ON, OFF, DIM, DIM], True)])
def test_a_change_back_is_followed_once_it_has_been_repeated(
    shown: list[Fields], can_follow: bool,
) -> None:
    assert Observed().see(*shown).can_follow is can_follow
