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

"""A light that goes and comes back, and what a link carries besides (DESIGN.md, 3.4)."""

from collections.abc import Iterator
import random
import socket

from illuminator_ros.mavlink.messages import heartbeat
import pytest
from std_msgs.msg import Float64
from std_srvs.srv import SetBool
from support.light import Address, ServedLight
from support.processes import Program
from support.ros import Parameters, Ros, running_bridge
from support.slow import CLOCK, pass_time_until

AUTOPILOT = 2


@pytest.fixture
def bridge(own_ros: Ros, port: int) -> Iterator[Program]:
    """Run a bridge that waits for a light for 10 s."""
    with running_bridge(own_ros.domain, port, heartbeat_timeout=10) as bridge:
        yield bridge


def enable(ros: Ros) -> bool:
    response = ros.call(SetBool, '/illuminator/enable', SetBool.Request(data=True))
    return bool(response.success)


class TestOutage:
    def test_a_light_that_goes_and_comes_is_one_line_each_way(
        self, own_ros: Ros, port: int, bridge: Program,
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

            assert enable(own_ros)
            assert Parameters(own_ros).set(brightness=31)[0].successful
        assert (bridge.count('lost'), bridge.count('connected')) == (1, 2)
        assert bridge.count('WARN') + bridge.count('ERROR') == 1

    def test_a_power_cycle_is_told_and_the_light_configured(
        self, own_ros: Ros, port: int, bridge: Program,
    ) -> None:
        light = ServedLight(port)
        with light:
            assert Parameters(own_ros).wait(brightness=100.0) is None
            assert Parameters(own_ros).set(brightness=31)[0].successful
        pass_time_until(lambda: bridge.count('lost'))
        light.fake.boot = CLOCK()
        light.fake.fields['brightness'] = 100.0
        with light:
            bridge.wait_for('light 1/243 has restarted')
            bridge.wait_for('light 1/243 configured')

            assert light.fake.fields['brightness'] == 31.0
            Parameters(own_ros).wait(brightness=31.0)

    def test_an_outage_shorter_than_the_time_out_is_none(
        self, own_ros: Ros, port: int, bridge: Program,
    ) -> None:
        light = ServedLight(port)
        with light:
            bridge.wait_for('connected')
        CLOCK.forward(5.0)
        with light:
            uptime = own_ros.subscribe(Float64, '/illuminator/uptime')
            uptime.wait(count=3)

            assert enable(own_ros)
        assert (bridge.count('lost'), bridge.count('connected')) == (0, 1)

    def test_a_service_that_waits_for_a_light_that_goes_is_answered(
        self, own_ros: Ros, port: int, bridge: Program,
    ) -> None:
        with ServedLight(port) as light:
            bridge.wait_for('connected')
            light.fake.results[405] = None
            call = own_ros.start(SetBool, '/illuminator/enable', SetBool.Request(data=True))
            light.wait_for(405)

        pass_time_until(lambda: call.answered)
        response = call.result()

        assert not response.success
        assert response.message


class TestLink:
    def test_a_port_in_use_is_one_line_until_it_is_free(
        self, own_ros: Ros, port: int,
    ) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as occupant:
            occupant.bind(('127.0.0.1', port))
            with running_bridge(own_ros.domain, port, until='link not open') as bridge:
                # Several tries are made meanwhile; diagnostics come every second.
                assert not enable(own_ros)
                occupant.close()
                bridge.wait_for('link open')

                assert bridge.count('link not open') == 1

    def test_garbage_does_no_harm(self, own_ros: Ros, port: int, bridge: Program) -> None:
        noise = random.Random(1)
        with (ServedLight(port) as light,
              socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger):
            bridge.wait_for('connected')
            for size in range(1000):
                stranger.sendto(b'\xfd' + noise.randbytes(size % 300), ('127.0.0.1', port))

            assert enable(own_ros)
            assert light.fake.fields['enable'] == 1


class TestWhatIsALight:

    def test_one_that_sends_only_heartbeats(self, port: int, bridge: Program) -> None:
        light = ServedLight(port, stream=0.0)
        light.fake.pushes = False
        light.fake.answers.clear()
        with light:
            bridge.wait_for('light 1/243 connected')

    def test_one_that_sends_only_statuses(
        self, own_ros: Ros, port: int, bridge: Program,
    ) -> None:
        with ServedLight(port, source=Address(1, 1), heartbeat_type=None):
            bridge.wait_for('light 1/1 connected')

            assert enable(own_ros)

    def test_a_component_that_is_none_is_not_served(
        self, own_ros: Ros, port: int, bridge: Program,
    ) -> None:
        with ServedLight(port) as light:
            light.send(heartbeat(AUTOPILOT), Address(1, 1))
            bridge.wait_for('light 1/243 connected')

            assert enable(own_ros)
        assert '1/1 ' not in bridge.log

    def test_the_target_parameters_choose_one(self, own_ros: Ros, port: int) -> None:
        with (running_bridge(own_ros.domain, port, target_component=244) as bridge,
              ServedLight(port) as other, ServedLight(port, source=Address(1, 244)) as chosen):
            bridge.wait_for('light 1/244 connected')
            bridge.wait_for('light 1/243 connected')

            assert enable(own_ros)

            assert len(chosen.commands(405)) == 1
            assert other.commands(405) == []
