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

"""The confirmed configuration follows changes by other senders, without commands."""

from illuminator_ros.illuminator.events import Cause
from illuminator_ros.illuminator.model import float32, Mode
from illuminator_ros.mavlink.messages import MavCmd
import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight

CONFIGURE = MavCmd.DO_ILLUMINATOR_CONFIGURE
THROTTLED, SHUT_DOWN = 1, 2


@pytest.fixture
def fake() -> FakeLight:
    return FakeLight(brightness=80.0, strobe_period=1.0, strobe_duty_cycle=50.0)


def test_nothing_is_agreed_before_the_first_status():
    fake = FakeLight(stream=0.0)
    fake.answers.clear()
    assert Pair(fake).settle().snapshot.configuration is None


def test_a_first_status_that_cannot_be_believed_agrees_to_nothing():
    pair = Pair(FakeLight(brightness=float('nan'))).settle()
    assert pair.snapshot.configuration is None
    pair.other.fields['brightness'] = 10.0
    pair.run(1.0)
    assert pair.snapshot.configuration.brightness == 10.0


@pytest.mark.parametrize('change', [
    {'mode': 2}, {'brightness': 30.0}, {'strobe_period': 0.0}, {'strobe_duty_cycle': 12.5},
    {'brightness': 81.0, 'strobe_period': 2.0},
])
def test_a_change_from_outside_is_followed_with_one_event_and_no_command(fake, faked, change):
    fake.fields |= change
    faked.run(10.0)
    assert faked.recorder.changes[1:] == [(Cause.LIGHT, change)]
    assert faked.commands(CONFIGURE) == []


def test_a_change_from_outside_is_what_the_next_command_builds_on(fake, faked):
    fake.fields['strobe_period'] = 2.0
    faked.run(1.0)
    faked.configure(brightness=30)
    assert faked.commands(CONFIGURE)[-1].param3 == 2.0


@pytest.mark.parametrize('value', [60.1, 33.3, 0.1, 99.9])
def test_float32_rounding_is_no_change(faked, value):
    faked.configure(brightness=value, strobe_duty_cycle=value)
    faked.run(10.0)
    assert [cause for cause, _ in faked.recorder.changes] == [Cause.FIRST_STATUS, Cause.REQUEST]
    assert faked.snapshot.configuration.brightness == value


def test_float32_is_compared_with_all_the_precision_that_it_has(fake, faked):
    faked.configure(strobe_period=0.1)
    fake.fields['strobe_period'] = float32(0.1001)
    faked.run(2.0)
    assert faked.recorder.changes[-1] == (Cause.ROUNDING, {'strobe_period': 0.1001})


def test_a_change_within_a_lights_steps_is_followed_quietly(fake, faked):
    fake.fields['brightness'] = 80.3
    faked.run(10.0)
    assert faked.recorder.changes[1:] == [(Cause.ROUNDING, {'brightness': 80.3})]


@pytest.mark.parametrize(('flags', 'brightness'), [(THROTTLED, 40.0), (SHUT_DOWN, 0.0)])
def test_thermal_dimming_is_no_change_neither_on_its_way_down_nor_up(
        fake, faked, flags, brightness):
    fake.fields |= {'error_status': flags, 'brightness': brightness}
    faked.run(10.0)
    fake.fields |= {'error_status': 0, 'brightness': 80.0}
    faked.run(10.0)
    assert len(faked.recorder.changes) == 1
    assert faked.snapshot.configuration.brightness == 80.0


def test_the_simulated_light_getting_hot_is_no_change(pair):
    pair.enable(True)
    pair.lamp.thermal.temperature = 90.0
    pair.run(5.0)
    assert pair.light.status.brightness == 50.0
    assert len(pair.recorder.changes) == 1


def test_a_change_beside_thermal_dimming_is_followed(fake, faked):
    fake.fields |= {'error_status': THROTTLED, 'brightness': 40.0, 'strobe_period': 2.0}
    faked.run(10.0)
    assert faked.recorder.changes[1:] == [(Cause.LIGHT, {'strobe_period': 2.0})]


def test_external_sync_is_followed_with_what_it_does(fake, faked):
    fake.fields['mode'] = 2
    faked.run(2.0)
    assert faked.recorder.changes[-1] == (Cause.LIGHT, {'mode': Mode.EXTERNAL_SYNC})
    for brightness in (10.0, 90.0, 20.0):
        fake.fields['brightness'] = brightness
        faked.run(2.0)
        assert faked.recorder.changes[-1] == (Cause.LIGHT, {'brightness': brightness})


@pytest.mark.parametrize('change', [
    {'mode': 0}, {'brightness': float('nan')}, {'strobe_period': -1.0}])
def test_an_implausible_field_changes_no_parameter(fake, faked, change):
    fake.fields |= change
    faked.run(10.0)
    assert len(faked.recorder.changes) == 1


def test_a_change_that_takes_effect_after_its_answer_was_lost_is_followed(fake, faked):
    fake.results[CONFIGURE] = None
    assert not faked.configure(brightness=30).success
    fake.fields['brightness'] = 30.0
    faked.run(2.0)
    assert faked.recorder.changes[-1] == (Cause.REQUEST, {'brightness': 30.0})


def test_a_change_from_outside_during_a_command_is_followed_after_it(fake, faked):
    fake.results[CONFIGURE] = None
    answer = faked.ask_configure(brightness=30)
    fake.fields['strobe_period'] = 2.0
    assert not faked.wait_for(answer).success
    faked.run(2.0)
    assert faked.recorder.changes[1:] == [(Cause.LIGHT, {'strobe_period': 2.0})]


def test_small_steps_add_up_to_a_change_that_is_told(fake, faked):
    for _ in range(5):
        fake.fields['brightness'] -= 0.4
        faked.run(1.0)
    assert faked.snapshot.configuration.brightness == 78.0
    assert [cause for cause, _ in faked.recorder.changes].count(Cause.LIGHT) == 2
