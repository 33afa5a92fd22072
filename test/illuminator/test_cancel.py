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

"""CommandStatus all requests, so that one last one is sent at once."""

from illuminator_ros.mavlink.messages import MavCmd, MavResult

ON_OFF, CONFIGURE = MavCmd.ILLUMINATOR_ON_OFF, MavCmd.DO_ILLUMINATOR_CONFIGURE


def test_each_request_ends_once_whether_under_way_or_waiting(fake, faked):
    fake.results |= {ON_OFF: MavResult.IN_PROGRESS, CONFIGURE: None}
    answers = [faked.ask_enable(True), faked.ask_enable(True), faked.ask_configure(brightness=50)]
    faked.run(0.1)

    faked.light.cancel(faked.now)

    assert [answer.result.success for answer in answers] == [False, False, False]
    assert {answer.result.message for answer in answers} == {'cancelled'}
    faked.run(60.0)
    assert [len(answer.results) for answer in answers] == [1, 1, 1]


def test_the_next_request_does_not_wait_for_a_light_that_takes_its_time(fake, faked):
    fake.results[ON_OFF] = [MavResult.IN_PROGRESS, MavResult.ACCEPTED]
    faked.ask_enable(True)
    faked.ask_enable(True)
    faked.run(0.1)

    faked.light.cancel(faked.now)
    started = faked.now

    assert faked.enable(False).success
    assert faked.now - started < 0.1
    assert [command.param1 for command in faked.commands(ON_OFF)] == [1.0, 0.0, 0.0]


def test_nothing_that_was_still_to_be_sent_is_sent(fake, faked):
    fake.results[CONFIGURE] = None
    faked.ask_configure(brightness=50)
    faked.light.set_brightness(60.0, faked.now)
    faked.light.set_desired({'strobe_period': 1.0}, faked.now)
    faked.run(0.01)
    sent = len(faked.commands(CONFIGURE))

    faked.light.cancel(faked.now)

    faked.run(10.0)
    assert len(faked.commands(CONFIGURE)) == sent
