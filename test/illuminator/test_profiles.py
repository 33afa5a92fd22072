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

"""Lights as they are seen in the field."""

from illuminator_ros.illuminator.model import Status
from illuminator_ros.illuminator.simulated import describe
from illuminator_ros.illuminator.simulated_properties import PROFILES
from illuminator_ros.illuminator.simulated_settings import properties
from illuminator_ros.mavlink.messages import (
    Address,
    CommandAck,
    CommandLong,
    decode_payload,
    encode_payload,
    Heartbeat,
    IlluminatorStatus,
    INFORMATION_ID,
    MavCmd,
    MavResult,
    STATUS_ID,
)
from illuminator_ros.payload.simulated import SimulatedComponent
import pytest

GROUND = Address(255, 190)
ON_OFF, CONFIGURE = MavCmd.ILLUMINATOR_ON_OFF, MavCmd.DO_ILLUMINATOR_CONFIGURE
NAN = float('nan')


class Lamp:
    """A light of a profile."""

    def __init__(self, profile, **settings):
        settings['profile'] = profile
        self.device = SimulatedComponent(
            describe(properties(settings, PROFILES[profile].address)), 0.0)
        self.now = 0.0

    def run(self, seconds):
        """Return what is sent in this time."""
        end = self.now + seconds
        while (due := self.device.next_deadline()) <= end:
            self.now = max(self.now, due)
            self.device.poll(self.now)
        self.now = end
        return self.sent()

    def sent(self):
        messages = [message for _, message in self.device.outgoing]
        self.device.outgoing.clear()
        return messages

    def command(self, command, *params, target=None):
        values = [*params, *[0.0] * 7][:7]
        self.device.receive(
            GROUND, CommandLong(*(target or self.device.address), command, 0, *values), self.now)
        return self.sent()

    def result(self, command, *params, **keywords):
        return MavResult(self.command(command, *params, **keywords)[0].result)

    def status(self):
        return self.device.device.status(self.now)


def beats(messages):
    return [message for message in messages if isinstance(message, Heartbeat)]


class TestReference:

    def test_it_sends_from_255_0_with_a_state_that_is_not_initialized(self):
        lamp = Lamp('reference')
        (beat,) = beats(lamp.run(0.5))
        assert lamp.device.address == Address(255, 0)
        assert (beat.type, beat.autopilot, beat.system_status) == (44, 8, 0)

    def test_it_acknowledges_to_nobody_in_particular_before_it_applies(self):
        lamp = Lamp('reference')
        lamp.run(0.5)
        (ack,) = lamp.command(ON_OFF, 1)
        assert (ack.target_system, ack.target_component) == (0, 0)
        assert lamp.status().enable == 0
        lamp.run(0.1)
        assert lamp.status().enable == 1

    def test_it_sends_at_1_hz_or_not_at_all(self):
        lamp = Lamp('reference')
        for interval, count in ((100_000, 3), (-1, 0), (5_000_000, 3)):
            assert lamp.result(MavCmd.SET_MESSAGE_INTERVAL, STATUS_ID, interval) == 0
            sent = [one for one in lamp.run(3.05) if isinstance(one, IlluminatorStatus)]
            assert len(sent) == count

    def test_a_change_is_no_news(self):
        lamp = Lamp('reference')
        lamp.run(0.5)
        lamp.command(ON_OFF, 1)
        assert not any(isinstance(one, IlluminatorStatus) for one in lamp.run(0.4))

    def test_it_does_what_is_for_others_and_has_no_clock(self):
        lamp = Lamp('reference')
        lamp.run(5.0)
        assert lamp.result(ON_OFF, 1, target=(7, 7)) == MavResult.ACCEPTED
        assert lamp.status().uptime_ms == 0

    @pytest.mark.parametrize(('params', 'result'), [
        ((1, NAN, 0, 0), MavResult.ACCEPTED), ((1, 50, NAN, 0), MavResult.ACCEPTED),
        ((1, 50, 0, NAN), MavResult.ACCEPTED), ((NAN, 50, 0, 0), MavResult.DENIED),
        ((1, float('inf'), 0, 0), MavResult.DENIED), ((1, 50, 11, 0), MavResult.DENIED)])
    def test_nan_passes_its_range_checks(self, params, result):
        assert Lamp('reference').result(CONFIGURE, *params) == result

    def test_a_light_that_has_let_nan_in_goes_on(self):
        lamp = Lamp('reference')
        lamp.command(CONFIGURE, 1, NAN, 0, 0)
        lamp.command(ON_OFF, 1)
        lamp.run(10.0)
        assert lamp.status().temp_c > 25.0

    def test_its_versions_have_no_terminator(self):
        lamp = Lamp('reference')
        _, information = lamp.command(MavCmd.REQUEST_MESSAGE, INFORMATION_ID)
        raw = encode_payload(information)
        assert raw[80:104] == b'Illuminator Software Ver'
        assert raw[16:48].rstrip(b'\0') == b'Illuminator Vendor'


