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

"""Asking a light again for its status and its identity."""

from illuminator_ros.illuminator.light import REFRESH_LIMIT
from illuminator_ros.illuminator.messages import STATUS_ID
from illuminator_ros.mavlink.messages import INFORMATION_ID, MavCmd, MavResult
import pytest
from support.back_to_back import Pair
from support.records import Answer

REQUEST = MavCmd.REQUEST_MESSAGE


def refresh(pair):
    answer = Answer(pair.now)
    pair.light.refresh(pair.now, answer)
    pair.turn()
    return answer


def test_both_are_asked_for_and_come(pair):
    at = pair.now
    result = pair.wait_for(refresh(pair))
    assert result.success
    assert result.message == ('ILLUMINATOR_STATUS: received, '
                              'COMPONENT_INFORMATION_BASIC: received (4 ms)')
    asked = {message.param1 for message in pair.commands(REQUEST, since=at)}
    assert asked == {STATUS_ID, INFORMATION_ID}


def test_refresh_updates_status_and_identity(fake, faked):
    fake.fields['brightness'] = 12.0
    fake.identity = fake.identity.__class__(serial_number='T-2')
    faked.wait_for(refresh(faked))
    assert faked.light.status.brightness == 12.0
    assert faked.snapshot.identity.serial_number == 'T-2'


def test_a_light_without_an_identity_is_refreshed_all_the_same(fake, faked):
    fake.answers.discard(INFORMATION_ID)
    result = faked.wait_for(refresh(faked))
    assert result.success
    assert 'COMPONENT_INFORMATION_BASIC: acknowledged, but not sent' in result.message


def test_without_a_status_it_is_a_failure_that_says_why(fake, faked):
    fake.stream = 0.0
    fake.results[REQUEST] = MavResult.UNSUPPORTED
    result = faked.wait_for(refresh(faked))
    assert not result.success
    assert result.message.startswith(
        'ILLUMINATOR_STATUS: MAV_RESULT_UNSUPPORTED, '
        'COMPONENT_INFORMATION_BASIC: refused: MAV_RESULT_UNSUPPORTED (')


def test_a_status_that_was_promised_is_waited_for_until_the_limit(fake, faked):
    fake.stream = 0.0
    fake.answers.discard(STATUS_ID)
    answer = refresh(faked)
    result = faked.wait_for(answer)
    assert result.message == ('ILLUMINATOR_STATUS: nothing came, '
                              'COMPONENT_INFORMATION_BASIC: received (5.00 s)')
    assert answer.seconds == pytest.approx(REFRESH_LIMIT)


def test_the_limit_holds_however_long_a_command_may_take(fake):
    pair = Pair(fake, command_timeout=10.0).settle()
    fake.stream, fake.results[REQUEST] = 0.0, None
    assert pair.wait_for(refresh(pair)).message == (
        'ILLUMINATOR_STATUS: nothing came, COMPONENT_INFORMATION_BASIC: nothing came (5.00 s)')


@pytest.mark.parametrize('result', [None, MavResult.ACCEPTED, MavResult.IN_PROGRESS,
                                    MavResult.TEMPORARILY_REJECTED])
def test_refresh_ends_once_and_in_time_whatever_the_light_does(fake, faked, result):
    fake.stream = 0.0
    fake.answers.clear()
    fake.results[REQUEST] = result
    answers = [refresh(faked) for _ in range(3)]
    faked.run(REFRESH_LIMIT + 0.1)
    assert [len(answer.results) for answer in answers] == [1, 1, 1]
    assert max(answer.seconds for answer in answers) <= REFRESH_LIMIT


def test_refresh_ends_when_the_link_is_lost(pair):
    answer = refresh(pair)
    pair.close()
    pair.run(0.1)
    assert not answer.result.success
    assert 'the link was lost' in answer.result.message


def test_hundreds_at_once_are_all_answered(pair):
    answers = [refresh(pair) for _ in range(300)]
    pair.run(REFRESH_LIMIT + 0.1)
    assert {len(answer.results) for answer in answers} == {1}
    assert pair.light._refreshes == []
