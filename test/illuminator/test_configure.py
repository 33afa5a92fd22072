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

"""Configuring a light: one atomic command, verified, and nothing kept that was not accepted."""

from dataclasses import astuple

from illuminator_ros.illuminator.events import Cause
from illuminator_ros.illuminator.model import Configuration, Mode
from illuminator_ros.mavlink.messages import MavCmd, MavResult
import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight

CONFIGURE = MavCmd.DO_ILLUMINATOR_CONFIGURE


def sent(pair):
    """Return the params of the configurations that were sent, tries included."""
    return [(m.param1, m.param2, m.param3, m.param4) for m in pair.commands(CONFIGURE)]


def test_one_value_is_sent_with_the_other_three_as_they_are(pair):
    assert pair.configure(brightness=50).success
    assert pair.configure(strobe_period=0.5).success
    assert sent(pair) == [(1, 50, 0, 0), (1, 50, 0.5, 50)]


def test_several_values_are_one_command(pair):
    result = pair.configure(mode='external_sync', brightness=10, strobe_period=2,
                            strobe_duty_cycle=30)
    assert result.success
    assert sent(pair) == [(2, 10, 2, 30)]
    assert astuple(pair.snapshot.configuration) == (Mode.EXTERNAL_SYNC, 10.0, 2.0, 30.0)


def test_success_says_what_is_new_and_how_it_is_known(pair):
    message = pair.configure(brightness=50, strobe_duty_cycle=5).message
    assert message.startswith('brightness 50 %, strobe_duty_cycle 5 %, confirmed by '
                              'ILLUMINATOR_STATUS: MAV_RESULT_ACCEPTED (1 try, ')


def test_a_confirmed_configuration_is_one_event_before_the_answer(pair):
    told = []
    pair.light.configure(
        {'brightness': 50}, pair.now, lambda result, now: told.append(pair.recorder.changes[-1]))
    pair.run(5.0)
    assert told == [(Cause.REQUEST, {'brightness': 50.0})]
    assert len(pair.recorder.changes) == 2


@pytest.mark.parametrize('changes', [
    {'brightness': 101}, {'brightness': float('nan')}, {'strobe_period': 11},
    {'strobe_period': 0.01}, {'mode': 'unknown'}, {'strobe_duty_cycle': True},
    {'brightness': 50, 'strobe_duty_cycle': -1},
])
def test_a_wrong_value_fails_at_once_and_nothing_is_sent(pair, changes):
    answer = pair.ask_configure(**changes)
    assert (answer.seconds, answer.result.success, answer.result.permanent) == (0.0, False, True)
    assert sent(pair) == []


@pytest.mark.parametrize('result', [
    MavResult.DENIED, MavResult.UNSUPPORTED, MavResult.FAILED, MavResult.CANCELLED, 77])
def test_a_refusal_keeps_the_agreed_configuration(fake, faked, result):
    agreed = faked.snapshot.configuration
    fake.results[CONFIGURE] = result
    answer = faked.configure(brightness=50)
    assert answer.message.startswith('refused: MAV_RESULT')
    assert faked.snapshot.configuration is agreed


def test_a_contradiction_is_a_failure_and_a_discrepancy(fake, faked):
    fake.applies = False
    result = faked.configure(brightness=50, strobe_duty_cycle=1)
    assert result.contradicted
    assert 'STATUS shows brightness 100 %, strobe_duty_cycle 0 % (' in result.message
    assert faked.snapshot.discrepancy == result.message


def test_a_discrepancy_ends_when_the_light_shows_it_after_all(fake, faked):
    fake.apply_after = 2.0
    assert not faked.configure(brightness=50).success
    assert faked.snapshot.discrepancy
    faked.run(3.0)
    assert faked.snapshot.discrepancy == ''
    assert faked.snapshot.configuration.brightness == 50.0


def test_an_unbelievable_part_of_a_status_neither_shows_nor_contradicts(fake, faked):
    fake.fields['strobe_duty_cycle'] = float('nan')
    fake.applies = False
    assert 'shows brightness 100 %' in faked.configure(brightness=40).message
    fake.fields['brightness'] = 40.0
    assert faked.configure(brightness=40).success


def test_a_light_that_rounds_to_its_steps_agrees_to_what_it_shows(fake, faked):
    fake.applies = False
    fake.fields['brightness'] = 50.4
    assert faked.configure(brightness=50).success
    assert faked.snapshot.configuration.brightness == 50.4


def test_a_hot_light_agrees_to_what_it_was_asked_for(fake, faked):
    fake.applies = False
    fake.fields |= {'brightness': 30.0, 'error_status': 1}
    result = faked.configure(brightness=80)
    assert result.success
    assert result.message.startswith(
        'brightness 80 %, confirmed by ILLUMINATOR_STATUS, but thermal throttling: ')
    assert faked.snapshot.configuration.brightness == 80.0


def test_a_light_under_external_sync_need_not_show_the_rest(fake, faked):
    fake.applies = False
    fake.fields |= {'mode': 2, 'brightness': 3.0, 'strobe_period': 0.2}
    result = faked.configure(mode='external_sync', brightness=80)
    assert result.success
    assert 'accepted (ILLUMINATOR_STATUS shows brightness 3 %)' in result.message
    assert faked.snapshot.configuration.brightness == 80.0


def test_a_late_status_from_before_the_command_confirms_nothing(fake, faked):
    faked.configure(brightness=50)
    shown_50 = fake.status(faked.now)
    faked.run(0.2)
    faked.configure(brightness=60)
    fake.stream, fake.applies = 0.0, False
    answer = faked.ask_configure(brightness=50)
    faked.run(0.005)
    fake.send(shown_50)
    assert faked.wait_for(answer).contradicted


class TestBeforeTheFirstStatus:

    @pytest.fixture
    def fake(self):
        fake = FakeLight(stream=0.0)
        fake.answers.clear()
        return fake

    def test_a_part_of_the_configuration_is_refused_with_what_is_missing(self, faked):
        result = faked.configure(brightness=50)
        assert result.message == (
            'the light has not reported its configuration yet, so mode, strobe_period, '
            'strobe_duty_cycle must be set in the same call')
        assert sent(faked) == []

    def test_all_of_it_is_sent_and_agreed(self, faked):
        result = faked.configure(mode='internal_control', brightness=50, strobe_period=0,
                                 strobe_duty_cycle=0)
        assert result.success
        assert 'accepted, not confirmed' in result.message
        assert faked.snapshot.configuration == Configuration(
            Mode.INTERNAL_CONTROL, 50.0, 0.0, 0.0)


def test_a_mode_that_the_light_does_not_say_is_sent_as_internal_control():
    fake = FakeLight(mode=0)
    fake.applies = False
    pair = Pair(fake).settle()
    fake.fields['brightness'] = 50.0
    assert pair.configure(brightness=50).success
    assert sent(pair) == [(1, 50, 0, 0)]
