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

"""What the parameters of the link do (DESIGN.md, 2)."""

from pathlib import Path
import re

from illuminator_ros.mavlink.signing import ticks
from illuminator_ros.mavlink.signing_files import TimestampStore
import pytest
from std_srvs.srv import SetBool
from support.embedded import resting_bridge
from support.light import Address, MavCmd, ON_OFF, params, ServedLight
from support.ros import Parameters, Ros, running_bridge
from support.slow import CLOCK, pass_time_until

INTERVAL = MavCmd.SET_MESSAGE_INTERVAL
STATUS = 440.0


def test_our_address_is_1_194_by_default(own_ros: Ros, port: int) -> None:
    with running_bridge(own_ros.domain, port), ServedLight(port) as light:
        light.wait_for(MavCmd.REQUEST_MESSAGE)

        assert light.fake.heard_from == {Address(1, 194)}


def test_our_address_is_what_system_id_and_component_id_say(own_ros: Ros, port: int) -> None:
    with (running_bridge(own_ros.domain, port, system_id=7, component_id=42),
          ServedLight(port) as light):
        light.wait_for(MavCmd.REQUEST_MESSAGE)

        assert light.fake.heard_from == {Address(7, 42)}


def test_status_interval_is_asked_for_in_microseconds(own_ros: Ros, port: int) -> None:
    with running_bridge(own_ros.domain, port, status_interval=0.05), ServedLight(port) as light:
        [command] = light.wait_for(INTERVAL)

        assert params(command)[:2] == (STATUS, 50_000.0)


def test_a_light_that_has_restarted_is_asked_again(own_ros: Ros, port: int) -> None:
    with (running_bridge(own_ros.domain, port, status_interval=0.05) as bridge,
          ServedLight(port) as light):
        Parameters(own_ros).wait(brightness=100.0)

        light.restart()

        bridge.wait_for('has restarted')
        light.wait_for(INTERVAL, 2)


def test_the_light_s_own_interval_is_left_alone_by_default(own_ros: Ros, port: int) -> None:
    with running_bridge(own_ros.domain, port), ServedLight(port) as light:
        Parameters(own_ros).wait(brightness=100.0)

        assert light.commands(INTERVAL) == []


@pytest.mark.parametrize(('retries', 'text'), [(0, '(1 try, '), (1, '(2 tries, ')])
def test_command_retries_and_command_timeout_bound_the_wait(
    own_ros: Ros, port: int, retries: int, text: str,
) -> None:
    with (running_bridge(own_ros.domain, port, command_retries=retries, command_timeout=0.1),
          ServedLight(port) as light):
        Parameters(own_ros).wait(brightness=100.0)
        light.fake.results[ON_OFF] = None
        call = own_ros.start(SetBool, '/illuminator/enable', SetBool.Request(data=True))
        for tries in range(1, retries + 2):
            light.wait_for(ON_OFF, tries)
            CLOCK.forward(0.1)

        response = call.result()

        assert not response.success
        assert text in response.message


def test_heartbeat_timeout_is_the_silence_after_which_a_light_is_lost(
    own_ros: Ros, port: int,
) -> None:
    with running_bridge(own_ros.domain, port, heartbeat_timeout=20) as bridge:
        with ServedLight(port):
            bridge.wait_for('connected')

        pass_time_until(lambda: bridge.count('lost'))

        [line] = [line for line in bridge.lines if 'light 1/243 lost' in line]
        match = re.search(r'no heartbeat for (\d+)(\.\d+)? s', line)
        assert match is not None
        assert int(match[1]) >= 20


def test_signing_goes_on_from_the_last_time_stamp_with_this_key(
    domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    key = tmp_path / 'key'
    key.write_text('correct horse')
    key.chmod(0o600)
    later = ticks(4e9)
    TimestampStore(str(key), 'bridge 1/194').store(later, last=True)

    with resting_bridge(
            domain, lambda: 0.0, signing_mode='sign', signing_key_file=str(key)) as process:
        assert process.link._signing.timestamp == later
