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

"""How a light is asked what it is."""

from illuminator_ros.illuminator.identification import MAX_QUESTIONS, SETTLING_TIME
from illuminator_ros.illuminator.identity import Identity
from illuminator_ros.mavlink.messages import INFORMATION_ID, MavCmd, MavResult
import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight


def questions(pair):
    return [message for message in pair.commands(MavCmd.REQUEST_MESSAGE)
            if message.param1 == INFORMATION_ID]


def test_the_identity_is_asked_for_once_and_kept(faked):
    faked.run(60.0)
    assert len(questions(faked)) == 1
    identity = Identity('maker', 'torch', '1.2', '3', 'T-1')
    assert faked.light.identification.identity == identity
    assert faked.recorder.identities == [identity]


def test_it_is_asked_for_again_after_an_absence_since_it_may_be_another_light(fake, faked):
    fake.silent = True
    faked.run(10.0)
    fake.identity = Identity(serial_number='T-2')
    fake.silent = False
    faked.run(3.0)
    assert faked.light.identification.identity.serial_number == 'T-2'


@pytest.mark.parametrize(('result', 'failure'), [
    (MavResult.DENIED, 'refused: MAV_RESULT_DENIED'),
    (MavResult.UNSUPPORTED, 'refused: MAV_RESULT_UNSUPPORTED'),
    (MavResult.FAILED, 'refused: MAV_RESULT_FAILED'),
])
def test_a_refusal_is_final_and_named(result, failure):
    # The status is asked for first, and the identity after it.
    fake = FakeLight(results={MavCmd.REQUEST_MESSAGE: [MavResult.ACCEPTED, result]})
    pair = Pair(fake).settle(30.0)
    assert pair.light.identification.failure == failure
    assert len(questions(pair)) == 1


def test_a_light_that_does_not_answer_is_asked_as_often_as_any_command_is_tried():
    pair = Pair(FakeLight(results={MavCmd.REQUEST_MESSAGE: [MavResult.ACCEPTED, None]}),
                command_retries=3).settle(30.0)
    assert pair.light.identification.failure == 'no acknowledgement'
    assert len(questions(pair)) == 4


def test_an_acknowledgement_without_the_message_is_not_waited_for_for_ever():
    fake = FakeLight()
    fake.answers.discard(INFORMATION_ID)
    pair = Pair(fake).settle(30.0)
    assert pair.light.identification.failure == 'acknowledged, but not sent'
    assert len(questions(pair)) == MAX_QUESTIONS


def test_a_message_that_gets_lost_is_asked_for_again_before_anybody_needs_it():
    fake = FakeLight()
    fake.answers.discard(INFORMATION_ID)
    pair = Pair(fake)
    pair.run(0.3)
    fake.answers.add(INFORMATION_ID)
    pair.run(SETTLING_TIME - 0.3)
    assert pair.light.identification.identity is not None
    assert len(questions(pair)) == 2


@pytest.mark.parametrize('acknowledged', ['never', 'afterwards'])
def test_the_message_counts_without_its_acknowledgement(acknowledged):
    fake = FakeLight(results={MavCmd.REQUEST_MESSAGE: None})
    pair = Pair(fake).settle(0.1)
    fake.send(fake.information())
    pair.turn()
    pair.run(0.1)
    if acknowledged == 'afterwards':
        fake.results.clear()
        fake.answers.clear()
    pair.run(10.0)
    assert pair.light.identification.identity is not None
    assert pair.light.identification.failure == ''


def test_whoever_asks_while_it_is_being_asked_for_waits_for_the_same_answer(fake, faked):
    before = len(questions(faked))
    answers = []
    for _ in range(5):
        faked.light.identification.ask(faked.now, lambda failure, now: answers.append(failure))
    faked.turn()
    faked.run(1.0)
    assert len(questions(faked)) == before + 1
    assert answers == [''] * 5


class _Nameless(FakeLight):
    """A light that takes no notice of being asked for its identity."""

    def receive(self, source, message, now):
        if getattr(message, 'param1', None) != INFORMATION_ID:
            super().receive(source, message, now)


@pytest.mark.parametrize('change', [
    lambda pair: pair.enable(True), lambda pair: pair.configure(brightness=33.0)])
def test_it_does_not_hold_up_the_status_that_shows_a_change(change):
    pair = Pair(_Nameless(stream=0.0))
    pair.run_until(lambda: pair.controller.lights and pair.light.status)
    pair.run(0.1)
    before = len(questions(pair))
    assert change(pair).success
    # And it is asked for again.
    pair.run(10.0)
    assert len(questions(pair)) > before
    assert pair.light.identification.failure == 'no acknowledgement'


def test_it_is_settled_when_it_is_known(pair):
    assert pair.light.identification.settled(pair.now)


def test_it_is_settled_after_a_while_where_the_light_says_nothing():
    pair = Pair(FakeLight(results={MavCmd.REQUEST_MESSAGE: None}), command_timeout=5.0)
    pair.run_until(lambda: pair.controller.lights)
    assert not pair.light.identification.settled(pair.now)
    pair.run(SETTLING_TIME)
    assert pair.light.identification.settled(pair.now)
