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

"""Switching a light: nothing succeeds that the light did not accept and then show."""

import re

from illuminator_ros.illuminator.light import PROGRESS_LIMIT
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.mavlink.messages import (
    Address,
    CommandAck,
    MavCmd,
    MavResult,
    result_name,
)
import pytest
from support.back_to_back import BRIDGE, Pair
from support.fake_light import FakeLight

ON_OFF = MavCmd.ILLUMINATOR_ON_OFF
SPENT = re.compile(r'\((\d+) (?:try|tries), (?:(\d+) ms|(\d+\.\d\d) s)\)$')


def tries_and_seconds(message):
    """Return what a message says at its end."""
    tries, ms, seconds = SPENT.search(message).groups()
    return int(tries), float(seconds) if ms is None else int(ms) / 1000


def test_enable_succeeds_when_the_light_accepts_and_shows_it(pair):
    answer = pair.ask_enable(True)
    result = pair.wait_for(answer)
    assert result.success
    assert result.message.startswith('on, confirmed by ILLUMINATOR_STATUS: MAV_RESULT_ACCEPTED (')
    assert tries_and_seconds(result.message) == (1, pytest.approx(answer.seconds, abs=1e-3))
    assert pair.lamp.enabled


def test_a_status_that_does_not_come_by_itself_is_asked_for(fake, faked):
    fake.stream = 0.0
    answer = faked.ask_enable(True)
    assert faked.wait_for(answer).success
    assert answer.seconds < 0.02


def test_a_failure_names_the_state_shown_and_its_flags(fake, faked):
    fake.applies = False
    fake.fields['error_status'] = 2
    assert 'shows off, over temperature shutdown' in faked.enable(True).message


def test_a_status_that_says_nothing_about_it_contradicts(fake, faked):
    fake.applies = False
    fake.fields['enable'] = 2
    assert 'shows neither on nor off' in faked.enable(True).message


def test_a_light_that_takes_its_time_is_asked_until_it_shows_it(fake, faked):
    fake.stream, fake.apply_after = 0.0, 0.6
    answer = faked.ask_enable(True)
    assert faked.wait_for(answer).success
    assert answer.seconds == pytest.approx(0.75, abs=0.02)


def test_enable_succeeds_as_not_confirmed_where_the_light_never_sends_a_status():
    fake = FakeLight(stream=0.0)
    fake.answers.clear()
    pair = Pair(fake).settle()
    result = pair.enable(True)
    assert result.success
    assert result.message.startswith('on, accepted, not confirmed (the light sends no '
                                     'ILLUMINATOR_STATUS): MAV_RESULT_ACCEPTED (1 try, ')


def test_enable_fails_where_a_light_stops_sending_its_status(fake, faked):
    fake.stream = 0.0
    fake.answers.clear()
    result = faked.enable(True)
    assert not result.success
    assert not result.contradicted
    assert 'MAV_RESULT_ACCEPTED, but no ILLUMINATOR_STATUS came within 1.00 s (1 try' in (
        result.message)


@pytest.mark.parametrize('uptime', ['of the status before', 'a little lower', 'much lower'])
def test_a_late_status_from_before_the_command_confirms_nothing(fake, faked, uptime):
    faked.enable(True)
    shown_on = fake.status(faked.now)
    fake.fields['enable'] = 0
    fake.stream, fake.applies = 0.0, False
    faked.run(0.4)
    faked.light.request_status(faked.now)
    faked.run(0.1)
    assert faked.light.status.enabled is False
    answer = faked.ask_enable(True)
    faked.run(0.005)
    shown_on.uptime_ms -= {'of the status before': 0, 'a little lower': 50,
                           'much lower': 3000}[uptime]
    fake.send(shown_on)
    assert not faked.wait_for(answer).success


@pytest.mark.parametrize('result', [
    result for result in (*MavResult, 11, 200)
    if result not in (MavResult.ACCEPTED, MavResult.TEMPORARILY_REJECTED, MavResult.IN_PROGRESS,
                      MavResult.COMMAND_INT_ONLY)])
