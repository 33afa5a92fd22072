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

"""Setting parameters answers within 0.9 s, whatever the light and the line do."""

import random

from illuminator_ros.illuminator.messages import STATUS_ID
from illuminator_ros.mavlink.messages import CommandAck, MavCmd, MavResult
import pytest
from support.back_to_back import BRIDGE, Pair
from support.fake_light import FakeLight
from support.faulty_wire import Faults

CONFIGURE = MavCmd.DO_ILLUMINATOR_CONFIGURE
LIMIT = 0.9


def silent(fake):
    fake.silent = True


def no_acknowledgement(fake):
    fake.results[CONFIGURE] = None


def no_progress(fake):
    fake.results[CONFIGURE] = MavResult.IN_PROGRESS


def endless_progress(fake):
    fake.results[CONFIGURE] = None
    fake.stream = 0.1
    fake.status = lambda now: CommandAck(CONFIGURE, MavResult.IN_PROGRESS, 1, 0, *BRIDGE)


def always_rejected(fake):
    fake.results[CONFIGURE] = MavResult.TEMPORARILY_REJECTED


def rejected_then_accepted(fake):
    fake.results[CONFIGURE] = [MavResult.TEMPORARILY_REJECTED] * 3 + [MavResult.ACCEPTED]


def int_only(fake):
    fake.results[CONFIGURE] = MavResult.COMMAND_INT_ONLY


def not_done(fake):
    fake.applies = False


def done_late(fake):
    fake.apply_after = 0.7


def no_status_any_more(fake):
    fake.stream = 0.0
    fake.answers.discard(STATUS_ID)


def no_answer_to_requests(fake):
    fake.stream = 0.0
    fake.results[MavCmd.REQUEST_MESSAGE] = None


def denied(fake):
    fake.results[CONFIGURE] = MavResult.DENIED


LIGHTS = (silent, no_acknowledgement, no_progress, endless_progress, always_rejected,
          rejected_then_accepted, int_only, not_done, done_late, no_status_any_more,
          no_answer_to_requests, denied)
LINES = {
    'good': Faults(), 'slow': Faults(latency=0.4), 'lossy': Faults(drop=0.5),
    'late': Faults(delay=0.5), 'torn': Faults(corrupt=0.5),
    'bad': Faults(drop=0.3, duplicate=0.3, reorder=0.3, delay=0.3, corrupt=0.3)}


@pytest.mark.parametrize('line', LINES.values(), ids=LINES)
@pytest.mark.parametrize('become', LIGHTS)
@pytest.mark.parametrize('command_timeout', [0.05, 0.5, 10.0])
def test_each_set_is_answered_once_and_in_time(become, line, command_timeout):
    fake = FakeLight()
    pair = Pair(fake, there=line, command_timeout=command_timeout, seed=become.__name__)
    pair.run_until(lambda: pair.controller.lights and pair.snapshot.configuration)
    draw = random.Random(become.__name__)
    become(fake)
    answers = []
    for _ in range(12):
        answers.append(pair.ask_configure(brightness=draw.uniform(0, 100)))
        pair.run(draw.choice([0.0, 0.01, 0.1, 0.5, 0.849, 0.85, 0.851, 1.0]))
    pair.run(LIMIT)
    assert [len(answer.results) for answer in answers] == [1] * len(answers)
    assert max(answer.seconds for answer in answers) <= LIMIT


def test_a_set_behind_others_that_take_too_long_says_so(fake, faked):
    fake.results[CONFIGURE] = None
    first, second = faked.ask_configure(brightness=1), faked.ask_configure(brightness=2)
    faked.run(LIMIT)
    assert first.result.message.startswith('no acknowledgement')
    assert second.result.message == 'not sent: earlier requests took too long'
    assert {message.param2 for message in faked.commands(CONFIGURE)} == {1.0}


def test_a_light_that_takes_half_a_second_is_waited_for(fake, faked):
    fake.apply_after = 0.5
    assert faked.configure(brightness=50).success
