# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The topics that the node publishes from each ILLUMINATOR_STATUS."""

import math
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
import pytest
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Temperature
from std_msgs.msg import Bool, Float32, Float64, String, UInt32
from support.light import ServedLight
from support.recording import Recorder
from support.ros import Parameters, Ros, running_bridge, STREAM
from support.slow import CLOCK, pass_time_until
from support.waiting import eventually

STATUS_TOPICS = {
    'enabled': Bool, 'brightness': Float32, 'mode': String, 'strobe_period': Float32,
    'strobe_duty_cycle': Float32, 'error_flags': UInt32, 'uptime': Float64}

#: The statuses before each test, and what their topics show: two, so that the second is new.
STATUSES = [
    ({'enable': 1, 'brightness': 99.0, 'mode': 2, 'strobe_period': 9.0,
      'strobe_duty_cycle': 99.0, 'error_status': 99, 'temp_c': 99.0},
     {'enabled': True, 'brightness': 99.0, 'mode': 'external_sync', 'strobe_period': 9.0,
      'strobe_duty_cycle': 99.0, 'error_flags': 99, 'temperature': 99.0}),
    ({'enable': 0, 'brightness': 100.0, 'mode': 1, 'strobe_period': 0.0,
      'strobe_duty_cycle': 0.0, 'error_status': 0, 'temp_c': 25.0},
     {'enabled': False, 'brightness': 100.0, 'mode': 'internal_control', 'strobe_period': 0.0,
      'strobe_duty_cycle': 0.0, 'error_flags': 0, 'temperature': 25.0}),
]


def value_of(message: Any) -> object:
    """Return the one value of a message."""
    return message.temperature if isinstance(message, Temperature) else message.data


def wait_and_clear(recorder: Recorder, value: object) -> None:
    """Wait until a topic shows a value, then forget every message so far."""
    recorder.wait(lambda message: value_of(message) == pytest.approx(value))
    recorder.clear()


@pytest.fixture(scope='module')
def recorders(ros: Ros, shared_bridge: object) -> dict[str, Recorder]:
    """Return the topics of the module's bridge by their names."""
    found = {name: ros.subscribe(type_, f'/illuminator/{name}')
             for name, type_ in STATUS_TOPICS.items()}
    found['temperature'] = ros.subscribe(Temperature, '/illuminator/temperature', STREAM)
    return found


@pytest.fixture
def topics(
    ros: Ros, light: ServedLight, recorders: dict[str, Recorder],
) -> dict[str, Recorder]:
    """Return empty recorders of a light that sends a status only when a test says so."""
    light.fake.stream = 0.0
    ros.catch_up()
    for fields, shown in STATUSES:
        uptime = light.report(**fields)
        for topic, value in {**shown, 'uptime': uptime}.items():
            wait_and_clear(recorders[topic], value)
    return recorders


@pytest.mark.parametrize(('topic', 'field', 'sent', 'published'), [
    ('enabled', 'enable', 1, True),
    ('brightness', 'brightness', 42.5, 42.5),
    *(('mode', 'mode', mode, shown) for mode, shown in (
        (0, 'unknown'), (1, 'internal_control'), (2, 'external_sync'), (77, 'unknown'))),
    ('strobe_period', 'strobe_period', 0.5, 0.5),
    ('strobe_duty_cycle', 'strobe_duty_cycle', 25.0, 25.0),
    ('error_flags', 'error_status', 0x80000005, 0x80000005),
    ('uptime', 'temp_c', 20.0, None),
])
def test_each_status_is_published_once_as_sent_and_kept_for_late_subscribers(
    ros: Ros, light: ServedLight, topics: dict[str, Recorder], topic: str, field: str, sent: float,
    published: object,
) -> None:
    for count in (1, 2, 3):
        uptime = light.report(**{field: sent})
        topics[topic].wait(count=count)
    late = ros.subscribe(STATUS_TOPICS[topic], f'/illuminator/{topic}')
    expected = pytest.approx(uptime) if published is None else published
    assert late.wait().data == topics[topic].values[-1] == expected
    assert (len(topics[topic].messages), len(late.messages)) == (3, 1)


