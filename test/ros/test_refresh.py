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
from typing import Any

import pytest
from std_msgs.msg import Float32
from std_srvs.srv import Trigger
from support.light import MavCmd, MavResult, ServedLight
from support.ros import Ros
from support.slow import CLOCK, pass_time_until

STATUS, INFORMATION = 440, 396
REQUEST = MavCmd.REQUEST_MESSAGE
MS = r'\d+ ms'


def refresh(ros: Ros) -> Any:
    return ros.call(Trigger, '/illuminator/refresh', Trigger.Request())


@pytest.fixture(autouse=True)
def quiet(light: ServedLight) -> None:
    """Have the light send what it is asked for and nothing else."""
    light.fake.stream = 0.0


def test_both_messages_are_asked_for(ros: Ros, light: ServedLight) -> None:
    response = refresh(ros)

    assert response.success
    assert re.fullmatch(
        rf'ILLUMINATOR_STATUS: received, COMPONENT_INFORMATION_BASIC: received \({MS}\)',
        response.message)
    assert {command.param1 for command in light.commands(REQUEST)} == {STATUS, INFORMATION}


def test_what_has_changed_in_silence_is_published(ros: Ros, light: ServedLight) -> None:
    recorder = ros.subscribe(Float32, '/illuminator/brightness')
    light.do(lambda now: light.fake.fields.update(brightness=12.0))

    refresh(ros)

    recorder.wait_value(12.0)


def test_a_new_identity_is_logged(ros: Ros, light: ServedLight, bridge: Any) -> None:
    identity = light.fake.identity
    light.fake.identity = type(identity)('other', 'maker', '', '', 'T-2')

    refresh(ros)

    bridge.wait_for('light 1/243 is other maker, serial number T-2')


def test_a_light_without_identity_is_a_success(ros: Ros, light: ServedLight) -> None:
    light.fake.answers.discard(INFORMATION)
    call = ros.start(Trigger, '/illuminator/refresh', Trigger.Request())
    pass_time_until(lambda: call.answered, step=0.1)
    response = call.result()

    light.fake.answers.add(INFORMATION)
    assert response.success
    assert ('ILLUMINATOR_STATUS: received, COMPONENT_INFORMATION_BASIC: acknowledged, but not '
            'sent') in response.message


@pytest.mark.parametrize(('result', 'reason'), [
    (MavResult.UNSUPPORTED, 'refused: MAV_RESULT_UNSUPPORTED'),
    (None, 'no acknowledgement'),
])
def test_a_light_that_sends_no_status_has_failed(
    ros: Ros, light: ServedLight, result: MavResult | None, reason: str,
) -> None:
    light.fake.results[REQUEST] = result
    call = ros.start(Trigger, '/illuminator/refresh', Trigger.Request())
    for tries in range(1, 9) if result is None else ():
        light.wait_for(REQUEST, tries)
        CLOCK.forward(0.5)

    response = call.result()

    assert not response.success
    assert f'COMPONENT_INFORMATION_BASIC: {reason}' in response.message
    assert response.message.startswith('ILLUMINATOR_STATUS: ')
    assert 'received' not in response.message


def test_two_callers_both_get_an_answer(ros: Ros, light: ServedLight) -> None:
    calls = [ros.start(Trigger, '/illuminator/refresh', Trigger.Request()) for _ in range(2)]

    assert all(call.result().success for call in calls)