class TestArduSub:

    def test_it_is_the_autopilot(self):
        lamp = Lamp('ardusub')
        (beat,) = beats(lamp.run(0.5))
        assert lamp.device.address == Address(1, 1)
        assert (beat.type, beat.autopilot) == (12, 3)

    def test_what_it_does_not_measure_is_0_and_its_bitmask_is_shifted(self):
        lamp = Lamp('ardusub')
        lamp.run(3.0)
        status = lamp.status()
        assert (status.temp_c, status.min_strobe_period, status.max_strobe_period) == (0, 0, 0)
        assert status.mode_bitmask == 2

    def test_brightness_0_is_off_and_on_brings_back_the_last_one(self):
        lamp = Lamp('ardusub')
        lamp.command(CONFIGURE, 1, 40, 0, 0)
        assert (lamp.status().enable, lamp.status().brightness) == (1, 40)
        lamp.command(ON_OFF, 0)
        assert (lamp.status().enable, lamp.status().brightness) == (0, 0)
        lamp.command(ON_OFF, 1)
        assert (lamp.status().enable, lamp.status().brightness) == (1, 40)
        lamp.command(CONFIGURE, 1, 0, 0, 0)
        assert lamp.status().enable == 0
        lamp.command(ON_OFF, 1)
        assert (lamp.status().enable, lamp.status().brightness) == (1, 40)

    def test_it_does_not_strobe(self):
        assert Lamp('ardusub').result(CONFIGURE, 1, 40, 1, 50) == MavResult.DENIED

    def test_it_has_no_component_information(self):
        assert Lamp('ardusub').result(
            MavCmd.REQUEST_MESSAGE, INFORMATION_ID) == MavResult.DENIED


class TestExtended:

    def test_its_status_has_38_bytes(self):
        status = Lamp('extended', zoom_level=7, color_mode=2, gimbal_device_id=154).status()
        payload = encode_payload(status)
        assert len(payload) == 38
        assert payload[35:] == bytes([7, 2, 154])

    def test_whoever_knows_35_bytes_reads_them(self):
        lamp = Lamp('extended')
        lamp.command(CONFIGURE, 2, 30, 0.5, 20)
        status = Status.from_message(
            decode_payload(STATUS_ID, encode_payload(lamp.status())))
        assert (status.brightness, status.strobe_period, status.invalid) == (30, 0.5, ())

    def test_its_checksum_has_the_seed_of_the_common_message(self):
        assert Lamp('extended').status().crc_extra == 66

    def test_any_profile_can_be_extended(self):
        assert len(encode_payload(Lamp('default', gimbal_device_id=1).status())) == 38


def test_a_mode_that_a_light_does_not_have_is_denied():
    lamp = Lamp('default', modes=(1,))
    assert lamp.result(CONFIGURE, 2, 50, 0, 0) == MavResult.DENIED
    assert lamp.status().mode_bitmask == 1


def test_every_light_answers_something():
    for profile in PROFILES:
        assert isinstance(Lamp(profile).command(0)[0], CommandAck)
