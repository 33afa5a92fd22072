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

"""Lights that go and return, components that are none, and frames that harm nothing."""

from collections.abc import Iterator
import socket

from illuminator_ros.mavlink.messages import heartbeat
import pytest
from std_msgs.msg import Float64
from support.light import Address, ON_OFF, ServedLight
from support.processes import Program
from support.ros import Parameters, Ros, running_bridge
from support.slow import CLOCK, pass_time_until

AUTOPILOT = 2


@pytest.fixture
def bridge(own_ros: Ros, port: int) -> Iterator[Program]:
    """Run a bridge with a heartbeat_timeout of 10 s."""
    with running_bridge(own_ros.domain, port, heartbeat_timeout=10) as bridge:
        yield bridge


def test_lost_light_that_returns_is_served_with_one_line_each_way(
    own_ros: Ros, port: int, bridge: Program,
) -> None:
    light = ServedLight(port)
    with light:
        bridge.wait_for('light 1/243 connected')
        uptime = own_ros.subscribe(Float64, '/illuminator/uptime')
        uptime.wait()
    pass_time_until(lambda: bridge.count('light 1/243 lost: no heartbeat for 1'))
    with light:
        bridge.wait_for('light 1/243 connected', count=2)
        uptime.clear()
        uptime.wait(count=3)

        assert own_ros.enable().success
        assert Parameters(own_ros).set(brightness=31)[0].successful
    assert (bridge.count('lost'), bridge.count('connected')) == (1, 2)
    assert bridge.count('WARN') + bridge.count('ERROR') == 1


def test_light_that_was_lost_through_a_power_cycle_is_configured_again(
    own_ros: Ros, port: int, bridge: Program,
) -> None:
    light = ServedLight(port)
    with light:
        Parameters(own_ros).wait(brightness=100.0)
        assert Parameters(own_ros).set(brightness=31)[0].successful
    pass_time_until(lambda: bridge.count('lost'))
    light.fake.boot = CLOCK()
    light.fake.fields['brightness'] = 100.0
    with light:
        bridge.wait_for('light 1/243 has restarted')
        bridge.wait_for('light 1/243 configured')

        assert light.fake.fields['brightness'] == 31.0
        Parameters(own_ros).wait(brightness=31.0)


def test_request_to_a_light_that_is_lost_meanwhile_is_answered(
    own_ros: Ros, port: int, bridge: Program,
) -> None:
    with ServedLight(port) as light:
        bridge.wait_for('connected')
        light.fake.results[ON_OFF] = None
        call = own_ros.start_enable()
        light.wait_for(ON_OFF)

    pass_time_until(lambda: call.answered)

    assert not call.result().success
    assert call.result().message


def test_port_in_use_is_one_line_until_it_is_free(own_ros: Ros, port: int) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as occupant:
        occupant.bind(('127.0.0.1', port))
        with running_bridge(own_ros.domain, port, until='link not open') as bridge:
            assert not own_ros.enable().success
            occupant.close()
            bridge.wait_for('link open')

            assert bridge.count('link not open') == 1


def test_component_that_sends_only_statuses_is_a_light_and_an_autopilot_is_not(
    own_ros: Ros, port: int, bridge: Program,
) -> None:
    with ServedLight(port, source=Address(1, 2), heartbeat_type=None) as light:
        light.send(heartbeat(AUTOPILOT), Address(1, 1))
        bridge.wait_for('light 1/2 connected')

        assert own_ros.enable().success
    assert '1/1 ' not in bridge.log
