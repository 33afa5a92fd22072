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

"""What goes wrong with a simulated light when it is told to."""

import math

from illuminator_ros.illuminator.faults import FAULTS
from illuminator_ros.illuminator.simulated import describe
from illuminator_ros.illuminator.simulated_properties import (
    IlluminatorBehaviour,
    IlluminatorProperties,
)
from illuminator_ros.mavlink.messages import (
    Address,
    CommandAck,
    CommandLong,
    Heartbeat,
    IlluminatorStatus,
    MavCmd,
    MavResult,
    STATUS_ID,
)
from illuminator_ros.payload.faults import FaultError
from illuminator_ros.payload.simulated import SimulatedComponent
import pytest

GROUND = Address(255, 190)
ON_OFF = MavCmd.ILLUMINATOR_ON_OFF


class Faulty:
    """A light with faults, whose messages are kept with their times."""

    def __init__(self, *faults, **properties):
        behaviour = IlluminatorBehaviour()
        for fault in faults:
            behaviour = FAULTS.add(behaviour, fault)
        self.device = SimulatedComponent(
            describe(IlluminatorProperties(behaviour=behaviour, **properties)), 0.0)
        self.now = 0.0
        self.sent = []

    def run(self, seconds):
        end = self.now + seconds
        while (due := self.device.next_deadline()) <= end:
            self.now = max(self.now, due)
            self.device.poll(self.now)
            self.collect()
        self.now = end
        return self

    def collect(self):
        self.sent += [(self.now, message) for _, message in self.device.outgoing]
        self.device.outgoing.clear()

    def command(self, command=ON_OFF, *params):
        values = [*(params or (1,)), *[0.0] * 7][:7]
        self.device.receive(GROUND, CommandLong(1, 243, command, 0, *values), self.now)
        self.collect()

    def of(self, kind):
        return [(at, message) for at, message in self.sent if isinstance(message, kind)]

    def results(self):
        return [ack.result for _, ack in self.of(CommandAck)]


def test_a_silent_light_neither_sends_nor_does_anything():
    light = Faulty('silence')
    light.run(5.0).command()
    assert light.sent == []
    assert light.device.device.lamp.enabled is False


def test_silence_may_have_an_end():
    light = Faulty('silence=3').run(5.5)
    assert [at for at, _ in light.of(Heartbeat)] == [3.0, 4.0, 5.0]


def test_it_restarts_again_and_again():
    light = Faulty('reboot=4').run(9.9)
    uptimes = [status.uptime_ms for _, status in light.of(IlluminatorStatus)]
    assert uptimes == [0, 1000, 2000, 3000, 0, 1000, 2000, 3000, 0, 1000]


@pytest.mark.parametrize('fault', ['slow=2', 'progress=2'])
def test_what_was_under_way_is_forgotten_with_a_restart(fault):
    light = Faulty(fault)
    light.command()
    light.device.restart(0.5)
    light.now = 0.5
    light.run(5.0)
    assert light.device.device.lamp.enabled is False
    assert MavResult.ACCEPTED not in light.results()


def test_what_was_not_sent_yet_is_lost_with_a_restart():
    light = Faulty('delay=3', status_interval=0.0)
    light.device.poll(0.0)
    for _ in range(20):
        light.command()
    light.device.restart(0.0)
    light.run(5.0)
    assert light.of(CommandAck) == []


def test_a_failed_thermistor_is_reported_and_measures_nothing():
    light = Faulty('thermistor').run(0.0)
    (_, status), = light.of(IlluminatorStatus)
    assert (status.error_status, status.temp_c) == (4, 0.0)


def test_a_light_without_thermistor_does_not_notice_the_heat():
    light = Faulty('thermistor')
    light.device.device.lamp.heat_to(120.0, 0.0)
    light.run(2.0)
    assert light.of(IlluminatorStatus)[-1][1].error_status == 4


def test_a_thermistor_that_works_again_measures_again():
    light = Faulty('thermistor')
    light.device.behave(IlluminatorBehaviour(), 0.0)
    status = light.device.device.status(0.0)
    assert (status.error_status, status.temp_c) == (0, 25.0)


@pytest.mark.parametrize(('fault', 'result'), [
    ('refuse', MavResult.DENIED), ('refuse=failed', MavResult.FAILED),
    ('refuse=MAV_RESULT_NOT_IN_CONTROL', MavResult.NOT_IN_CONTROL)])
def test_changes_are_refused_with_the_result_and_requests_are_not(fault, result):
    light = Faulty(fault)
    light.command()
    light.command(MavCmd.REQUEST_MESSAGE, STATUS_ID)
    assert light.results() == [result, MavResult.ACCEPTED]
    assert light.device.device.lamp.enabled is False


def test_progress_is_reported_until_the_change_is_made():
    light = Faulty('progress=2')
    light.command()
    light.run(1.9)
    assert light.device.device.lamp.enabled is False
    light.run(0.2)
    acks = [(at, ack.result, ack.progress) for at, ack in light.of(CommandAck)]
    assert acks == [(0.0, 5, 0), (0.5, 5, 25), (1.0, 5, 50), (1.5, 5, 75), (2.0, 0, 0)]
    assert light.device.device.lamp.enabled is True


