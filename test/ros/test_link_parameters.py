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

"""The effect of the parameters of the link, and of use_sim_time."""

from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
import pytest
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Temperature
from support.light import Address, MavCmd, ServedLight
from support.ros import Parameters, Ros, running_bridge, STREAM
from support.slow import CLOCK

INTERVAL = MavCmd.SET_MESSAGE_INTERVAL


@pytest.mark.parametrize(('given', 'address'), [
    ({}, Address(1, 194)), ({'system_id': 7, 'component_id': 42}, Address(7, 42))])
def test_bridge_sends_from_its_address_and_leaves_the_status_interval_alone(
    own_ros: Ros, port: int, given: dict[str, Any], address: Address,
) -> None:
    with running_bridge(own_ros.domain, port, **given), ServedLight(port) as light:
        Parameters(own_ros).wait(brightness=100.0)
        light.wait_for(MavCmd.REQUEST_MESSAGE)

        assert light.fake.heard_from == {address}
        assert light.commands(INTERVAL) == []


def test_simulated_time_without_a_clock_affects_stamps_only(own_ros: Ros, port: int) -> None:
    with running_bridge(own_ros.domain, port, use_sim_time=True), ServedLight(port):
        Parameters(own_ros).wait(brightness=100.0)
        diagnostics = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
        temperature = own_ros.subscribe(Temperature, '/illuminator/temperature', STREAM)

        assert own_ros.enable().success
        assert Parameters(own_ros).set(brightness=20)[0].successful
        diagnostics.clear()
        CLOCK.forward(1.0)
        diagnostics.wait()
        assert temperature.wait().header.stamp.sec == 0

        clock = own_ros.node.create_publisher(Clock, '/clock', 10)
        message = Clock()
        message.clock.sec = 1234
        timer = own_ros.node.create_timer(0.05, lambda: clock.publish(message))
        temperature.wait(lambda message: message.header.stamp.sec == 1234)
        timer.cancel()
