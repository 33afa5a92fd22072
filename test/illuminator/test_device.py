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

"""The light's side: what it sends by itself and on request."""

from illuminator_ros.illuminator.identity import Identity
from illuminator_ros.illuminator.simulated import describe
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.mavlink.messages import (
    Address,
    CommandAck,
    CommandInt,
    CommandLong,
    ComponentInformationBasic,
    encode_payload,
    Heartbeat,
    IlluminatorStatus,
    INFORMATION_ID,
    MavCmd,
    MavResult,
    MavType,
    STATUS_ID,
)
from illuminator_ros.payload.simulated import SimulatedComponent
import pytest

GROUND = Address(255, 190)
NAN, INF = float('nan'), float('inf')


class Bench:
    """A light on a bench: commands in, messages out, time at will."""

    def __init__(self, **properties):
        self.now = 0.0
        self.device = SimulatedComponent(describe(IlluminatorProperties(**properties)), self.now)

    def run(self, seconds):
        """Return what is sent in this time (s)."""
        end = self.now + seconds
        while self.device.next_deadline() <= end:
            self.now = max(self.now, self.device.next_deadline())
            self.device.poll(self.now)
        self.now = end
        return self.sent()

    def sent(self, kind=object):
        sent = [message for _, message in self.device.outgoing if isinstance(message, kind)]
        self.device.outgoing.clear()
        return sent

    def command(self, command, *params, target=(1, 243), form=CommandLong):
        """Return what a command is answered with."""
        values = [*params, *[0.0] * (7 - len(params))]
        if form is CommandInt:
            message = CommandInt(*target, 0, command, 0, 0, *values[:4], 0, 0, 0.0)
        else:
            message = CommandLong(*target, command, 0, *values)
        self.device.receive(GROUND, message, self.now)
        return self.sent()

    def result(self, command, *params, **keywords):
        """Return the MAV_RESULT that a command is answered with."""
        ack, *_ = self.command(command, *params, **keywords)
        return MavResult(ack.result)


@pytest.fixture
def bench():
    bench = Bench()
    bench.run(0.5)
    return bench


def statuses(messages):
    return [message for message in messages if isinstance(message, IlluminatorStatus)]


def test_a_heartbeat_of_type_illuminator_comes_once_a_second_from_the_start():
    beats = [m for m in Bench().run(4.5) if isinstance(m, Heartbeat)]
    assert len(beats) == 5
    assert {(m.type, m.autopilot) for m in beats} == {(MavType.ILLUMINATOR, 8)}


@pytest.mark.parametrize(('interval', 'expected'), [(1.0, 5), (0.5, 9), (0.1, 45), (0.0, 0)])
def test_statuses_come_at_the_interval_of_the_properties(interval, expected):
    assert len(statuses(Bench(status_interval=interval).run(4.45))) == expected


def test_what_was_missed_while_it_was_held_up_is_not_made_up_for(bench):
    bench.device.poll(60.2)
    bench.device.poll(60.3)
    assert len(statuses(bench.sent())) == 1


def test_a_stream_keeps_its_pace_however_late_it_is_looked_at():
    device = SimulatedComponent(describe(IlluminatorProperties(status_interval=0.1)), 0.0)
    for turn in range(101):
        device.poll(turn * 0.1 + 0.03)
    assert len([m for _, m in device.outgoing if isinstance(m, IlluminatorStatus)]) == 101


def test_the_uptime_counts_from_the_start_and_wraps(bench):
    assert bench.device.device.lamp.uptime_ms(1.234) == 1234
    assert bench.device.device.lamp.uptime_ms(2 ** 32 / 1000 + 1.5) == 1500


def test_a_status_is_sent_on_request_after_its_acknowledgement(bench):
    ack, status = bench.command(MavCmd.REQUEST_MESSAGE, STATUS_ID)
    assert isinstance(ack, CommandAck)
    assert ack.result == MavResult.ACCEPTED
    assert (status.uptime_ms, status.enable, status.mode, status.brightness) == (500, 0, 1, 100.0)


def test_the_identity_is_sent_on_request_after_its_acknowledgement(bench):
    ack, information = bench.command(MavCmd.REQUEST_MESSAGE, INFORMATION_ID)
    assert ack.result == MavResult.ACCEPTED
    assert isinstance(information, ComponentInformationBasic)
    assert Identity.from_message(information).serial_number == 'SIM-1-243'