def test_a_refusal_fails_with_its_name(fake, faked, result):
    fake.results[ON_OFF] = result
    answer = faked.wait_for(faked.ask_enable(True))
    assert not answer.success
    assert answer.message.startswith(f'refused: {result_name(result)} (')


def test_no_answer_fails_with_the_number_of_tries_and_the_time(fake, faked):
    fake.results[ON_OFF] = None
    answer = faked.ask_enable(True)
    result = faked.wait_for(answer)
    assert result.message.startswith('no acknowledgement (4 tries, ')
    assert tries_and_seconds(result.message)[1] == pytest.approx(answer.seconds, abs=0.01)
    assert answer.seconds <= 2.0


def test_progress_is_waited_for_but_not_for_ever(fake, faked):
    fake.results[ON_OFF] = None
    answer = faked.ask_enable(True)
    while not answer.results and faked.now < answer.asked_at + 60.0:
        fake.send(CommandAck(ON_OFF, MavResult.IN_PROGRESS, 50, 0, *BRIDGE))
        faked.run(1.0)
    assert not answer.result.success
    assert 'MAV_RESULT_IN_PROGRESS at 50 %' in answer.result.message
    assert answer.seconds == pytest.approx(PROGRESS_LIMIT)
    assert len(faked.commands(ON_OFF)) == 1


def test_enable_fails_at_once_where_the_light_is_lost(fake, faked):
    fake.silent = True
    faked.run(10.0)
    before = len(faked.commands())
    answer = faked.ask_enable(True)
    assert answer.seconds == 0.0
    assert answer.result.message.startswith('light 1/243 is lost: no heartbeat for 10.')
    assert len(faked.commands()) == before


def test_without_a_link_that_is_the_reason_and_not_the_silence(fake, faked):
    faked.close()
    faked.controller.link_closed(faked.now, 'no such file')
    answer = faked.ask_enable(True)
    assert answer.result.message == 'light 1/243 is lost: the link is not open: no such file'


def test_enable_fails_when_the_link_is_lost_meanwhile(fake, faked):
    fake.results[ON_OFF] = None
    answer = faked.ask_enable(True)
    faked.run(0.1)
    faked.close()
    faked.run(0.01)
    assert answer.result.message.startswith('the link was lost (1 try, ')


@pytest.mark.parametrize(('flags', 'shown'), [
    (0, ''), (1, ', but thermal throttling'), (2, ', but over temperature shutdown'),
    (3, ', but thermal throttling and over temperature shutdown'), (4, '')])
def test_a_success_says_what_keeps_the_lamp_dark_or_dim(fake, faked, flags, shown):
    fake.fields['error_status'] = flags
    result = faked.enable(True)
    assert result.success
    assert result.message.startswith(f'on, confirmed by ILLUMINATOR_STATUS{shown}: MAV_RESULT_')


def test_off_does_not_mention_heat(fake, faked):
    fake.fields |= {'error_status': 2, 'enable': 1}
    assert faked.enable(False).message.startswith('off, confirmed by ILLUMINATOR_STATUS: ')


def test_a_light_that_restarts_meanwhile_does_not_confirm(fake, faked):
    fake.apply_after = 0.5
    answer = faked.ask_enable(True)
    faked.run(0.1)
    fake._to_apply.clear()
    fake.restart(faked.now)
    assert not faked.wait_for(answer).success


def test_one_dead_light_does_not_delay_another():
    pair = Pair([IlluminatorProperties(address=Address(1, one)) for one in (243, 244)]).settle()
    dead, alive = (pair.controller.lights[Address(1, one)] for one in (243, 244))
    pair.device.receive = lambda source, message, now: None
    late = pair.ask_enable(True, dead)
    answer = pair.ask_enable(True, alive)
    assert pair.wait_for(answer).success
    assert answer.seconds < 0.01
    assert not pair.wait_for(late).success
