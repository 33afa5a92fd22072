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

"""``~/refresh`` asks the light again for identity and status."""

import re

import pytest
from std_msgs.msg import Float32
from std_srvs.srv import Trigger
from support.light import MavCmd, MavResult, ServedLight
from support.processes import Program
from support.recording import Call
from support.ros import Ros
from support.slow import CLOCK

STATUS, INFORMATION = 440, 396
REQUEST = MavCmd.REQUEST_MESSAGE


def start(ros: Ros) -> Call:
    return ros.start(Trigger, '/illuminator/refresh', Trigger.Request())


@pytest.fixture(autouse=True)
def quiet(light: ServedLight) -> None:
    """Have the light send only what it is asked for."""
    light.fake.stream = 0.0


def test_both_messages_are_asked_for_and_published_or_logged(
    ros: Ros, light: ServedLight, bridge: Program,
) -> None:
    recorder = ros.subscribe(Float32, '/illuminator/brightness')
    light.do(lambda now: light.fake.fields.update(brightness=12.0))
    identity = light.fake.identity
    light.fake.identity = type(identity)('other', 'maker', '', '', 'T-2')

    calls = [start(ros), start(ros)]

    for call in calls:
        assert call.result().success
        assert re.fullmatch(r'ILLUMINATOR_STATUS: received, COMPONENT_INFORMATION_BASIC: '
                            r'received \(\d+ ms\)', call.result().message)
    assert {command.param1 for command in light.commands(REQUEST)} == {STATUS, INFORMATION}
    recorder.wait_value(12.0)
    bridge.wait_for('light 1/243 is other maker, serial number T-2')


@pytest.mark.parametrize(('result', 'reason'), [
    (MavResult.UNSUPPORTED, 'refused: MAV_RESULT_UNSUPPORTED'), (None, 'no acknowledgement')])
def test_light_that_sends_no_status_is_a_failure_with_its_reason(
    ros: Ros, light: ServedLight, result: MavResult | None, reason: str,
) -> None:
    light.fake.results[REQUEST] = result
    call = start(ros)
    for tries in range(1, 9) if result is None else ():
        light.wait_for(REQUEST, tries)
        CLOCK.forward(0.5)

    response = call.result()

    assert not response.success
    assert f'COMPONENT_INFORMATION_BASIC: {reason}' in response.message
    assert response.message.startswith('ILLUMINATOR_STATUS: ')
    assert 'received' not in response.message
