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

"""``~/temperature``: stamped, and silent where the light does not measure."""

import math

import pytest
from sensor_msgs.msg import Temperature
from std_msgs.msg import Float64
from support.light import ServedLight
from support.recording import Recorder
from support.ros import Ros, running_bridge, STREAM

THERMISTOR_FAILURE = 4


@pytest.fixture
def temperature(ros: Ros, light: ServedLight) -> Recorder:
    """Return the topic of a light that measures, and sends a status only when told."""
    recorder = ros.subscribe(Temperature, '/illuminator/temperature', STREAM)
    light.fake.stream = 0.0
    light.report(temp_c=26.5, error_status=0)
    # Nothing that was sent before comes behind it.
    recorder.wait(lambda message: message.temperature == 26.5)
    return recorder


def test_it_is_in_degrees_celsius_of_unknown_variance(
    light: ServedLight, temperature: Recorder,
) -> None:
    light.report(temp_c=41.5)

    message = temperature.wait(lambda message: message.temperature == 41.5)

    assert message.variance == 0.0


def test_it_is_stamped_at_reception(
    ros: Ros, light: ServedLight, temperature: Recorder,
) -> None:
    before = ros.node.get_clock().now().nanoseconds
    light.report(temp_c=42.5)

    stamp = temperature.wait(lambda message: message.temperature == 42.5).header.stamp

    after = ros.node.get_clock().now().nanoseconds
    assert before <= stamp.sec * 10**9 + stamp.nanosec <= after


def test_its_frame_is_that_of_the_parameter(own_ros: Ros, port: int) -> None:
    with running_bridge(own_ros.domain, port, frame_id='belly_light'), ServedLight(port):
        recorder = own_ros.subscribe(Temperature, '/illuminator/temperature', STREAM)

        assert recorder.wait().header.frame_id == 'belly_light'


def test_its_frame_is_illuminator_by_default(temperature: Recorder) -> None:
    assert temperature.messages[0].header.frame_id == 'illuminator'


@pytest.mark.parametrize('status', [
    {'temp_c': math.nan}, {'temp_c': math.inf}, {'temp_c': -300.0}, {'temp_c': 1e6},
    {'temp_c': 30.0, 'error_status': THERMISTOR_FAILURE},
])
def test_what_is_no_measurement_is_not_published(
    ros: Ros, light: ServedLight, temperature: Recorder, status: dict[str, float],
) -> None:
    uptime = ros.subscribe(Float64, '/illuminator/uptime')
    uptime.wait()
    temperature.clear()

    light.report(**status)
    uptime.wait(count=2)
    light.report(temp_c=31.0, error_status=0)

    assert temperature.wait().temperature == 31.0
    assert len(temperature.messages) == 1


def test_zero_is_a_temperature_where_the_light_measures(
    light: ServedLight, temperature: Recorder,
) -> None:
    light.report(temp_c=0.0)

    temperature.wait(lambda message: message.temperature == 0.0)


def test_zero_from_the_start_means_that_the_light_does_not_measure(
    own_ros: Ros, port: int,
) -> None:
    with (running_bridge(own_ros.domain, port) as bridge,
          ServedLight(port, stream=0.0, temp_c=0.0) as light):
        bridge.wait_for('connected')
        recorder = own_ros.subscribe(Temperature, '/illuminator/temperature', STREAM)
        uptime = own_ros.subscribe(Float64, '/illuminator/uptime')
        light.report()
        uptime.wait()

        light.report(temp_c=20.0)

        assert recorder.wait().temperature == 20.0
        assert len(recorder.messages) == 1
