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

"""Two configurations compared: what is another one, and what has a good reason."""

from dataclasses import replace

from illuminator_ros.illuminator.model import Configuration, float32, Mode, unexpected_differences
import pytest

BASE = Configuration(Mode.INTERNAL_CONTROL, 50.0, 1.0, 25.0)
SYNCED = replace(BASE, mode=Mode.EXTERNAL_SYNC)
UNKNOWN = replace(BASE, mode=Mode.UNKNOWN)
THROTTLED, SHUT_DOWN, THERMISTOR = 1, 2, 4


@pytest.mark.parametrize('changes', [
    {}, {'brightness': 50.4}, {'brightness': 49.6}, {'strobe_duty_cycle': 25.4},
    {'strobe_period': 1.009}, {'brightness': float32(50.1)},
])
def test_rounding_to_the_steps_of_a_light_is_not_a_difference(changes):
    assert BASE.differences(replace(BASE, **changes)) == []


@pytest.mark.parametrize(('changes', 'names'), [
    ({'brightness': 50.6}, ['brightness']),
    ({'strobe_duty_cycle': 24.4}, ['strobe_duty_cycle']),
    ({'strobe_period': 1.02}, ['strobe_period']),
    ({'strobe_period': 0.0}, ['strobe_period']),
    ({'mode': Mode.EXTERNAL_SYNC}, ['mode']),
    ({'mode': Mode.EXTERNAL_SYNC, 'brightness': 0.0, 'strobe_period': 9.0,
      'strobe_duty_cycle': 0.0},
     ['mode', 'brightness', 'strobe_period', 'strobe_duty_cycle']),
])
def test_more_than_a_step_is_a_difference_and_named(changes, names):
    assert BASE.differences(replace(BASE, **changes)) == names


@pytest.mark.parametrize('value', [60.1, 33.3, 0.1, 99.9])
def test_float32_rounding_is_never_a_difference(value):
    asked = replace(BASE, brightness=value, strobe_period=value, strobe_duty_cycle=value)
    shown = replace(BASE, brightness=float32(value), strobe_period=float32(value),
                    strobe_duty_cycle=float32(value))
    assert asked.differences(shown, step=False) == []


@pytest.mark.parametrize('changes', [
    {'brightness': 50.4}, {'strobe_duty_cycle': 25.1}, {'strobe_period': 1.001}])
def test_steps_are_differences_where_they_are_asked_for(changes):
    assert BASE.differences(replace(BASE, **changes), step=False) == list(changes)


def test_a_light_of_unknown_mode_is_sent_internal_control():
    assert UNKNOWN.params() == (1.0, 50.0, 1.0, 25.0)
    assert SYNCED.params() == (2.0, 50.0, 1.0, 25.0)


def test_a_description_has_units_and_can_be_partial():
    assert BASE.describe() == ('mode internal_control, brightness 50 %, strobe_period 1 s, '
                               'strobe_duty_cycle 25 %')
    assert BASE.describe(['strobe_period']) == 'strobe_period 1 s'


@pytest.mark.parametrize('step', [True, False])
@pytest.mark.parametrize(('flags', 'brightness', 'names'), [
    (0, 25.0, ['brightness']),
    (THROTTLED, 25.0, []),
    (SHUT_DOWN, 0.0, []),
    (THERMISTOR, 25.0, ['brightness']),
    (THROTTLED, 75.0, ['brightness']),
])
def test_a_hot_light_may_be_dimmer_but_not_brighter(flags, brightness, names, step):
    reported = replace(BASE, brightness=brightness)
    assert unexpected_differences(BASE, reported, flags, step=step) == names


@pytest.mark.parametrize('step', [True, False])
def test_a_light_that_does_not_say_its_mode_does_not_contradict(step):
    assert unexpected_differences(BASE, UNKNOWN, 0, step=step) == []


def test_a_mode_that_was_unknown_is_news_but_no_contradiction():
    assert unexpected_differences(UNKNOWN, BASE, 0, step=True) == []
    assert unexpected_differences(UNKNOWN, BASE, 0, step=False) == ['mode']


def test_under_external_sync_the_output_may_be_anything():
    shown = replace(SYNCED, brightness=3.0, strobe_period=0.2, strobe_duty_cycle=77.0)
    assert unexpected_differences(SYNCED, shown, 0, step=True) == []


def test_leaving_external_sync_is_a_difference():
    assert unexpected_differences(SYNCED, BASE, 0, step=True) == ['mode']
