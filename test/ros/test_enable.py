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

"""``~/enable`` succeeds only if the light has accepted the command and shows it."""

import re
import socket

import pytest
from std_msgs.msg import Float64
from std_srvs.srv import Trigger
from support.light import MavResult, ON_OFF, ServedLight
from support.ros import Parameters, Ros, running_bridge
from support.slow import CLOCK, pass_time_until, SPEED

ONCE = r'\(1 try, \d+ ms\)'
# s for which each try is waited for at most.
A_TRY = 0.5


@pytest.fixture
def off(light: ServedLight) -> ServedLight:
    """Return the light, which is off."""
    light.report(enable=0, error_status=0)
    return light


@pytest.mark.parametrize('before', [True, False])
@pytest.mark.parametrize('on', [True, False])
def test_obedient_light_is_commanded_once_and_confirmed_whatever_it_showed_before(
    ros: Ros, light: ServedLight, on: bool, before: bool,
) -> None:
    light.report(enable=int(before))

    response = ros.enable(on)

    assert response.success
    assert re.fullmatch(f'{"on" if on else "off"}, confirmed by ILLUMINATOR_STATUS: '
                        f'MAV_RESULT_ACCEPTED {ONCE}', response.message)
    assert light.fake.fields['enable'] == int(on)
    assert [command.param1 for command in light.commands(ON_OFF)] == [float(on)]


@pytest.mark.parametrize(('result', 'name'), [
    *((result, f'MAV_RESULT_{result.name}') for result in (
        MavResult.DENIED, MavResult.UNSUPPORTED, MavResult.FAILED, MavResult.CANCELLED,
        MavResult.NOT_IN_CONTROL)),
    (42, 'MAV_RESULT 42 (unknown)')])
def test_refusal_is_reported_with_the_name_of_its_result(
    ros: Ros, off: ServedLight, result: int, name: str,
) -> None:
    off.fake.results[ON_OFF] = result

    response = ros.enable()

    assert not response.success
    assert re.fullmatch(rf'refused: {re.escape(name)} {ONCE}', response.message)


def test_silent_light_fails_after_all_tries_which_are_numbered(
    ros: Ros, off: ServedLight,
) -> None:
    off.fake.results[ON_OFF] = None
    call = ros.start_enable()
    for tries in range(1, 5):
        off.wait_for(ON_OFF, tries)
        CLOCK.forward(A_TRY)

    assert not call.result().success
    assert call.result().message.startswith('no acknowledgement (4 tries, ')
    assert [command.confirmation for command in off.commands(ON_OFF)] == [0, 1, 2, 3]


def test_accepted_command_fails_if_the_status_contradicts_it(
    ros: Ros, off: ServedLight,
) -> None:
    off.fake.applies = False
    call = ros.start_enable()
    off.wait_for(ON_OFF)
    ros.catch_up()

    CLOCK.forward(1.0)

    assert not call.result().success
    assert re.fullmatch(
        r'on not confirmed: MAV_RESULT_ACCEPTED, but ILLUMINATOR_STATUS shows off '
        r'\(1 try, 1\.\d\d s\)', call.result().message)


def test_two_callers_each_get_the_answer_to_their_own_request(
    ros: Ros, off: ServedLight,
) -> None:
    off.fake.delays[ON_OFF] = 0.1 * SPEED

    on, also_off = ros.start_enable(True), ros.start_enable(False)

    # Off overtakes on.
    assert on.result().message == 'cancelled by a later request'
    assert also_off.result().message.startswith('off, confirmed')
    assert off.fake.fields['enable'] == 0


def test_other_services_and_topics_go_on_while_an_enable_waits(
    ros: Ros, off: ServedLight, parameters: Parameters,
) -> None:
    off.fake.results[ON_OFF] = None
    waiting = ros.start_enable()
    off.wait_for(ON_OFF)

    assert ros.refresh().success
    assert parameters.get('frame_id') and parameters.describe('brightness')
    assert not parameters.set(brightness=200.0)[0].successful
    assert parameters.set(brightness=61.0)[0].successful
    ros.subscribe(Float64, '/illuminator/uptime').wait(count=3)

    assert not waiting.answered
    off.acknowledge(ON_OFF, MavResult.FAILED)
    waiting.result()


def no_light_messages(ros: Ros) -> set[str]:
    """Call both services and set a parameter; return the reasons for which all of them fail."""
    calls = [ros.start_enable(), ros.start(Trigger, '/illuminator/refresh', Trigger.Request())]
    responses = [call.result() for call in calls]
    [result] = Parameters(ros).set(brightness=30.0)
    assert [*(response.success for response in responses), result.successful] == [False] * 3
    return {*(response.message for response in responses), result.reason}


def test_requests_fail_at_once_and_say_why_while_no_light_was_ever_heard(
    own_ros: Ros, port: int,
) -> None:
    with running_bridge(own_ros.domain, port):
        assert no_light_messages(own_ros) == {
            f'no light connected: none heard yet on udp 127.0.0.1:{port}: nothing is received'}
        assert Parameters(own_ros).get('brightness') == [None]


def test_requests_fail_at_once_and_say_why_while_the_light_is_lost(
    own_ros: Ros, port: int,
) -> None:
    with running_bridge(own_ros.domain, port) as bridge, ServedLight(port) as light:
        Parameters(own_ros).wait(brightness=100.0)
        light.fake.silent = True
        pass_time_until(lambda: bridge.count('lost'))

        for message in no_light_messages(own_ros):
            assert message.startswith('light 1/243 is lost: no heartbeat for ')
        assert Parameters(own_ros).get('brightness') == [100.0]


def test_requests_fail_at_once_and_say_why_while_the_link_is_not_open(
    own_ros: Ros, port: int,
) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as occupant:
        occupant.bind(('127.0.0.1', port))
        with running_bridge(own_ros.domain, port, until='link not open'):
            assert no_light_messages(own_ros) == {
                f'no light connected: udpin://127.0.0.1:{port} is not open: '
                f'cannot listen on 127.0.0.1:{port}: Address already in use'}
