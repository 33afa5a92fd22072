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

"""One request to all lights: one answer, which names what became of each."""

from illuminator_ros.illuminator.group import enable_all
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.mavlink.messages import Address
import pytest
from support.back_to_back import Answer, Pair

LIGHTS = [IlluminatorProperties(Address(1, component)) for component in (243, 244, 245)]


@pytest.fixture
def fleet() -> Pair:
    """Return a controller and three lights that know each other."""
    return Pair(LIGHTS).settle()


def ask(fleet, on=True):
    """Begin to switch all lights."""
    answer = Answer(fleet.now)
    enable_all(list(fleet.controller.lights.values()), on, fleet.now, answer,
               name=lambda light: f'lamp {light.address}')
    fleet.turn()
    return answer


def silence(fleet, index):
    """Have a light hear no commands any more, though it still reports."""
    fleet.other.components[index].addressed = lambda message: False


def test_all_lights_are_switched_and_each_is_named(fleet):
    result = fleet.wait_for(ask(fleet))
    assert result.success
    assert [light.device.enabled for light in fleet.other.components] == [True] * 3
    summary, *outcomes = result.message.split('; ')
    assert summary == '3 of 3 on'
    assert [outcome.partition(': ')[0] for outcome in outcomes] == [
        'lamp 1/243', 'lamp 1/244', 'lamp 1/245']
    assert all('on, confirmed by ILLUMINATOR_STATUS' in outcome for outcome in outcomes)


def test_one_light_that_fails_makes_it_no_success_and_the_others_are_switched(fleet):
    silence(fleet, 1)
    result = fleet.wait_for(ask(fleet))
    assert not result.success
    assert result.message.startswith('2 of 3 on; lamp 1/243: on, confirmed')
    assert 'lamp 1/244: no acknowledgement (4 tries' in result.message
    assert [light.device.enabled for light in fleet.other.components] == [True, False, True]


def test_the_commands_go_out_together_and_the_answer_comes_with_the_slowest(fleet):
    silence(fleet, 0)
    answer = ask(fleet)
    assert len({command.target_component for command in fleet.commands(since=fleet.now)}) == 3
    fleet.wait_for(answer)
    alone = fleet.ask_enable(True, fleet.light)
    fleet.wait_for(alone)
    assert answer.seconds == pytest.approx(alone.seconds, abs=0.05)


def test_a_lost_light_is_named_and_not_commanded_and_does_not_spoil_the_success(fleet):
    lost = fleet.controller.lights[Address(1, 244)]
    lost.lose('gone', fleet.now)
    result = fleet.wait_for(ask(fleet))
    assert result.success
    assert result.message.startswith('2 of 2 on; ')
    assert 'lamp 1/244: light 1/244 is lost' in result.message


def test_with_all_lights_lost_it_fails_at_once_and_names_them(fleet):
    fleet.close()
    answer = ask(fleet)
    assert answer.seconds == 0
    assert not answer.result.success
    assert answer.result.message.startswith('lamp 1/243: light 1/243 is lost: ')
    assert 'lamp 1/245' in answer.result.message


def test_with_no_light_it_fails_at_once():
    answer = Answer(0.0)
    enable_all([], True, 0.0, answer, name=str)
    assert not answer.result.success
    assert answer.result.message == 'no light has been heard yet'
