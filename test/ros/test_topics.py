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

"""What the node publishes of each status (DESIGN.md, 2)."""

import math

import pytest
from rclpy.qos import DurabilityPolicy, HistoryPolicy, ReliabilityPolicy
from std_msgs.msg import Bool, Float32, Float64, String, UInt32
from support.embedded import resting_bridge
from support.light import ServedLight
from support.recording import Recorder
from support.ros import Ros, running_bridge
from support.slow import pass_time_until

STATUS_TOPICS = {
    'enabled': Bool, 'brightness': Float32, 'mode': String, 'strobe_period': Float32,
    'strobe_duty_cycle': Float32, 'error_flags': UInt32, 'uptime': Float64,
}
STATE = (ReliabilityPolicy.RELIABLE, DurabilityPolicy.TRANSIENT_LOCAL, 1)
STREAM = (ReliabilityPolicy.RELIABLE, DurabilityPolicy.VOLATILE, 10)


QUALITIES = [
    ('/illuminator/connected', 'std_msgs/msg/Bool', STATE),
    ('/illuminator/enabled', 'std_msgs/msg/Bool', STATE),
    ('/illuminator/brightness', 'std_msgs/msg/Float32', STATE),
    ('/illuminator/mode', 'std_msgs/msg/String', STATE),
    ('/illuminator/strobe_period', 'std_msgs/msg/Float32', STATE),
    ('/illuminator/strobe_duty_cycle', 'std_msgs/msg/Float32', STATE),
    ('/illuminator/error_flags', 'std_msgs/msg/UInt32', STATE),
    ('/illuminator/uptime', 'std_msgs/msg/Float64', STATE),
    ('/illuminator/temperature', 'sensor_msgs/msg/Temperature', STREAM),
    ('/diagnostics', 'diagnostic_msgs/msg/DiagnosticArray', STREAM),
]


@pytest.mark.parametrize(('topic', 'type_', 'quality'), QUALITIES)
def test_type_and_quality_of_service(
    ros: Ros, light: ServedLight, topic: str, type_: str, quality: tuple[object, ...],
) -> None:
    ros.find_publisher(topic)
    [info] = ros.node.get_publishers_info_by_topic(topic)
    profile = info.qos_profile

    assert info.topic_type == type_
    assert (profile.reliability, profile.durability) == quality[:2]


def test_the_depths(domain: int) -> None:
    """Fast DDS does not tell them to others."""
    with resting_bridge(domain, lambda: 0.0) as process:
        published = {publisher.topic_name: publisher.qos_profile
                     for publisher in process.node.publishers}

    assert {topic: (published[topic].history, published[topic].depth)
            for topic, _, _ in QUALITIES} == {
        topic: (HistoryPolicy.KEEP_LAST, quality[2]) for topic, _, quality in QUALITIES}


@pytest.fixture(scope='module')
def uptimes(ros: Ros, shared_bridge: object) -> Recorder:
    """Return the topic that is published last of each status."""
    return ros.subscribe(Float64, '/illuminator/uptime')


@pytest.fixture
def quiet(light: ServedLight, uptimes: Recorder) -> ServedLight:
    """Return the light, which sends a status only when a test says so."""
    light.fake.stream = 0.0
    last = light.report(enable=0, brightness=100.0, mode=1, strobe_period=0.0,
                        strobe_duty_cycle=0.0, error_status=0)
    uptimes.wait(lambda message: message.data >= last)
    return light