def test_a_second_command_meanwhile_is_rejected_temporarily():
    light = Faulty('progress=2')
    light.command()
    light.run(1.0).command()
    assert light.results()[-1] == MavResult.TEMPORARILY_REJECTED
    assert light.run(3.0).results().count(MavResult.ACCEPTED) == 1


def test_some_changes_are_rejected_temporarily_and_the_next_is_made():
    light = Faulty('busy=2')
    for _ in range(3):
        light.command()
    assert light.results() == [1, 1, 0]
    assert light.device.device.lamp.enabled is True


def test_a_slow_light_answers_and_acts_late():
    light = Faulty('slow=1.5')
    light.command()
    light.run(1.4)
    assert (light.results(), light.device.device.lamp.enabled) == ([], False)
    light.run(0.2)
    assert [at for at, _ in light.of(CommandAck)] == [1.5]
    assert light.device.device.lamp.enabled is True


def test_a_light_that_lies_accepts_and_does_nothing():
    light = Faulty('lie')
    light.command()
    assert light.results() == [MavResult.ACCEPTED]
    assert light.device.device.status(0.0).enable == 0


@pytest.mark.parametrize(('share', 'low', 'high'), [(0.2, 140, 180), (1, 0, 0)])
def test_a_share_of_messages_is_lost(share, low, high):
    light = Faulty(f'drop={share}', status_interval=0.0).run(199.5)
    assert low <= len(light.sent) <= high


def test_a_share_of_messages_comes_twice():
    light = Faulty('duplicate=0.25', status_interval=0.0).run(199.5)
    assert 230 <= len(light.sent) <= 270


def test_a_share_of_messages_has_a_wrong_checksum():
    light = Faulty('corrupt=0.5', status_interval=0.0).run(199.5)
    wrong = [message for _, message in light.sent if message.crc_extra != Heartbeat.crc_extra]
    assert 80 <= len(wrong) <= 120
    assert Heartbeat.crc_extra == 50


def test_messages_are_late_by_up_to_a_time():
    light = Faulty('delay=0.5', status_interval=0.0).run(50.0)
    late = [at % 1.0 for at, _ in light.sent]
    assert min(late) > 0.0
    assert 0.3 < max(late) < 0.5


@pytest.mark.parametrize('fault', ['drop', 'duplicate', 'delay', 'corrupt'])
def test_the_same_seed_brings_the_same_run(fault):
    first, again, other = (
        [(at, message.crc_extra) for at, message in Faulty(fault, seed=seed).run(50.0).sent]
        for seed in (1, 1, 2))
    assert first == again != other


def test_a_fault_can_begin_and_end_while_the_light_runs():
    light = Faulty().run(2.0)
    light.device.behave(FAULTS.add(light.device.behaviour, 'drop=1'), light.now)
    light.run(3.0)
    assert len(light.of(Heartbeat)) == 3
    light.device.behave(FAULTS.remove(light.device.behaviour, IlluminatorBehaviour(), 'drop'),
                        light.now)
    light.run(2.0)
    assert len(light.of(Heartbeat)) == 5


def test_faults_that_are_active_are_known():
    behaviour = FAULTS.add(FAULTS.add(IlluminatorBehaviour(), 'lie'), 'drop=0.1')
    assert FAULTS.active(behaviour, IlluminatorBehaviour()) == ['drop', 'lie']


@pytest.mark.parametrize('text', [
    'silence', 'silence=5.0', 'drop=0.2', 'refuse=failed', 'busy=1000000', 'flags=128', 'nan'])
def test_faults_are_described_as_they_are_typed(text):
    normal = IlluminatorBehaviour()
    assert FAULTS.as_typed(FAULTS.add(normal, text), normal) == [text]


@pytest.mark.parametrize('name', FAULTS)
def test_every_fault_changes_the_behaviour_and_ends_again(name):
    faulty = FAULTS.add(IlluminatorBehaviour(), name)
    assert faulty != IlluminatorBehaviour()
    assert FAULTS.remove(faulty, IlluminatorBehaviour(), name) == IlluminatorBehaviour()


@pytest.mark.parametrize(('text', 'said'), [
    ('nope', "no fault 'nope'; there are silence, reboot"),
    ('', "no fault ''"),
    ('lie=1', 'lie takes no value'),
    ('drop=2', "'2' is not a SHARE: not within 0 to 1"),
    ('drop=0', 'not a SHARE'),
    ('drop=nan', 'not a SHARE'),
    ('drop=', 'not a SHARE'),
    ('slow=-1', 'not a S: not within 0 to 3600 s'),
    ('slow=inf', 'not a S'),
    ('busy=0', 'not a N'),
    ('refuse=maybe', 'not a RESULT'),
    ('flags=0', 'not a FLAGS'),
    ('type=256', 'not a N'),
])
def test_what_is_no_fault_is_said(text, said):
    with pytest.raises(FaultError) as caught:
        FAULTS.add(IlluminatorBehaviour(), text)
    assert said in str(caught.value)


def test_the_description_has_every_fault_with_its_default():
    lines = FAULTS.describe().splitlines()
    assert len(lines) == len(FAULTS)
    assert '  drop[=SHARE]         loses a share of its messages (default: 0.3)' in lines
    assert any('refuse' in line and '(default: denied)' in line for line in lines)
    assert any('silence' in line and '(default: for ever)' in line for line in lines)
    assert FAULTS['silence'].default == math.inf
