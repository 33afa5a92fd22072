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

"""With simulated time and no clock, everything but stamps goes on."""

from collections.abc import Iterator

from diagnostic_msgs.msg import DiagnosticArray
import pytest
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Temperature
from std_srvs.srv import SetBool
from support.light import ServedLight
from support.processes import Program
from support.ros import Parameters, Ros, running_bridge, STREAM
from support.slow import CLOCK


@pytest.fixture
def bridge(own_ros: Ros, port: int) -> Iterator[Program]:
    """Run a bridge that waits for a clock."""
    with running_bridge(own_ros.domain, port, use_sim_time=True) as bridge, ServedLight(port):
        bridge.wait_for('connected')
        yield bridge


def test_services_parameters_and_diagnostics_work_without_a_clock(
    own_ros: Ros, bridge: Program,
) -> None:
    diagnostics = own_ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)

    assert own_ros.call(SetBool, '/illuminator/enable', SetBool.Request(data=True)).success
    assert Parameters(own_ros).set(brightness=20)[0].successful
    diagnostics.clear()
    CLOCK.forward(1.0)
    diagnostics.wait()


def test_stamps_follow_the_clock_once_there_is_one(own_ros: Ros, bridge: Program) -> None:
    temperature = own_ros.subscribe(Temperature, '/illuminator/temperature', STREAM)
    assert temperature.wait().header.stamp.sec == 0
    clock = own_ros.node.create_publisher(Clock, '/clock', 10)
    message = Clock()
    message.clock.sec = 1234

    timer = own_ros.node.create_timer(0.05, lambda: clock.publish(message))

    temperature.wait(lambda message: message.header.stamp.sec == 1234)
    timer.cancel()
