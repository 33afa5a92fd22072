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

"""Overrides: sent at the first connection, and again with the agreed ones after a restart."""

from illuminator_ros.illuminator.configuration import RESTORE_INTERVAL
from illuminator_ros.illuminator.events import Cause
from illuminator_ros.illuminator.light import Settings
from illuminator_ros.illuminator.model import Mode
from illuminator_ros.mavlink.messages import MavCmd, MavResult
import pytest
from support.back_to_back import Pair, START
from support.fake_light import FakeLight

CONFIGURE, ON_OFF = MavCmd.DO_ILLUMINATOR_CONFIGURE, MavCmd.ILLUMINATOR_ON_OFF


def overriding(fake, settings=None, **values):
    """Return a pair whose light must be configured as soon as it is found."""
    return Pair(fake, settings=settings,
                on_light=lambda light: light.set_desired(values, START))


def sent(pair, since=0.0):
    return [(m.param1, m.param2, m.param3, m.param4)
            for m in pair.commands(CONFIGURE, since=since)]


class TestAtTheFirstConnection:

    def test_overrides_are_sent_as_one_command_on_top_of_what_the_light_has(self, fake):
        fake.fields['strobe_duty_cycle'] = 7.0
        pair = overriding(fake, brightness=30.0, strobe_period=2.0).settle()
        assert sent(pair) == [(1, 30, 2, 7)]
        assert pair.recorder.restorations[0][0] is True
        assert pair.snapshot.configuration.brightness == 30.0

    def test_overrides_are_sent_however_late_the_light_is_found(self, fake):
        fake.silent = True
        pair = overriding(fake, brightness=30.0).settle(600.0)
        fake.silent = False
        pair.run(2.0)
        assert sent(pair) == [(1, 30, 0, 0)]

    def test_a_light_that_was_away_gets_nothing_again(self, fake):
        pair = overriding(fake, brightness=30.0).settle()
        fake.silent = True
        pair.run(30.0)
        fake.silent = False
        pair.run(30.0)
        assert len(sent(pair)) == 1

    def test_an_override_outside_the_limits_is_refused_and_the_rest_sent(self, fake):
        pair = overriding(fake, brightness=30.0, strobe_period=20.0).settle()
        assert sent(pair) == [(1, 30, 0, 0)]
        (failed, reason), (done, _) = pair.recorder.restorations
        assert (failed, done) == (False, True)
        assert 'strobe_period 20 s is outside what the light reports' in reason

    def test_overrides_that_are_all_impossible_send_nothing(self, fake):
        pair = overriding(fake, strobe_period=20.0).settle(30.0)
        assert sent(pair) == []
        assert len(pair.recorder.restorations) == 1
        fake.fields['brightness'] = 5.0
        pair.run(2.0)
        assert pair.snapshot.configuration.brightness == 5.0

    @pytest.mark.parametrize('result', [
        MavResult.DENIED, MavResult.UNSUPPORTED, MavResult.COMMAND_LONG_ONLY])
    def test_a_refusal_is_told_once_and_not_tried_again(self, fake, result):
        fake.results[CONFIGURE] = result
        pair = overriding(fake, brightness=30.0).settle(60.0)
        assert len(sent(pair)) == 1
        (success, message), = pair.recorder.restorations
        assert not success
        assert result.name in message
        assert result.name in pair.snapshot.discrepancy

    @pytest.mark.parametrize('result', [
        None, MavResult.TEMPORARILY_REJECTED, MavResult.IN_PROGRESS, MavResult.FAILED])
    def test_any_other_failure_is_tried_again_until_it_works(self, fake, result):
        fake.results[CONFIGURE] = result
        pair = overriding(fake, brightness=30.0).settle(20.0)
        assert pair.recorder.restorations == []
        assert pair.snapshot.discrepancy
        fake.results[CONFIGURE] = MavResult.ACCEPTED
        pair.run(RESTORE_INTERVAL + 1.0)
        assert [success for success, _ in pair.recorder.restorations] == [True]
        assert pair.snapshot.discrepancy == ''

    def test_overrides_that_a_light_accepts_and_never_shows_are_given_up(self, fake):
        # A light that clamps: it takes 100 % and gives 80 %.
        fake.applies = False
        fake.fields['brightness'] = 80.0
        pair = overriding(fake, brightness=100.0).settle(60.0)
        (success, message), = pair.recorder.restorations
        assert not success
        assert 'shows brightness 80 %' in message
        assert len(sent(pair)) <= 5

    def test_after_a_restart_what_was_given_up_is_tried_as_often_again(self, fake):
        fake.applies = False
        fake.fields['brightness'] = 80.0
        pair = overriding(fake, brightness=100.0).settle(60.0)
        given_up = len(sent(pair))
        assert pair.snapshot.configuration.brightness == 80.0
        fake.restart(pair.now, brightness=20.0)
        pair.run(60.0)
        assert len(sent(pair)) == 2 * given_up
        assert [success for success, _ in pair.recorder.restorations] == [False, False]

    def test_a_field_that_was_set_meanwhile_is_not_overridden(self, fake):
        fake.results[CONFIGURE] = None
        pair = overriding(fake, brightness=30.0, strobe_period=2.0).settle(1.5)
        fake.results[CONFIGURE] = MavResult.ACCEPTED
        assert pair.configure(brightness=70).success
        pair.run(10.0)
        assert fake.fields['brightness'] == 70.0
        assert fake.fields['strobe_period'] == 2.0

    def test_a_complete_set_reaches_a_light_that_sends_no_status(self, fake):
        fake.stream = 0.0
        fake.answers.clear()
        pair = overriding(fake, mode=Mode.EXTERNAL_SYNC, brightness=30.0, strobe_period=0.0,
                          strobe_duty_cycle=0.0).settle(20.0)
        assert sent(pair) == [(2, 30, 0, 0)]


