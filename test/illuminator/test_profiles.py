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

"""The profiles of simulated lights: differences from the protocol, as seen in the field."""

from typing import Any

from illuminator_ros.illuminator.messages import IlluminatorStatus, STATUS_ID
from illuminator_ros.illuminator.model import Status
from illuminator_ros.illuminator.simulated_properties import PROFILES
from illuminator_ros.illuminator.simulated_settings import properties
from illuminator_ros.mavlink.messages import (
    Address,
    CommandAck,
    decode_payload,
    encode_payload,
    Heartbeat,
    INFORMATION_ID,
    MavCmd,
    MavResult,
)
import pytest
from support.light_bench import LightBench

ON_OFF, CONFIGURE = MavCmd.ILLUMINATOR_ON_OFF, MavCmd.DO_ILLUMINATOR_CONFIGURE
NAN, INF = float('nan'), float('inf')
ACCEPTED, DENIED = MavResult.ACCEPTED, MavResult.DENIED


def light(profile: str, **settings: Any) -> LightBench:
    address = PROFILES[profile].properties.address
    return LightBench(properties=properties({**settings, 'profile': profile}, address))


@pytest.mark.parametrize(('profile', 'address', 'heartbeat'), [
    ('reference', (255, 0), (44, 8, 0)), ('ardusub', (1, 1), (12, 3, 4)),
    ('default', (1, 243), (44, 8, 4)), ('extended', (1, 243), (44, 8, 4))])
def test_each_profile_has_its_address_and_heartbeat_and_answers(
    profile: str, address: tuple[int, int], heartbeat: tuple[int, int, int],
) -> None:
    bench = light(profile)
    (beat,) = [one for one in bench.run(0.5) if isinstance(one, Heartbeat)]
    assert bench.component.address == Address(*address)
    assert (beat.type, beat.autopilot, beat.system_status) == heartbeat
    assert isinstance(bench.command(0)[0], CommandAck)


class TestReference:

    def test_a_change_is_acknowledged_to_0_0_then_applied_without_a_status(self) -> None:
        bench = light('reference')
        bench.run(0.5)
        (ack,) = bench.command(ON_OFF, 1)
        assert (ack.target_system, ack.target_component, bench.status().enable) == (0, 0, 0)
        assert not [one for one in bench.run(0.4) if isinstance(one, IlluminatorStatus)]
        assert bench.status().enable == 1

    def test_the_status_is_sent_at_1_hz_or_not_at_all(self) -> None:
        bench = light('reference')
        for interval, count in ((100_000, 3), (-1, 0), (5_000_000, 3)):
            assert bench.result(MavCmd.SET_MESSAGE_INTERVAL, STATUS_ID, interval) == ACCEPTED
            assert sum(isinstance(one, IlluminatorStatus) for one in bench.run(3.05)) == count

    def test_commands_to_other_addresses_are_obeyed_and_the_uptime_is_0(self) -> None:
        bench = light('reference')
        bench.run(5.0)
        assert bench.result(ON_OFF, 1, target=(7, 7)) == ACCEPTED
        assert bench.status().uptime_ms == 0

    @pytest.mark.parametrize(('params', 'result'), [
        ((1, NAN, 0, 0), ACCEPTED), ((1, 50, NAN, 0), ACCEPTED), ((1, 50, 0, NAN), ACCEPTED),
        ((NAN, 50, 0, 0), DENIED), ((1, INF, 0, 0), DENIED), ((1, 50, 11, 0), DENIED)])
    def test_nan_passes_the_range_checks(
        self, params: tuple[float, ...], result: MavResult,
    ) -> None:
        assert light('reference').result(CONFIGURE, *params) == result

    def test_a_brightness_of_nan_heats_like_full_power(self) -> None:
        bench = light('reference')
        bench.command(CONFIGURE, 1, NAN, 0, 0)
        bench.command(ON_OFF, 1)
        bench.run(10.0)
        assert bench.status().temp_c > 25.0

    def test_strings_that_are_too_long_have_no_terminator(self) -> None:
        _, information = light('reference').command(MavCmd.REQUEST_MESSAGE, INFORMATION_ID)
        raw = encode_payload(information)
        assert raw[80:104] == b'Illuminator Software Ver'
        assert raw[16:48].rstrip(b'\0') == b'Illuminator Vendor'


class TestArduSub:

    def test_unmeasured_values_are_0_and_the_bitmask_is_shifted(self) -> None:
        status = light('ardusub').status()
        assert (status.temp_c, status.min_strobe_period, status.max_strobe_period,
                status.mode_bitmask) == (0, 0, 0, 2)

    def test_a_brightness_of_0_is_off_and_on_restores_the_last_brightness(self) -> None:
        bench = light('ardusub')
        for command, state in (((CONFIGURE, 1, 40, 0, 0), (1, 40)), ((ON_OFF, 0), (0, 0)),
                               ((ON_OFF, 1), (1, 40)), ((CONFIGURE, 1, 0, 0, 0), (0, 0)),
                               ((ON_OFF, 1), (1, 40))):
            bench.command(*command)
            assert (bench.status().enable, bench.status().brightness) == state

    def test_a_strobe_and_a_request_for_the_identity_are_denied(self) -> None:
        bench = light('ardusub')
        assert bench.result(CONFIGURE, 1, 40, 1, 50) == DENIED
        assert bench.result(MavCmd.REQUEST_MESSAGE, INFORMATION_ID) == DENIED


class TestExtended:

    @pytest.mark.parametrize('profile', ['extended', 'default'])
    def test_three_bytes_follow_the_common_35_with_the_same_crc_extra(self, profile: str) -> None:
        status = light(profile, zoom_level=7, color_mode=2, gimbal_device_id=154).status()
        payload = encode_payload(status)
        assert (len(payload), payload[35:], status.crc_extra) == (38, bytes([7, 2, 154]), 66)

    def test_a_receiver_of_35_bytes_reads_the_status(self) -> None:
        bench = light('extended')
        bench.command(CONFIGURE, 2, 30, 0.5, 20)
        status = Status.from_message(
            decode_payload(IlluminatorStatus, encode_payload(bench.status())))
        assert (status.brightness, status.strobe_period, status.invalid) == (30, 0.5, ())


def test_a_mode_that_the_light_lacks_is_denied() -> None:
    bench = light('default', modes=(1,))
    assert bench.result(CONFIGURE, 2, 50, 0, 0) == DENIED
    assert bench.status().mode_bitmask == 1
