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

"""When a status was sent, told from its uptime: what is too old to confirm anything."""

import random

from illuminator_ros.illuminator.status import SendingTimes, WRAP_MS
from illuminator_ros.mavlink.messages import CommandAck, MavCmd, MavResult
import pytest
from support.back_to_back import BRIDGE, Pair
from support.fake_light import FakeLight


def heard(*statuses):
    """Return the result for the last of some statuses: pairs of uptime (ms) and arrival (s)."""
    times = SendingTimes()
    return [times.sent_by(uptime, at) for uptime, at in statuses][-1]


def test_a_status_that_was_on_its_way_for_long_was_sent_earlier():
    sent_by = heard((5000, 100.0), (6001, 101.0), (6301, 103.3))
    assert sent_by == pytest.approx(101.3, abs=0.06)


def test_a_delayed_status_does_not_make_the_next_delayed_one_look_fresh():
    sent_by = heard((5000, 100.0), (6001, 101.0), (6301, 103.3), (6401, 103.4))
    assert sent_by == pytest.approx(101.4, abs=0.06)


@pytest.mark.parametrize('uptime', [0, 7])
def test_without_a_clock_a_status_counts_as_sent_when_it_came(uptime):
    assert heard((uptime, 100.0), (uptime, 101.0), (uptime, 107.0)) == 107.0


@pytest.mark.parametrize('step_ms', [1, 10, 1000])
@pytest.mark.parametrize('rate', [0.985, 1.0, 1.015])
@pytest.mark.parametrize('boot', [0.0, -WRAP_MS / 1000 + 130.0])
def test_no_status_is_ever_said_to_be_older_than_it_is(step_ms, rate, boot):
    draw = random.Random(f'{step_ms} {rate} {boot}')
    times, sent_at, arrivals = SendingTimes(), 100.0, []
    for _ in range(2000):
        sent_at += draw.choice((0.01, 0.3, 1.0))
        arrivals.append((sent_at + draw.choice((0.001, 0.02, draw.uniform(0, 3))), sent_at))
    newest = 0.0
    for at, sent_at in sorted(arrivals):
        if sent_at < newest:
            # One that has been overtaken is not looked at.
            continue
        newest = sent_at
        uptime = int((sent_at - boot) * rate * 1000 / step_ms) * step_ms
        assert times.sent_by(uptime % WRAP_MS, at) >= sent_at - 1e-6


def test_a_status_from_before_the_command_confirms_nothing_though_it_is_news(fake, faked):
    # Another sender switches the light on and off between two received statuses. The status from
    # in between arrives late, while we wait for it because of a late acknowledgement.
    fake.stream = 0.0
    faked.light.request_status(faked.now)
    faked.run(0.31)
    fake.fields['enable'] = 1
    in_between = fake.status(faked.now)
    fake.fields['enable'] = 0
    faked.run(0.5)
    fake.results[MavCmd.ILLUMINATOR_ON_OFF] = None
    answer = faked.ask_enable(True)
    fake.send(CommandAck(MavCmd.ILLUMINATOR_ON_OFF, MavResult.ACCEPTED, 0, 0, *BRIDGE))
    fake.send(in_between)
    result = faked.wait_for(answer)
    assert in_between.enable == 1
    assert not result.success


def test_a_failure_says_that_what_came_was_older(fake, faked):
    fake.stream = 0.0
    fake.answers.clear()
    faked.run(1.07)
    old = fake.status(faked.now)
    faked.run(0.5)
    answer = faked.ask_enable(True)
    faked.run(0.1)
    fake.send(old)
    assert 'but no later ILLUMINATOR_STATUS came within 1.00 s' in faked.wait_for(answer).message


def test_a_light_that_counts_in_seconds_is_confirmed_as_fast_as_any():
    # Its statuses look up to a second older than they are.
    fake = FakeLight(stream=0.3)
    uptime_ms = fake.uptime_ms
    fake.uptime_ms = lambda now: uptime_ms(now) // 1000 * 1000
    pair = Pair(fake).settle(20.35)
    for on in (True, False) * 5:
        answer = pair.ask_enable(on)
        assert pair.wait_for(answer).success
        assert answer.seconds < 0.01
        pair.run(0.17)


@pytest.mark.parametrize('rate', [0.8, 0.9, 0.95, 1.1])
def test_wrong_clock_makes_a_status_look_less_than_a_second_old(rate: float) -> None:
    times = SendingTimes()
    ages = [now - times.sent_by(int(rate * now * 1000), now)
            for now in (second + 0.0137 * (second % 7) for second in range(1, 600))]
    assert max(ages) < 1.0
