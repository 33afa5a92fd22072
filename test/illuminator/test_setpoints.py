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

"""A stream of brightness setpoints: the newest wins, one command is in flight."""

from illuminator_ros.illuminator.model import Mode
from illuminator_ros.mavlink.messages import CommandAck, MavCmd, MavResult
import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight
from support.faulty_wire import Faults

CONFIGURE = MavCmd.DO_ILLUMINATOR_CONFIGURE


def publish(pair, *values, rate=None):
    for value in values:
        pair.light.set_brightness(value, pair.now)
        pair.turn()
        if rate:
            pair.run(1 / rate)


def ramp(count):
    """Return setpoints of which no two that follow each other are alike."""
    return [float(1 + i % 97) for i in range(count)]


def in_flight(pair):
    """Return how many configurations were unanswered at most, in the order of the log."""
    events = [(at, 1) for at, _ in pair.commands_at(CONFIGURE)]
    events += [(at, -1) for at, _, message in pair.near.received
               if isinstance(message, CommandAck) and message.command == CONFIGURE]
    most = level = 0
    # At one moment the acknowledgement comes first: it is what the next command waits for.
    for _, change in sorted(events):
        level += change
        most = max(most, level)
    return most


def test_a_setpoint_is_sent_with_the_other_fields_as_agreed(pair):
    pair.configure(strobe_period=2)
    publish(pair, 40.0)
    pair.run(0.1)
    last = pair.commands(CONFIGURE)[-1]
    assert (last.param1, last.param2, last.param3, last.param4) == (1, 40, 2, 50)
    assert pair.snapshot.configuration.brightness == 40.0


@pytest.mark.parametrize('rate', [1, 10, 100, 1000, 10_000])
@pytest.mark.parametrize('latency', [0.0005, 0.01, 0.1])
def test_one_command_is_in_flight_whatever_the_rate(rate, latency):
    pair = Pair(there=Faults(latency=latency)).settle()
    publish(pair, *ramp(200), rate=rate)
    pair.run(1.0)
    assert in_flight(pair) == 1
    assert pair.lamp.configuration.brightness == ramp(200)[-1]
    assert pair.recorder.failed_setpoints == []


def test_a_stream_is_as_fast_as_the_line():
    pair = Pair(there=Faults(latency=0.01)).settle()
    publish(pair, *ramp(500), rate=500)
    assert len(pair.commands(CONFIGURE)) == pytest.approx(50, abs=3)


def test_a_setpoint_that_is_agreed_already_is_not_sent(pair):
    publish(pair, *[40.0] * 100, rate=100)
    pair.run(1.0)
    assert len(pair.commands(CONFIGURE)) == 1


def test_a_setpoint_is_sent_again_where_the_light_may_have_taken_another(fake, faked):
    # It takes 30 and cannot say so: until it is heard, it may be at 30 or at 100.
    fake.results[MavCmd.DO_ILLUMINATOR_CONFIGURE] = None
    publish(faked, 30.0)
    fake.fields['brightness'] = 30.0
    fake.stream = 0.0
    faked.run(1.0)
    fake.results[MavCmd.DO_ILLUMINATOR_CONFIGURE] = MavResult.ACCEPTED
    publish(faked, 100.0)
    faked.run(1.0)
    assert fake.fields['brightness'] == 100.0


def test_a_setpoint_is_sent_again_where_the_light_shows_another(fake, faked):
    fake.applies = False
    publish(faked, 40.0)
    faked.run(1.5)
    fake.applies = True
    publish(faked, 40.0)
    faked.run(0.5)
    assert fake.fields['brightness'] == 40.0


def test_a_setpoint_that_is_under_way_already_is_not_sent_again(fake, faked):
    fake.apply_after = 0.2
    publish(faked, 40.0, 50.0, 40.0)
    faked.run(2.0)
    assert [m.param2 for m in faked.commands(CONFIGURE)] == [40.0]
    assert faked.snapshot.configuration.brightness == 40.0


def test_a_superseded_setpoint_is_not_taken_as_confirmed(fake, faked):
    # 30 is accepted, not done, and overtaken by 40, which is refused: is it 30 now?
    fake.applies = False
    publish(faked, 30.0)
    faked.run(0.1)
    fake.applies = True
    fake.results[MavCmd.DO_ILLUMINATOR_CONFIGURE] = [MavResult.DENIED, MavResult.ACCEPTED]
    publish(faked, 40.0)
    faked.run(0.1)
    publish(faked, 30.0)
    faked.run(0.5)
    assert fake.fields['brightness'] == 30.0


def test_the_last_setpoint_is_verified(fake, faked):
    fake.applies = False
    publish(faked, 30.0, 40.0)
    faked.run(2.0)
    (message,) = faked.recorder.failed_setpoints
    assert 'brightness 40 % not confirmed: MAV_RESULT_ACCEPTED, but' in message


def test_failures_are_told_and_the_stream_goes_on(fake, faked):
    fake.results[MavCmd.DO_ILLUMINATOR_CONFIGURE] = [MavResult.FAILED, MavResult.ACCEPTED]
    publish(faked, 30.0, 40.0)
    faked.run(0.5)
    assert faked.recorder.failed_setpoints[0].startswith('refused: MAV_RESULT_FAILED')
    assert fake.fields['brightness'] == 40.0


def test_a_setpoint_does_not_wait_for_a_light_that_was_lost_meanwhile(fake, faked):
    # An old setpoint must not take effect when the light returns.
    fake.results[MavCmd.DO_ILLUMINATOR_CONFIGURE] = None
    publish(faked, 30.0, 40.0)
    faked.close()
    assert any('the link is not open' in one for one in faked.recorder.failed_setpoints)
    faked.run(5.0)
    fake.results[MavCmd.DO_ILLUMINATOR_CONFIGURE] = MavResult.ACCEPTED
    faked.open()
    faked.run(5.0)
    assert fake.fields['brightness'] == 100.0


def test_before_the_first_status_it_is_refused_with_the_reason():
    fake = FakeLight(stream=0.0)
    fake.answers.clear()
    pair = Pair(fake).settle()
    publish(pair, 40.0)
    assert 'has not reported its configuration yet' in pair.recorder.failed_setpoints[0]
    pair.run(1.0)
    assert pair.commands(CONFIGURE) == []


def test_a_setpoint_waits_for_a_command_but_does_not_end_it(fake, faked):
    fake.apply_after = 0.3
    answer = faked.ask_configure(mode='external_sync')
    publish(faked, 40.0)
    assert faked.wait_for(answer).message.startswith(
        'mode external_sync, confirmed by ILLUMINATOR_STATUS')
    faked.run(1.0)
    agreed = faked.snapshot.configuration
    assert (agreed.mode, agreed.brightness) == (Mode.EXTERNAL_SYNC, 40.0)


def test_overrides_are_not_starved_by_a_stream(fake, faked):
    fake.results[MavCmd.DO_ILLUMINATOR_CONFIGURE] = [None, None, None, MavResult.ACCEPTED]
    faked.light.set_desired({'strobe_period': 2.0}, faked.now)
    for value in range(400):
        faked.light.set_brightness(value % 100 / 1.0, faked.now)
        faked.run(0.02)
    assert fake.fields['strobe_period'] == 2.0
