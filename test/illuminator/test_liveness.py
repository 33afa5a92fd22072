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

"""A light that falls silent and returns, or is replaced by another one."""

from illuminator_ros.illuminator.light import Settings, STATUS_TIMEOUT
from illuminator_ros.illuminator.messages import STATUS_ID
from illuminator_ros.mavlink.messages import MavCmd
import pytest
from support.back_to_back import BRIDGE, Pair, START
from support.client import Client
from support.fake_light import FakeLight, LIGHT, status_message


def test_a_light_is_lost_after_the_heartbeat_timeout_and_found_again(fake, faked):
    fake.silent = True
    faked.run(2.0)
    assert faked.light.connected
    faked.run(1.1)
    assert faked.recorder.events == ['connected', 'lost: no heartbeat for 3.00 s']
    fake.silent = False
    faked.run(1.0)
    assert faked.recorder.events[2:] == ['connected']


@pytest.mark.parametrize('timeout', [1.1, 3.0, 7.3, 60.0])
def test_the_heartbeat_timeout_is_the_one_that_was_set(timeout):
    fake = FakeLight()
    pair = Pair(fake, settings=Settings(heartbeat_timeout=timeout)).settle()
    fake.silent = True
    heard_at = pair.light.heard_at
    light = pair.light
    pair.run_until(lambda: not light.connected, within=100.0)
    assert pair.now - heard_at == pytest.approx(timeout)


def test_the_moment_of_loss_is_no_moment_of_spinning():
    # For some numbers heard_at + timeout - heard_at is less than the timeout.
    controller = Client(BRIDGE, Settings(heartbeat_timeout=7.3))
    for step in range(1000):
        controller.receive(LIGHT, status_message(), 0.137 * step)
        light = controller.lights[LIGHT]
        light.poll(light.heard_at + 7.3)
        assert not light.connected


def test_an_absence_is_one_event_however_long_it_is(fake, faked):
    fake.silent = True
    faked.run(3600.0)
    assert len(faked.recorders[fake.source].events) == 2


def test_nothing_is_asked_of_a_light_that_is_lost(fake, faked):
    fake.silent = True
    faked.run(10.0)
    at = faked.now
    faked.run(60.0)
    assert faked.commands(since=at) == []


def test_a_lost_link_loses_the_light_at_once_and_a_new_one_finds_it(pair):
    pair.close()
    assert pair.recorder.events[-1] == 'lost: the link was lost'
    pair.run(10.0)
    pair.open()
    pair.run(0.1)
    assert pair.recorder.events[-1] == 'connected'


def test_nothing_is_sent_while_the_link_is_closed(pair):
    pair.close()
    sent = len(pair.near.sent)
    pair.run(60.0)
    assert len(pair.near.sent) == sent


def test_a_light_that_comes_back_is_asked_for_its_status_at_once(fake, faked):
    fake.silent = True
    faked.run(10.0)
    at = faked.now
    fake.silent = False
    faked.run(1.0)
    assert STATUS_ID in [message.param1 for message in faked.commands(
        MavCmd.REQUEST_MESSAGE, since=at)]


def test_a_restart_is_told_once(fake, faked):
    fake.restart(faked.now)
    faked.run(10.0)
    assert faked.recorder.events == ['connected', 'restarted']
    assert faked.light.restarts == 1


def test_a_restart_during_an_absence_is_told_after_it(fake, faked):
    fake.silent = True
    faked.run(5.0)
    fake.restart(faked.now)
    faked.run(1.0)
    fake.silent = False
    faked.run(3.0)
    assert faked.recorder.events[1:] == ['lost: no heartbeat for 3.00 s', 'connected', 'restarted']


def test_an_absence_without_a_restart_is_none(fake, faked):
    fake.silent = True
    faked.run(100.0)
    fake.silent = False
    faked.run(3.0)
    assert 'restarted' not in faked.recorder.events


