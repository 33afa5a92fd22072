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

"""Lights as they are in the field: the developer guide's emulator, ArduSub, and others."""

from illuminator_ros.illuminator.light import Settings
from illuminator_ros.illuminator.model import Limits
from illuminator_ros.mavlink.messages import Address, CommandInt, MavCmd, MavResult
import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight

CONFIGURE = MavCmd.DO_ILLUMINATOR_CONFIGURE


class GuideEmulator(FakeLight):
    """Address 255/0, acknowledges first and without a target, has no clock and no COMMAND_INT."""

    def __init__(self):
        super().__init__(Address(255, 0), min_strobe_period=0.0)
        self.targeted = False
        self.apply_after = 0.001
        self.boot = None

    def receive(self, source, message, now):
        if not isinstance(message, CommandInt):
            super().receive(source, message, now)


class ArduSub(FakeLight):
    """The lights of an autopilot: no heartbeat as a light, and on is what has a brightness."""

    def __init__(self):
        super().__init__(Address(1, 1), heartbeat_type=12, mode_bitmask=2, brightness=0.0,
                         temp_c=0.0, min_strobe_period=0.0, max_strobe_period=0.0)
        self.last = 50.0

    def _apply(self, message, now):
        if message.command == CONFIGURE:
            self.fields['brightness'] = message.param2
        else:
            self.fields['brightness'] = self.last if message.param1 else 0.0
        self.last = self.fields['brightness'] or self.last
        self.fields['enable'] = int(self.fields['brightness'] > 0)


class TestGuideEmulator:

    @pytest.fixture
    def pair(self):
        return Pair(GuideEmulator()).settle()

    def test_the_light_is_found_and_served(self, pair):
        assert pair.light.address == Address(255, 0)
        assert pair.enable(True).success
        assert pair.configure(brightness=30, strobe_period=1, strobe_duty_cycle=50).success
        assert pair.other.fields['brightness'] == 30.0

    def test_the_light_is_served_with_command_long_only(self, pair):
        pair.enable(True)
        assert not any(isinstance(message, CommandInt) for message in pair.commands())

    def test_an_uptime_of_0_for_ever_is_no_restart(self, pair):
        pair.run(120.0)
        assert pair.recorder.events == ['connected']

    def test_after_an_absence_it_gets_its_configuration_back(self, pair):
        pair.configure(brightness=30)
        pair.other.silent = True
        pair.run(10.0)
        pair.other.silent = False
        pair.other.restart(pair.now)
        pair.run(5.0)
        assert pair.other.fields['brightness'] == 30.0

    def test_nan_in_its_status_is_named_and_followed_by_nothing(self, pair):
        pair.other.fields['brightness'] = float('nan')
        pair.run(2.0)
        assert pair.light.status.invalid == ('brightness nan',)
        assert pair.snapshot.configuration.brightness == 100.0


class TestArduSub:

    @pytest.fixture
    def pair(self):
        return Pair(ArduSub()).settle()

    def test_the_light_is_found_by_its_status(self, pair):
        assert pair.light.address == Address(1, 1)
        assert pair.recorder.events == ['connected']

    def test_a_temperature_that_is_not_measured_is_unknown(self, pair):
        assert pair.light.temperature is None
        assert pair.light.limits == Limits()
        assert not pair.light.limits.known

    def test_the_light_can_be_switched(self, pair):
        assert pair.enable(True).success
        assert pair.light.status.brightness == 50.0
        assert pair.enable(False).success

    def test_a_brightness_above_0_switches_it_on_and_0_off(self, pair):
        assert pair.configure(brightness=70).success
        assert pair.light.status.enabled is True
        assert pair.configure(brightness=0).success
        assert pair.light.status.enabled is False

    def test_a_strobe_that_it_takes_and_does_not_do_is_no_success(self, pair):
        result = pair.configure(brightness=70, strobe_period=1)
        assert not result.success
        assert 'shows strobe_period 0 s' in result.message


def test_the_temperature_is_known_from_the_first_one_that_is_not_0():
    fake = FakeLight(temp_c=0.0)
    pair = Pair(fake).settle()
    assert pair.light.temperature is None
    fake.fields['temp_c'] = -3.0
    pair.run(1.5)
    assert pair.light.temperature == -3.0
    fake.fields['temp_c'] = 0.0
    pair.run(1.5)
    assert pair.light.temperature == 0.0


@pytest.mark.parametrize('broken', [{'error_status': 4}, {'temp_c': float('nan')}])
def test_the_temperature_is_not_known_while_the_sensor_fails(fake, faked, broken):
    assert faked.light.temperature == 25.0
    fake.fields |= broken
    faked.run(1.5)
    assert faked.light.temperature is None


def test_a_light_that_knows_nothing_but_its_own_two_commands_is_served():
    fake = FakeLight(results={MavCmd.REQUEST_MESSAGE: MavResult.UNSUPPORTED,
                              MavCmd.SET_MESSAGE_INTERVAL: MavResult.UNSUPPORTED})
    fake.stream = 0.5
    pair = Pair(fake, settings=Settings(status_interval=0.1)).settle()
    assert pair.enable(True).success
    assert pair.configure(brightness=50).success