def test_strings_that_are_too_long_are_cut_so_that_they_are_terminated():
    bench = Bench(identity=Identity('v' * 40, 'm' * 40, 's' * 40, 'h' * 40, 'n' * 40))
    _, information = bench.command(MavCmd.REQUEST_MESSAGE, INFORMATION_ID)
    strings = encode_payload(information)[16:]
    assert strings == (b'v' * 31 + b'\0' + b'm' * 31 + b'\0' + b's' * 23 + b'\0'
                       + b'h' * 23 + b'\0' + b'n' * 31 + b'\0')


@pytest.mark.parametrize('message_id', [0, 1, 33, NAN, INF, -1, 440.5])
def test_other_messages_cannot_be_requested(bench, message_id):
    assert bench.result(MavCmd.REQUEST_MESSAGE, message_id) == MavResult.DENIED


@pytest.mark.parametrize(('microseconds', 'expected'), [
    (250_000, 8),     # in 2 s
    (2_000_000, 1),
    (0, 2),           # the default
    (-1, 0),          # off
    (1, 200),         # faster than on offer
])
def test_the_status_interval_can_be_set(bench, microseconds, expected):
    assert bench.result(
        MavCmd.SET_MESSAGE_INTERVAL, STATUS_ID, microseconds) == MavResult.ACCEPTED
    assert len(statuses(bench.run(2.001))) == expected


def test_the_default_interval_brings_back_a_stream_that_was_off(bench):
    bench.command(MavCmd.SET_MESSAGE_INTERVAL, STATUS_ID, -1)
    bench.command(MavCmd.SET_MESSAGE_INTERVAL, STATUS_ID, 0)
    assert len(statuses(bench.run(3.0))) == 3


@pytest.mark.parametrize('microseconds', [NAN, INF, -INF, -2.0, -0.5])
def test_an_interval_that_cannot_be_is_denied_and_changes_nothing(bench, microseconds):
    assert bench.result(
        MavCmd.SET_MESSAGE_INTERVAL, STATUS_ID, microseconds) == MavResult.DENIED
    assert len(statuses(bench.run(3.0))) == 3


@pytest.mark.parametrize('message_id', [0, INFORMATION_ID, NAN])
def test_other_intervals_are_denied(bench, message_id):
    assert bench.result(
        MavCmd.SET_MESSAGE_INTERVAL, message_id, 100_000) == MavResult.DENIED


@pytest.mark.parametrize('command', [0, 80, 176, 400, 404, 407, 513, 65535])
def test_any_other_command_is_unsupported(bench, command):
    assert bench.result(command) == MavResult.UNSUPPORTED


@pytest.mark.parametrize('target', [(0, 0), (1, 0), (1, 243), (0, 243)])
def test_what_is_addressed_to_the_light_or_to_all_is_answered(bench, target):
    assert bench.result(MavCmd.ILLUMINATOR_ON_OFF, 1, target=target) == MavResult.ACCEPTED


@pytest.mark.parametrize('target', [(1, 244), (2, 243), (2, 0), (255, 190)])
def test_what_is_addressed_to_another_is_neither_answered_nor_done(bench, target):
    assert bench.command(MavCmd.ILLUMINATOR_ON_OFF, 1, target=target) == []
    assert bench.device.device.lamp.enabled is False


def test_an_acknowledgement_names_its_command_and_its_target(bench):
    ack = bench.command(MavCmd.ILLUMINATOR_ON_OFF, 1)[0]
    assert (ack.command, ack.target_system, ack.target_component) == (405, *GROUND)


@pytest.mark.parametrize('message', [
    Heartbeat(18, 8, 0, 0, 4, 3), CommandAck(405, 0, 0, 0, 1, 243)])
def test_what_is_no_command_gets_no_answer(bench, message):
    bench.device.receive(GROUND, message, bench.now)
    assert bench.sent() == []


def test_a_restart_brings_back_the_default_settings_but_not_the_cold():
    bench = Bench()
    bench.command(MavCmd.ILLUMINATOR_ON_OFF, 1)
    bench.command(MavCmd.DO_ILLUMINATOR_CONFIGURE, 2, 50, 1, 10)
    bench.device.device.lamp.thermal.temperature = 60.0
    bench.now = 100.0
    bench.device.restart(bench.now)
    assert isinstance(bench.run(0.0)[0], Heartbeat)
    status = bench.device.device.status(bench.now)
    assert (status.uptime_ms, status.enable, status.mode, status.brightness) == (0, 0, 1, 100.0)
    assert status.temp_c == 60.0
