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

"""``~/enable``: success is what the light has accepted and shows (DESIGN.md, 3.1)."""

import re

import pytest
from std_srvs.srv import SetBool
from support.light import Address, MavCmd, MavResult, ON_OFF, ServedLight
from support.recording import Call
from support.ros import Ros
from support.slow import CLOCK, SPEED

MS = r'\d+ ms'
# s for which each try is waited for at most.
A_TRY = 0.5


def start(ros: Ros, on: bool = True) -> Call:
    return ros.start(SetBool, '/illuminator/enable', SetBool.Request(data=on))


def enable(ros: Ros, on: bool = True) -> SetBool.Response:
    return start(ros, on).result()


@pytest.fixture(autouse=True)
def light_is_off(light: ServedLight) -> None:
    light.report(enable=0, error_status=0)


@pytest.mark.parametrize('on', [True, False])
def test_a_light_that_obeys_is_switched(ros: Ros, light: ServedLight, on: bool) -> None:
    light.report(enable=int(not on))

    response = enable(ros, on)

    assert response.success
    assert light.fake.fields['enable'] == int(on)
    assert [command.param1 for command in light.commands(ON_OFF)] == [float(on)]


def test_the_message_tells_how_success_was_confirmed(ros: Ros, light: ServedLight) -> None:
    message = enable(ros).message

    assert re.fullmatch(
        rf'on, confirmed by ILLUMINATOR_STATUS: MAV_RESULT_ACCEPTED \(1 try, {MS}\)', message)


def test_a_light_that_is_on_already_is_commanded_all_the_same(
    ros: Ros, light: ServedLight,
) -> None:
    light.report(enable=1)

    assert enable(ros).success
    assert len(light.commands(ON_OFF)) == 1


@pytest.mark.parametrize('result', [
    MavResult.DENIED, MavResult.UNSUPPORTED, MavResult.FAILED, MavResult.CANCELLED,
    MavResult.NOT_IN_CONTROL,
])
def test_a_refusal_fails_with_the_result_s_name(
    ros: Ros, light: ServedLight, result: MavResult,
) -> None:
    light.fake.results[ON_OFF] = result

    response = enable(ros)

    assert not response.success
    assert re.fullmatch(rf'refused: MAV_RESULT_{result.name} \(1 try, {MS}\)', response.message)


def test_a_result_that_mavlink_does_not_know_is_a_refusal(
    ros: Ros, light: ServedLight,
) -> None:
    light.fake.results[ON_OFF] = 42

    response = enable(ros)

    assert not response.success
    assert response.message.startswith('refused: MAV_RESULT 42 (unknown)')


def test_a_light_that_rejects_for_a_moment_is_asked_again(ros: Ros, light: ServedLight) -> None:
    light.fake.results[ON_OFF] = [MavResult.TEMPORARILY_REJECTED, MavResult.ACCEPTED]
    call = start(ros)
    light.wait_for(ON_OFF)
    ros.catch_up()

    CLOCK.forward(A_TRY)

    assert call.result().success
    assert '(2 tries, ' in call.result().message


def test_a_light_that_accepts_and_stays_dark_has_failed(ros: Ros, light: ServedLight) -> None:
    light.fake.applies = False
    call = start(ros)
    light.wait_for(ON_OFF)
    ros.catch_up()

    CLOCK.forward(1.0)

    assert not call.result().success
    assert re.fullmatch(
        r'on not confirmed: MAV_RESULT_ACCEPTED, but ILLUMINATOR_STATUS shows off '
        r'\(1 try, 1\.\d\d s\)', call.result().message)


def test_a_light_that_changes_a_little_later_has_succeeded(
    ros: Ros, light: ServedLight,
) -> None:
    light.fake.apply_after = 0.9
    call = start(ros)
    light.wait_for(ON_OFF)
    ros.catch_up()
    assert not call.answered

    CLOCK.forward(0.9)

    assert call.result().success
    assert 'confirmed by' in call.result().message


def test_a_light_whose_status_stays_away_has_failed(ros: Ros, light: ServedLight) -> None:
    light.fake.stream = 0.0
    light.fake.pushes = False
    light.fake.answers.discard(440)
    call = start(ros)
    # What has accepted is asked for its status.
    light.wait_for(MavCmd.REQUEST_MESSAGE)

    CLOCK.forward(1.0)

    assert not call.result().success
    assert re.search(
        r'but no ILLUMINATOR_STATUS came within 1\.\d\d s', call.result().message)


def test_a_silent_light_is_tried_again_and_has_failed(ros: Ros, light: ServedLight) -> None:
    light.fake.results[ON_OFF] = None
    call = start(ros)
    for tries in range(1, 5):
        light.wait_for(ON_OFF, tries)
        CLOCK.forward(A_TRY)

    assert not call.result().success
    assert call.result().message.startswith('no acknowledgement (4 tries, ')
    assert [command.confirmation for command in light.commands(ON_OFF)] == [0, 1, 2, 3]


def test_a_light_that_misses_the_first_try_is_switched_by_the_second(
    ros: Ros, light: ServedLight,
) -> None:
    light.fake.results[ON_OFF] = [None, MavResult.ACCEPTED]
    call = start(ros)
    light.wait_for(ON_OFF)

    CLOCK.forward(A_TRY)

    assert call.result().success
    assert 'MAV_RESULT_ACCEPTED (2 tries, ' in call.result().message


def test_a_slow_light_is_waited_for_and_not_asked_again(ros: Ros, light: ServedLight) -> None:
    light.fake.results[ON_OFF] = None
    call = start(ros)
    light.wait_for(ON_OFF)
    light.acknowledge(ON_OFF, MavResult.IN_PROGRESS, progress=50)
    ros.catch_up()
    light.forget()

    CLOCK.forward(5 * A_TRY)
    ros.catch_up()
    assert not call.answered
    light.report(enable=1)
    light.acknowledge(ON_OFF, MavResult.ACCEPTED)

    assert call.result().success
    assert light.commands(ON_OFF) == []


def test_a_slow_light_that_fails_in_the_end_has_failed(ros: Ros, light: ServedLight) -> None:
    light.fake.results[ON_OFF] = None
    call = start(ros)
    light.wait_for(ON_OFF)
    light.acknowledge(ON_OFF, MavResult.IN_PROGRESS, progress=50)
    light.acknowledge(ON_OFF, MavResult.FAILED)

    response = call.result()

    assert not response.success
    assert response.message.startswith('refused: MAV_RESULT_FAILED')


def test_an_acknowledgement_from_somebody_else_does_not_count(
    ros: Ros, light: ServedLight,
) -> None:
    light.fake.results[ON_OFF] = None
    call = start(ros)
    light.wait_for(ON_OFF)

    light.acknowledge(ON_OFF, MavResult.ACCEPTED, source=Address(1, 1))
    light.acknowledge(ON_OFF, MavResult.DENIED)

    assert call.result().message.startswith('refused: MAV_RESULT_DENIED')


def test_two_callers_each_get_the_answer_to_their_own_request(
    ros: Ros, light: ServedLight,
) -> None:
    light.fake.delays[ON_OFF] = 0.1 * SPEED

    on, off = start(ros, True), start(ros, False)

    assert on.result().message.startswith('on, confirmed')
    assert off.result().message.startswith('off, confirmed')
    assert light.fake.fields['enable'] == 0