@pytest.mark.parametrize(('topic', 'field', 'values'), [
    ('enabled', 'enable', (2,)),
    ('brightness', 'brightness', (math.nan, math.inf, 200.0, -1.0)),
    ('strobe_period', 'strobe_period', (math.nan, -0.1)),
    ('strobe_duty_cycle', 'strobe_duty_cycle', (math.nan, 101.0)),
    ('temperature', 'temp_c', (math.nan, math.inf, -300.0, 1e6)),
])
def test_implausible_value_is_not_published_while_the_others_are(
    light: ServedLight, topics: dict[str, Recorder], topic: str, field: str,
    values: tuple[float, ...],
) -> None:
    good = light.fake.fields[field]

    for count, value in enumerate(values, 1):
        light.report(**{field: value})
        topics['uptime'].wait(count=count)
    light.report(**{field: good})
    last = topics[topic].wait()

    assert value_of(last) == good
    assert len(topics[topic].messages) == 1


def test_temperature_is_stamped_at_reception_in_the_default_frame(
    ros: Ros, light: ServedLight, topics: dict[str, Recorder],
) -> None:
    before = ros.node.get_clock().now().nanoseconds
    light.report(temp_c=41.5)
    message = topics['temperature'].wait()
    after = ros.node.get_clock().now().nanoseconds

    stamp = message.header.stamp
    assert before <= stamp.sec * 10**9 + stamp.nanosec <= after
    assert (message.temperature, message.variance, message.header.frame_id) == (
        41.5, 0.0, 'illuminator')


def test_connected_is_false_before_a_light_is_heard_and_published_on_change_only(
    own_ros: Ros, port: int,
) -> None:
    with running_bridge(own_ros.domain, port):
        recorder = own_ros.subscribe(Bool, '/illuminator/connected')
        uptime = own_ros.subscribe(Float64, '/illuminator/uptime')
        assert recorder.wait().data is False
        with ServedLight(port) as light:
            uptime.wait(count=3)
            light.fake.silent = True
            pass_time_until(lambda: recorder.values.count(False) == 2)
            light.fake.silent = False
            recorder.wait(lambda message: message.data, count=2)
            own_ros.synchronize()

        assert recorder.values == [False, True, False, True]


@pytest.mark.parametrize(('arguments', 'node'), [
    (('-r', '__ns:=/uav1', '-r', '__node:=spot'), '/uav1/spot'),
    (('-r', '~/connected:=/lamp/alive', '-r', '/diagnostics:=/uav1/diagnostics'),
     '/illuminator'),
])
def test_all_names_follow_namespace_node_name_and_remapping(
    own_ros: Ros, port: int, arguments: tuple[str, ...], node: str,
) -> None:
    def foreign() -> set[str]:
        graph: Any = own_ros.node
        return {name for name, _ in [*graph.get_topic_names_and_types(),
                                     *graph.get_service_names_and_types()]
                if not name.startswith((f'{node}/', '/tester/'))}

    remapped = {rule.rpartition(':=')[2] for rule in arguments if rule[:2] in ('~/', '/d')}
    diagnostics = next(iter(name for name in remapped if 'diag' in name), '/diagnostics')
    with running_bridge(own_ros.domain, port, *arguments), ServedLight(port):
        Parameters(own_ros, node).wait(mode='internal_control')
        assert own_ros.enable(node=node).success
        recorder = own_ros.subscribe(DiagnosticArray, diagnostics, STREAM)
        CLOCK.forward(1.0)
        array = recorder.wait(lambda array: len(array.status) == 2)

        eventually(lambda: set(remapped) <= foreign())
        name = node.removeprefix('/')
        assert [status.name for status in array.status] == [f'{name}: link', f'{name}: lamp']
        assert foreign() == {'/parameter_events', '/rosout', diagnostics, *remapped}


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
