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

"""Several lights behind one address are told from one light that is changed."""

from illuminator_ros.illuminator.model import Status
from illuminator_ros.illuminator.status import AddressConflict
import pytest
from support.fake_light import status_message

HOUR_MS = 3_600_000
OFF, ON = {'enable': 0}, {'enable': 1}


class Observed:
    """Statuses as they come, one a second unless said otherwise."""

    def __init__(self):
        self.conflict = AddressConflict()
        self.now = 1000.0

    def see(self, *shown, starts=(0.0,), every=1.0, commanded=False, late=0.0):
        """Take statuses that show this, from lights that were started at these times in turn."""
        for number, fields in enumerate(shown):
            self.now += every
            running = self.now - starts[number % len(starts)] - late
            self.conflict.take(
                Status.from_message(status_message(int(running * 1000), **fields)), self.now,
                commanded=commanded)
        return self.conflict


@pytest.mark.parametrize(('first', 'second'), [
    (OFF, ON),
    ({'brightness': 100.0}, {'brightness': 40.0}),
    ({'mode': 1}, {'mode': 2}),
    ({'strobe_period': 0.0}, {'strobe_period': 0.5}),
    ({'strobe_duty_cycle': 0.0}, {'strobe_duty_cycle': 50.0}),
    ({'enable': 1, 'brightness': 90.0}, {'enable': 0, 'brightness': 0.0}),
])
def test_statuses_that_contradict_each_other_in_turn_are_of_several_lights(first, second):
    assert Observed().see(first, second, first, second, first, second).detected


def test_three_lights_in_turn_are_told_too():
    shown = [{'brightness': value} for value in (100.0, 50.0, 20.0)]
    assert Observed().see(*shown * 3).detected


def test_lights_without_a_clock_are_told_by_what_they_show():
    conflict = AddressConflict()
    for number in range(8):
        conflict.take(Status.from_message(status_message(0, enable=number % 2)), 1000.0 + number,
                      commanded=False)
    assert conflict.detected


def test_a_status_that_is_lost_now_and_then_delays_the_verdict_only():
    observed = Observed()
    for _ in range(2):
        observed.see(*[OFF, ON] * 4, ON)
    assert observed.conflict.detected


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
    'external sync', 'temperature', 'unbelievable brightness', 'unbelievable enable'])
def test_one_light_that_changes_is_not_taken_for_several(shown):
    assert not Observed().see(*shown).detected


def test_our_own_changes_are_no_evidence_of_several_lights():
    observed = Observed()
    for _ in range(10):
        observed.see(OFF, commanded=True)
        observed.see(ON)
        observed.see(ON, commanded=True)
        observed.see(OFF)
    assert not observed.conflict.detected


class TestClocks:

    @pytest.mark.parametrize('apart', [2.0, 4.0, 60.0, 50 * 24 * 3600.0])
    def test_two_lights_that_show_the_same_are_told_by_their_uptimes(self, apart):
        assert Observed().see(*[OFF] * 7, starts=(0.0, -apart)).detected

    def test_a_light_that_restarts_is_one_light(self):
        observed = Observed()
        for start in (0.0, 1000.0, 1003.0, 1006.0, 1009.0, 1012.0):
            observed.see(OFF, OFF, starts=(start,))
        assert not observed.conflict.detected

    def test_a_light_whose_uptime_wraps_is_one_light(self):
        start = 1005.0 - (1 << 32) / 1000.0
        conflict = AddressConflict()
        for number in range(12):
            now = 1000.0 + number
            uptime_ms = int((now - start) * 1000) % (1 << 32)
            conflict.take(Status.from_message(status_message(uptime_ms)), now, commanded=False)
        assert not conflict.detected

    def test_a_slower_second_way_repeats_frames_and_is_no_second_light(self):
        conflict = AddressConflict()
        frames = [
            Status.from_message(status_message(100_000 + 1000 * number, enable=number % 3 > 1))
            for number in range(20)]
        for number in range(2, 20):
            conflict.take(frames[number], 1000.0 + number, commanded=False)
            conflict.take(frames[number - 2], 1000.1 + number, commanded=False)
        assert not conflict.detected

    def test_a_few_late_frames_are_no_second_light(self):
        observed = Observed()
        for _ in range(4):
            observed.see(OFF, OFF, OFF)
            observed.see(OFF, late=3.0)
        assert not observed.conflict.detected


def test_the_verdict_ends_when_the_statuses_agree_again():
    observed = Observed()
    observed.see(*[OFF, ON] * 6)
    assert observed.see(*[OFF] * 3).detected
    assert not observed.see(OFF).detected


def test_a_light_that_was_lost_is_judged_anew():
    observed = Observed()
    observed.see(*[OFF, ON] * 6)
    observed.conflict = AddressConflict()
    assert not observed.conflict.detected
    assert observed.conflict.can_follow
    assert not observed.see(*[OFF, ON] * 2).detected


@pytest.mark.parametrize(('shown', 'settled'), [
    ([OFF], True),
    ([OFF, ON], True),
    ([OFF, ON, OFF], False),
    ([OFF, ON, OFF, OFF], True),
    ([OFF, ON, OFF, {'brightness': 20.0}], False),
    ([OFF, ON, OFF, {'brightness': 20.0}, {'brightness': 20.0}], True),
])
def test_a_change_back_is_followed_once_it_has_been_repeated(shown, settled):
    assert Observed().see(*shown).can_follow is settled
