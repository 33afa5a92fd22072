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

"""Requests and parameters while several lights answer from one address."""

from illuminator_ros.illuminator.events import Cause
from illuminator_ros.illuminator.light import Light, Settings
from illuminator_ros.mavlink.command import CommandSender
from illuminator_ros.mavlink.messages import Address, MavCmd
import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight
from support.shared_address import SharedAddress

AUTOPILOT = Address(1, 1)


def two(*, second_boot=0.0, offset=0.01, **second):
    """Return a pair with two lights behind one component, the second one different."""
    lights = [FakeLight(AUTOPILOT, heartbeat_type=None),
              FakeLight(AUTOPILOT, heartbeat_type=None, **second)]
    for light in lights:
        light.pushes = True
    lights[1].boot = second_boot
    return Pair(SharedAddress(*lights, offset=offset))


@pytest.fixture
def different() -> Pair:
    """Return two lights of which one is on and less bright, for long enough to be told."""
    return two(enable=1, brightness=40.0).settle(6.0)


def test_two_lights_that_show_the_same_are_one():
    pair = two().settle(10.0)
    assert not pair.snapshot.shared_address


@pytest.mark.parametrize('offset', [0.0, 0.01, 0.5])
def test_parameters_move_once_at_most_while_two_lights_are_told_apart(offset):
    pair = two(enable=1, brightness=40.0, offset=offset).settle(60.0)
    assert [cause for cause, _ in pair.recorder.changes][1:] in ([], [Cause.LIGHT])


def test_the_bridge_sends_nothing_to_make_two_lights_equal(different):
    before = different.now
    different.run(30.0)
    assert different.commands(MavCmd.DO_ILLUMINATOR_CONFIGURE, MavCmd.ILLUMINATOR_ON_OFF) == []
    assert different.recorder.events == ['connected']
    assert len(different.recorder.statuses) >= 2 * (different.now - before)


def test_lights_of_one_address_with_clocks_of_their_own_do_not_look_restarted_for_ever():
    pair = two(second_boot=-3600.0).settle(10.0)
    restarts = pair.light.restarts
    assert pair.snapshot.shared_address
    pair.run(60.0)
    assert pair.light.restarts == restarts <= 3


def test_a_command_is_confirmed_once_both_lights_show_it(different):
    result = different.enable(True)
    assert result.success
    assert [light.fields['enable'] for light in different.other.lights] == [1, 1]


def test_a_command_that_one_of_two_lights_does_not_carry_out_is_no_success(different):
    different.other.lights[0].applies = False
    result = different.enable(True)
    assert not result.success
    assert 'shows off' in result.message
    assert 'several lights answer as 1/1' in result.message


def test_a_status_that_is_lost_does_not_move_the_parameters(different):
    agreed = different.snapshot.configuration
    for light in different.other.lights:
        light.delay_status(1.0)
        different.run(5.0)
    assert different.snapshot.shared_address
    assert different.snapshot.configuration == agreed


def test_lights_that_were_lost_are_judged_anew(different):
    different.close()
    assert not different.snapshot.shared_address


def test_a_set_makes_two_lights_one_again(different):
    result = different.configure(brightness=70.0)
    # Within 0.85 s a second light that reports once a second may have said nothing.
    assert 'not each of several lights that answer as 1/1' in result.message
    different.enable(True)
    different.run(6.0)
    assert not different.snapshot.shared_address
    assert different.snapshot.configuration.brightness == 70.0


def test_parameters_follow_again_once_the_lights_agree(different):
    for light in different.other.lights:
        light.fields |= {'enable': 1, 'brightness': 55.0}
    different.run(6.0)
    assert different.snapshot.configuration.brightness == 55.0


@pytest.mark.parametrize('instance', [0, 2])
def test_commands_carry_the_instance_of_the_light_and_0_is_all(instance):
    sender = CommandSender(Address(1, 194))
    light = Light(
        AUTOPILOT, sender, Settings(), lambda event: None, lambda light, now: None,
        instance=instance)
    light.heard(0.0)
    light.enable(True, 0.0, lambda result, now: None)
    light.configure(
        {'mode': 'internal_control', 'brightness': 50.0, 'strobe_period': 0.0,
         'strobe_duty_cycle': 0.0}, 0.0, lambda result, now: None)
    sent = [message for _, message in sender.outgoing]
    switch, configure = (
        next(one for one in sent if one.command == kind)
        for kind in (MavCmd.ILLUMINATOR_ON_OFF, MavCmd.DO_ILLUMINATOR_CONFIGURE))
    assert (switch.param1, switch.param2) == (1.0, instance)
    assert (configure.param1, configure.param2, configure.param5) == (1.0, 50.0, instance)