class TestAfterARestart:

    @pytest.fixture
    def agreed(self, fake):
        pair = overriding(fake, brightness=30.0).settle()
        assert pair.configure(strobe_period=2, strobe_duty_cycle=40).success
        return pair

    def test_the_confirmed_configuration_is_sent_with_the_overrides(self, fake, agreed):
        fake.restart(agreed.now)
        agreed.run(5.0)
        assert sent(agreed)[-1] == (1, 30, 2, 40)
        assert fake.fields['brightness'] == 30.0
        assert [success for success, _ in agreed.recorder.restorations] == [True, True]

    def test_a_light_that_kept_its_configuration_gets_nothing(self, fake, agreed):
        at, kept = agreed.now, dict(fake.fields)
        fake.restart(agreed.now, **kept)
        agreed.run(10.0)
        assert sent(agreed, since=at) == []

    def test_after_it_changes_from_outside_are_followed_again(self, fake, agreed):
        fake.restart(agreed.now)
        agreed.run(5.0)
        fake.fields['brightness'] = 66.0
        agreed.run(2.0)
        assert agreed.recorder.changes[-1] == (Cause.LIGHT, {'brightness': 66.0})

    def test_a_second_restart_during_the_restoring_is_made_good_too(self, fake, agreed):
        fake.apply_after = 0.3
        fake.restart(agreed.now)
        agreed.run(0.1)
        fake._to_apply.clear()
        fake.restart(agreed.now)
        agreed.run(10.0)
        assert (fake.fields['brightness'], fake.fields['strobe_period']) == (30.0, 2.0)

    def test_a_field_set_during_the_restoring_keeps_its_value(self, fake, agreed):
        fake.results[CONFIGURE] = [None] * 8 + [MavResult.ACCEPTED]
        fake.restart(agreed.now)
        agreed.run(1.2)
        agreed.configure(brightness=70)
        agreed.run(20.0)
        assert agreed.configure(brightness=70).success
        agreed.run(10.0)
        assert (fake.fields['brightness'], fake.fields['strobe_period']) == (70.0, 2.0)

    @pytest.mark.parametrize('by', ['parameters', 'setpoint'])
    def test_setting_all_that_is_to_be_restored_ends_the_restoring(self, fake, by):
        pair = Pair(fake).settle()
        assert pair.configure(brightness=30).success
        fake.results[CONFIGURE] = None
        fake.restart(pair.now)
        pair.run(1.2)
        fake.results[CONFIGURE] = MavResult.ACCEPTED
        if by == 'parameters':
            assert pair.configure(mode='internal_control', brightness=70, strobe_period=1,
                                  strobe_duty_cycle=10).success
        else:
            assert pair.configure(mode='internal_control', strobe_period=1,
                                  strobe_duty_cycle=10).success
            pair.light.set_brightness(70.0, pair.now)
            pair.run_until(lambda: pair.snapshot.configuration.brightness == 70.0)
        # Before the next status another sender dims it, which must be followed.
        fake.fields['brightness'] = 20.0
        pair.run(5.0)
        assert pair.snapshot.configuration.brightness == 20.0

    def test_the_light_is_never_switched_on(self, fake, agreed):
        agreed.enable(True)
        at = agreed.now
        fake.restart(agreed.now)
        agreed.run(60.0)
        assert agreed.commands(ON_OFF, since=at) == []
        assert fake.fields['enable'] == 0

    def test_a_refusal_of_what_was_agreed_is_told(self, fake, agreed):
        fake.results[CONFIGURE] = MavResult.DENIED
        fake.restart(agreed.now)
        agreed.run(10.0)
        assert agreed.recorder.restorations[-1][0] is False
        assert agreed.snapshot.discrepancy

    def test_after_a_refusal_what_the_light_shows_is_followed(self, fake, agreed):
        fake.results[CONFIGURE] = MavResult.DENIED
        fake.restart(agreed.now)
        agreed.run(10.0)
        assert agreed.snapshot.configuration.brightness == 100.0


class TestWithoutRestoring:

    @pytest.fixture
    def pair(self, fake):
        return overriding(fake, Settings(restore_configuration=False), brightness=30.0).settle()

    def test_after_a_restart_the_light_is_followed(self, fake, pair):
        fake.restart(pair.now)
        pair.run(10.0)
        assert len(sent(pair)) == 1
        assert pair.recorder.changes[-1] == (Cause.LIGHT, {'brightness': 100.0})


def test_overrides_that_wait_for_a_status_in_vain_are_told_once():
    fake = FakeLight(strobe_duty_cycle=float('nan'))
    pair = overriding(fake, brightness=60.0)
    pair.run(30.0)
    (success, message), = pair.recorder.restorations
    assert not success
    assert message.startswith('brightness not sent: the light has not reported its configuration')
    assert pair.snapshot.discrepancy == message
    fake.fields['strobe_duty_cycle'] = 0.0
    pair.run(3.0)
    assert fake.fields['brightness'] == 60.0
