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

"""``~/enable_all`` and ``~/cmd/enable_all`` switch every connected light, with one answer."""

from collections.abc import Iterator
import contextlib

import pytest
from std_msgs.msg import Bool
from std_srvs.srv import SetBool
from support.light import Address, eventually, MavResult, ON_OFF, ServedLight
from support.ports import free_port
from support.processes import Program
from support.ros import Ros, running_bridge
from support.slow import pass_time_until

SOURCES = [Address(1, component) for component in (243, 244, 245)]
NAMES = ['illuminator (1/243)', 'illuminator_1_244 (1/244)', 'tail (1/245)']


@pytest.fixture(scope='module')
def group(domain: int) -> Iterator[tuple[Program, list[ServedLight]]]:
    """Run a bridge and three lights."""
    port = free_port()
    with contextlib.ExitStack() as stack:
        bridge = stack.enter_context(running_bridge(
            domain, port, target_component=243, names='["1/245=tail"]'))
        lights = [stack.enter_context(ServedLight(port, source)) for source in SOURCES]
        bridge.wait_for('connected', count=3)
        yield bridge, lights


@pytest.fixture
def lights(group: tuple[Program, list[ServedLight]]) -> Iterator[list[ServedLight]]:
    """Return the lights, all off and obedient, which a test may change."""
    for light in group[1]:
        light.report(enable=0)
        light.forget()
    yield group[1]
    for light in group[1]:
        light.behave()


def enable_all(ros: Ros, on: bool = True) -> SetBool.Response:
    answer: SetBool.Response = ros.call(
        SetBool, '/illuminator/enable_all', SetBool.Request(data=on))
    return answer


def are_on(lights: list[ServedLight]) -> list[bool]:
    return [bool(light.fake.fields['enable']) for light in lights]


def test_one_request_switches_all_lights_and_names_each(
    ros: Ros, lights: list[ServedLight],
) -> None:
    response = enable_all(ros)

    assert (response.success, are_on(lights)) == (True, [True] * 3)
    summary, *outcomes = response.message.split('; ')
    assert summary == '3 of 3 on'
    assert [outcome.partition(': ')[0] for outcome in outcomes] == NAMES
    assert enable_all(ros, on=False).success
    assert are_on(lights) == [False] * 3


def test_topic_switches_all_lights_and_a_failure_is_logged(
    ros: Ros, group: tuple[Program, list[ServedLight]], lights: list[ServedLight],
) -> None:
    lights[1].fake.results[ON_OFF] = MavResult.DENIED

    ros.publish(Bool, '/illuminator/cmd/enable_all', True)

    eventually(lambda: are_on(lights) == [True, False, True])
    pass_time_until(lambda: group[0].count('~/cmd/enable_all: 2 of 3 on; '), step=0.1)


def test_request_fails_while_no_light_is_connected(own_ros: Ros, port: int) -> None:
    with running_bridge(own_ros.domain, port):
        response = enable_all(own_ros)

    assert not response.success
    assert response.message.startswith('no light connected: ')