@pytest.mark.parametrize('first', ['heartbeat', 'status'])
def test_a_light_without_a_clock_that_was_away_may_have_restarted(first):
    fake = FakeLight()
    fake.boot = None
    pair = Pair(fake).settle()
    fake.silent = True
    pair.run(10.0)
    fake.silent = False
    # Whichever of its streams is heard first must not matter.
    fake.heartbeat.due = pair.now + (0.0 if first == 'heartbeat' else 0.5)
    fake._status_due = pair.now + (0.5 if first == 'heartbeat' else 0.0)
    pair.run(3.0)
    assert pair.recorder.events[2:] == ['connected', 'restarted']


def test_a_light_without_a_clock_that_stays_does_not_restart():
    fake = FakeLight()
    fake.boot = None
    pair = Pair(fake).settle(600.0)
    assert pair.recorder.events == ['connected']


def test_an_uptime_that_wraps_is_no_restart():
    fake = FakeLight()
    fake.boot = START - 2 ** 32 / 1000 + 5.0
    pair = Pair(fake).settle(20.0)
    assert pair.light.status.uptime_ms < 20_000
    assert pair.recorder.events == ['connected']


def test_a_late_status_is_not_shown(fake, faked):
    newest = faked.light.status
    fake.send(fake.status(faked.now - 2.0))
    faked.turn()
    faked.run(0.01)
    assert faked.light.status is newest
    assert faked.recorder.statuses[-1] is newest


class TestStatusStream:

    def requests(self, pair, since):
        return [message for message in pair.commands(MavCmd.REQUEST_MESSAGE, since=since)
                if message.param1 == STATUS_ID]

    def test_a_light_that_streams_is_asked_once(self, faked):
        assert len(self.requests(faked, 0.0)) == 1
        faked.run(60.0)
        assert len(self.requests(faked, 0.0)) == 1

    def test_a_light_that_does_not_stream_is_asked_again_and_again(self):
        pair = Pair(FakeLight(stream=0.0)).settle()
        pair.run(60.0)
        asked = len(self.requests(pair, 0.0))
        assert asked == pytest.approx(60 / STATUS_TIMEOUT, abs=3)
        assert len(pair.recorder.statuses) == asked

    def test_a_light_that_knows_no_requests_is_not_flooded_with_them(self):
        fake = FakeLight(stream=0.0, results={MavCmd.REQUEST_MESSAGE: None})
        pair = Pair(fake).settle(60.0)
        assert len(pair.commands(MavCmd.REQUEST_MESSAGE)) <= 4 * (60 / STATUS_TIMEOUT + 3)

    @pytest.mark.parametrize('interval', [0.1, 0.5, 5.0])
    def test_the_interval_that_is_wished_is_asked_for(self, interval):
        fake = FakeLight(stream=1.0)
        pair = Pair(fake, settings=Settings(status_interval=interval)).settle(30.0)
        (command,) = pair.commands(MavCmd.SET_MESSAGE_INTERVAL)
        assert (command.param1, command.param2) == (STATUS_ID, pytest.approx(interval * 1e6))
        assert fake.stream == pytest.approx(interval)
        assert self.requests(pair, 1003.0) == []

    @pytest.mark.parametrize('timeout', [10.0, 3.0, 2.0, 1.1])
    def test_a_light_without_heartbeat_that_is_to_report_rarely_is_not_lost(self, timeout):
        fake = FakeLight(heartbeat_type=None)
        pair = Pair(fake, settings=Settings(timeout, status_interval=60.0)).settle(300.0)
        assert fake.stream == 60.0
        assert pair.recorder.events == ['connected']

    def test_the_interval_is_ignored_where_none_is_wished(self, faked):
        assert faked.commands(MavCmd.SET_MESSAGE_INTERVAL) == []

    def test_the_interval_is_asked_for_again_after_a_restart(self):
        fake = FakeLight()
        pair = Pair(fake, settings=Settings(status_interval=0.5)).settle()
        fake.restart(pair.now)
        fake.stream = 1.0
        pair.run(3.0)
        assert fake.stream == 0.5