@pytest.mark.parametrize(('topic', 'field', 'sent', 'published'), [
    ('enabled', 'enable', 1, True),
    ('brightness', 'brightness', 42.5, 42.5),
    ('mode', 'mode', 0, 'unknown'),
    ('mode', 'mode', 1, 'internal_control'),
    ('mode', 'mode', 2, 'external_sync'),
    ('mode', 'mode', 77, 'unknown'),
    ('strobe_period', 'strobe_period', 0.5, 0.5),
    ('strobe_duty_cycle', 'strobe_duty_cycle', 25.0, 25.0),
    ('error_flags', 'error_status', 5, 5),
    ('error_flags', 'error_status', 0x80000002, 0x80000002),
])
def test_a_status_is_published_as_sent(
    ros: Ros, quiet: ServedLight, topic: str, field: str, sent: float, published: object,
) -> None:
    recorder = ros.subscribe(STATUS_TOPICS[topic], f'/illuminator/{topic}')
    recorder.wait()
    recorder.clear()

    quiet.report(**{field: sent})

    assert recorder.wait().data == published


def test_the_uptime_is_in_seconds(ros: Ros, quiet: ServedLight) -> None:
    recorder = ros.subscribe(Float64, '/illuminator/uptime')
    recorder.wait()
    recorder.clear()
    before = quiet.do(quiet.fake.uptime_ms)

    quiet.report()

    assert before / 1000 <= recorder.wait().data <= quiet.do(quiet.fake.uptime_ms) / 1000


@pytest.mark.parametrize('topic', STATUS_TOPICS)
def test_a_late_subscriber_gets_the_last_value(
    ros: Ros, quiet: ServedLight, topic: str,
) -> None:
    recorder = ros.subscribe(STATUS_TOPICS[topic], f'/illuminator/{topic}')

    recorder.wait()

    assert len(recorder.messages) == 1


@pytest.mark.parametrize('topic', STATUS_TOPICS)
def test_each_status_is_published_once_changed_or_not(
    ros: Ros, quiet: ServedLight, topic: str,
) -> None:
    recorder = ros.subscribe(STATUS_TOPICS[topic], f'/illuminator/{topic}')
    recorder.wait()

    for count in range(2, 6):
        quiet.report()
        recorder.wait(count=count)

    assert len(recorder.messages) == 5


@pytest.mark.parametrize(('topic', 'field', 'sent'), [
    ('enabled', 'enable', 2),
    ('brightness', 'brightness', math.nan),
    ('brightness', 'brightness', math.inf),
    ('brightness', 'brightness', 200.0),
    ('brightness', 'brightness', -1.0),
    ('strobe_period', 'strobe_period', math.nan),
    ('strobe_period', 'strobe_period', -0.1),
    ('strobe_duty_cycle', 'strobe_duty_cycle', math.nan),
    ('strobe_duty_cycle', 'strobe_duty_cycle', 101.0),
])
def test_what_cannot_be_true_is_not_published_and_the_rest_is(
    ros: Ros, quiet: ServedLight, topic: str, field: str, sent: float,
) -> None:
    recorder = ros.subscribe(STATUS_TOPICS[topic], f'/illuminator/{topic}')
    uptime = ros.subscribe(Float64, '/illuminator/uptime')
    recorder.wait()
    uptime.wait()
    good = quiet.fake.fields[field]

    quiet.report(**{field: sent})
    uptime.wait(count=2)
    quiet.report(**{field: good})
    recorder.wait(count=2)

    assert recorder.values[0] == recorder.values[1] == pytest.approx(good)
    assert len(recorder.values) == 2


class TestConnected:

    def test_it_is_false_before_a_light_is_heard(self, own_ros: Ros, port: int) -> None:
        with running_bridge(own_ros.domain, port):
            recorder = own_ros.subscribe(Bool, '/illuminator/connected')

            assert recorder.wait().data is False

    def test_it_is_published_on_change_only(self, own_ros: Ros, port: int) -> None:
        with running_bridge(own_ros.domain, port):
            recorder = own_ros.subscribe(Bool, '/illuminator/connected')
            uptime = own_ros.subscribe(Float64, '/illuminator/uptime')
            recorder.wait()
            with ServedLight(port) as light:
                uptime.wait(count=3)
                light.fake.silent = True
                pass_time_until(lambda: recorder.values.count(False) == 2)
                light.fake.silent = False
                uptime.wait(count=6)

            assert recorder.values == [False, True, False, True]
