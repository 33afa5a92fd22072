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

"""Requests to one light: in order, one at a time of each kind, each answered exactly once."""

from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.mavlink.messages import Address, MavCmd, MavResult
from illuminator_ros.payload.request import MAX_WAITING, Result
import pytest
from support.back_to_back import Pair
from support.faulty_wire import Faults

ON_OFF, CONFIGURE = MavCmd.ILLUMINATOR_ON_OFF, MavCmd.DO_ILLUMINATOR_CONFIGURE


def test_off_overtakes_the_requests_before_it(pair):
    wishes = [True, False, True, True, False]
    answers = [pair.ask_enable(on) for on in wishes]
    pair.run(5.0)
    # Off overtakes, and is sent twice: the first acknowledgement may be that of on.
    assert [bool(m.param1) for m in pair.commands(ON_OFF)] == [True, False, False, False]
    assert [answer.result.success for answer in answers] == [False, True, False, False, True]


def test_each_configuration_builds_on_the_one_before(pair):
    answers = [pair.ask_configure(brightness=40), pair.ask_configure(strobe_period=2),
               pair.ask_configure(strobe_duty_cycle=30)]
    pair.run(2.0)
    assert all(answer.result.success for answer in answers)
    last = pair.commands(CONFIGURE)[-1]
    assert (last.param2, last.param3, last.param4) == (40, 2, 30)


def test_switching_and_configuring_do_not_wait_for_one_another(fake, faked):
    fake.results[ON_OFF] = None
    slow = faked.ask_enable(True)
    quick = faked.ask_configure(brightness=50)
    assert faked.wait_for(quick).success
    assert not slow.results
    fake.results |= {ON_OFF: MavResult.ACCEPTED, CONFIGURE: None}
    faked.wait_for(slow)
    slow = faked.ask_configure(brightness=60)
    quick = faked.ask_enable(True)
    assert faked.wait_for(quick).success
    assert not slow.results


def test_requests_above_the_limit_are_refused_at_once(fake, faked):
    fake.results[ON_OFF] = None
    answers = [faked.ask_enable(True) for _ in range(MAX_WAITING + 3)]
    refused = [answer for answer in answers if answer.results]
    assert refused == answers[MAX_WAITING:]
    assert refused[0].result.message == '32 requests are waiting for light 1/243 already'


def test_after_too_many_requests_the_light_is_served_as_before(fake, faked):
    fake.results[ON_OFF] = MavResult.DENIED
    answers = [faked.ask_enable(True) for _ in range(MAX_WAITING + 3)]
    faked.run(10.0)
    assert all(len(answer.results) == 1 for answer in answers)
    fake.results.clear()
    assert faked.enable(True).success


def test_requests_that_wait_for_a_light_that_gets_lost_fail_with_it(fake, faked):
    fake.results[ON_OFF] = fake.results[CONFIGURE] = None
    answers = [faked.ask_enable(True) for _ in range(5)]
    answers += [faked.ask_configure(brightness=value) for value in (10, 20, 30)]
    faked.run(0.1)
    faked.close()
    faked.run(0.01)
    assert all(not answer.result.success for answer in answers)
    assert 'light 1/243 is lost' in answers[1].result.message


def test_a_closed_link_leaves_nothing_that_is_sent_later(fake, faked):
    fake.results[ON_OFF] = None
    for _ in range(5):
        faked.ask_enable(True)
    faked.close()
    faked.run(5.0)
    at = faked.now
    faked.open()
    faked.run(5.0)
    assert faked.commands(ON_OFF, since=at) == []


def test_many_lights_are_served_at_the_same_time():
    sources = [Address(1, component) for component in range(100, 130)]
    pair = Pair([IlluminatorProperties(address=source) for source in sources],
                there=Faults(latency=0.05)).settle()
    answers = [pair.ask_enable(True, light) for light in pair.controller.lights.values()]
    pair.run(0.25)
    assert [answer.result.success for answer in answers] == [True] * 30


class TestCallbacksThatAskForMore:
    """A callback at the end of a request may start the next request."""

    def toggle(self, pair, times, log):
        def done(result: Result, now: float) -> None:
            log.append((result.success, pair.lamp.enabled))
            if len(log) < times:
                pair.light.enable(not pair.lamp.enabled, now, done)
        pair.light.enable(True, pair.now, done)

    def test_configuring_again_from_the_answer(self, pair):
        log = []

        def done(result, now):
            log.append(result.success)
            if len(log) < 6:
                pair.light.configure({'brightness': 10 * len(log)}, now, done)

        pair.light.configure({'brightness': 5}, pair.now, done)
        pair.run(2.0)
        assert log == [True] * 6
        assert pair.lamp.configuration.brightness == 50.0

    def test_another_request_from_the_answer_to_one_that_waited(self, fake, faked):
        fake.results[CONFIGURE] = None
        log = []
        faked.ask_configure(brightness=1)
        faked.light.configure(
            {'brightness': 2}, faked.now,
            lambda result, now: faked.light.configure(
                {'brightness': 3}, now, lambda result, now: log.append(result.success)))
        faked.run(0.9)
        fake.results.clear()
        faked.run(1.0)
        assert log == [True]
        assert fake.fields['brightness'] == 3.0

    def test_an_answer_that_raises_holds_up_nothing(self, pair):
        def done(result, now):
            raise RuntimeError('what the caller does wrong')

        pair.light.enable(True, pair.now, done)
        answer = pair.ask_enable(True)
        with pytest.raises(RuntimeError):
            pair.run(5.0)
        assert pair.wait_for(answer).success
        assert pair.enable(True).success
