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

"""While one request waits for the light, everything else goes on (DESIGN.md, 3.4)."""

from collections.abc import Callable, Iterator

import pytest
from std_msgs.msg import Bool, Float64
from std_srvs.srv import SetBool, Trigger
from support.light import CONFIGURE, MavResult, ON_OFF, ServedLight
from support.recording import Call
from support.ros import Parameters, Ros


@pytest.fixture(params=['enable', 'set_parameters'])
def waiting(
    request: pytest.FixtureRequest, ros: Ros, light: ServedLight, parameters: Parameters,
) -> Iterator[Call]:
    """Return a call that waits for a light that says nothing."""
    if request.param == 'enable':
        command = ON_OFF
        light.fake.results[command] = None
        call = ros.start(SetBool, '/illuminator/enable', SetBool.Request(data=True))
    else:
        command = CONFIGURE
        light.fake.results[command] = None
        call = parameters.start_set(brightness=33.0)
    light.wait_for(command)
    yield call
    light.acknowledge(command, MavResult.FAILED)
    call.result()


def refresh(ros: Ros, parameters: Parameters, light: ServedLight) -> object:
    return ros.call(Trigger, '/illuminator/refresh', Trigger.Request()).success


def get_parameters(ros: Ros, parameters: Parameters, light: ServedLight) -> object:
    return parameters.get('frame_id')


def describe_parameters(ros: Ros, parameters: Parameters, light: ServedLight) -> object:
    return parameters.describe('brightness')


def refused_set(ros: Ros, parameters: Parameters, light: ServedLight) -> object:
    return parameters.set(brightness=200.0)


@pytest.mark.parametrize('other', [refresh, get_parameters, describe_parameters, refused_set])
def test_other_services_answer_at_once(
    ros: Ros, light: ServedLight, parameters: Parameters, waiting: Call,
    other: Callable[..., object],
) -> None:
    assert other(ros, parameters, light)

    assert not waiting.answered


def test_the_status_goes_on_being_published(
    ros: Ros, light: ServedLight, waiting: Call,
) -> None:
    recorder = ros.subscribe(Float64, '/illuminator/uptime')

    recorder.wait(count=3)

    assert not waiting.answered


def test_a_parameter_can_be_set_while_an_enable_waits(
    ros: Ros, light: ServedLight, parameters: Parameters,
) -> None:
    light.fake.results[ON_OFF] = None
    enable = ros.start(SetBool, '/illuminator/enable', SetBool.Request(data=True))
    light.wait_for(ON_OFF)

    call = parameters.start_set(brightness=61.0)

    assert call.result().results[0].successful
    assert not enable.answered
    light.acknowledge(ON_OFF, MavResult.FAILED)
    enable.result()


def test_connected_does_not_change_because_a_light_ignores_commands(
    ros: Ros, light: ServedLight, waiting: Call,
) -> None:
    recorder = ros.subscribe(Bool, '/illuminator/connected')
    recorder.wait()

    light.acknowledge(CONFIGURE, MavResult.DENIED)
    light.acknowledge(ON_OFF, MavResult.DENIED)
    waiting.result()

    assert recorder.values == [True]


def test_the_thirty_third_caller_is_turned_away(
    ros: Ros, light: ServedLight, parameters: Parameters,
) -> None:
    light.fake.results[ON_OFF] = None
    calls = []
    for _ in range(33):
        calls.append(ros.start(SetBool, '/illuminator/enable', SetBool.Request(data=True)))
        # A service takes ten requests at a time, so each is given the time to arrive.
        parameters.get('frame_id')

    last = calls.pop().result()

    assert not last.success
    assert '32 requests are waiting for light 1/243 already' in last.message
    # One by one: a client takes ten answers at a time.
    for call in calls:
        while not call.answers_within(0.01):
            light.acknowledge(ON_OFF, MavResult.FAILED)
        assert 'MAV_RESULT_FAILED' in call.result().message
