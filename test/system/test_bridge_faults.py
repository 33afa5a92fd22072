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

"""A bridge under attack and under load: it answers, it says what is wrong, and it ends in time."""

from collections.abc import Iterator
import contextlib
import fcntl
import os
import signal
import subprocess
import sys
import time

import pytest
from rcl_interfaces.msg import LoggerLevel
from rcl_interfaces.srv import GetParameters, SetLoggerLevels
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Bool
from std_srvs.srv import SetBool, Trigger
from support.light import eventually, ON_OFF, ServedLight
from support.processes import ended, environment, Program, python
from support.recording import Call
from support.ros import bridge_arguments, Parameters, Ros, running_bridge, start_bridge

BRIDGE = 'illuminator_ros.bridge'
# s, real time: a signal ends the bridge within 1 s, and the tests share their processors.
END_LIMIT = 2.0
BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)


@contextlib.contextmanager
def blocked_bridge(ros: Ros, port: int, **parameters: object) -> Iterator[subprocess.Popen[bytes]]:
    """Run a bridge whose stderr is a full pipe that nothing reads."""
    reader, writer = os.pipe()
    fcntl.fcntl(writer, fcntl.F_SETPIPE_SZ, 4096)
    os.write(writer, bytes(4096))
    process = subprocess.Popen(
        [sys.executable, '-m', BRIDGE, *bridge_arguments(port, **parameters)], stderr=writer,
        env=environment({'ROS_DOMAIN_ID': str(ros.domain)}))
    os.close(writer)
    try:
        yield process
    finally:
        process.kill()
        process.wait()
        os.close(reader)


def test_bridge_serves_and_switches_off_while_nothing_reads_its_log(
    own_ros: Ros, port: int,
) -> None:
    with (ServedLight(port, enable=1) as light,
          blocked_bridge(own_ros, port, off_on_shutdown=True) as bridge):
        Parameters(own_ros).wait(brightness=100.0)
        assert own_ros.enable().success

        began = time.monotonic()
        bridge.send_signal(signal.SIGTERM)
        assert bridge.wait(END_LIMIT) == 0
        assert time.monotonic() - began < END_LIMIT

        eventually(lambda: light.fake.fields['enable'] == 0)


def test_shutdown_covers_lights_that_have_no_node_yet_and_names_each(
    own_ros: Ros, port: int,
) -> None:
    count = 30
    lights = [text for number in range(1, count + 1) for text in ('--light', f'1/{number}')]
    with (ended(start_bridge(own_ros.domain, port, off_on_shutdown=True)) as bridge,
          ended(python('illuminator_ros.simulator', f'udpout://127.0.0.1:{port}', *lights))):
        bridge.wait_for('light 1/1 connected')
        eventually(lambda: f'{count} of {count} on' in own_ros.call(
            SetBool, '/illuminator/enable_all', SetBool.Request(data=True)).message)

        assert bridge.end(signal.SIGTERM) == 0

        assert bridge.count('is off: off, confirmed') == count


def test_light_that_is_left_on_is_named(own_ros: Ros, port: int) -> None:
    with (running_bridge(own_ros.domain, port) as bridge,
          ServedLight(port, enable=1)):
        Parameters(own_ros).wait(brightness=100.0)
        bridge.end()
        assert bridge.count('[WARN]') == bridge.count('light 1/243 is left on') == 1


@pytest.fixture
def served(own_ros: Ros, port: int) -> Iterator[tuple[Program, ServedLight]]:
    """Run a bridge with a light."""
    with running_bridge(own_ros.domain, port) as bridge, ServedLight(port) as light:
        Parameters(own_ros).wait(brightness=100.0)
        yield bridge, light


@pytest.fixture
def in_real_time(own_ros: Ros, port: int) -> Iterator[Program]:
    """Run a bridge with a simulated light, both by the clock of the machine."""
    with (ended(start_bridge(own_ros.domain, port)) as bridge,
          ended(python('illuminator_ros.simulator', f'udpout://127.0.0.1:{port}'))):
        bridge.wait_for('light 1/243 connected')
        yield bridge


def test_fifty_requests_at_once_are_all_answered(own_ros: Ros, in_real_time: Program) -> None:
    clients = [own_ros.node.create_client(SetBool, '/illuminator/enable') for _ in range(50)]
    for client in clients:
        eventually(client.service_is_ready)
    assert own_ros.enable().success

    calls = [Call(client.call_async(SetBool.Request(data=True))) for client in clients]

    assert all(call.result().message for call in calls)


def test_refreshes_beyond_the_limit_are_refused_at_once(
    own_ros: Ros, in_real_time: Program,
) -> None:
    client = own_ros.node.create_client(
        Trigger, '/illuminator/refresh', qos_profile=QoSProfile(depth=500))
    eventually(client.service_is_ready)

    messages = [call.result().message for call in [
        Call(client.call_async(Trigger.Request())) for _ in range(100)]]

    assert 0 < sum('busy' in message for message in messages) < 100


@pytest.mark.parametrize(('type_', 'service', 'request_'), [
    (GetParameters, 'get_parameters', GetParameters.Request(names=['brightness'] * 200_000)),
    (SetLoggerLevels, 'set_logger_levels', SetLoggerLevels.Request(
        levels=[LoggerLevel(name=f'n{number}', level=10) for number in range(50_000)])),
])
def test_long_list_of_names_gets_an_empty_answer(
    own_ros: Ros, served: tuple[Program, ServedLight], type_: type, service: str,
    request_: object,
) -> None:
    answer = own_ros.call(type_, f'/illuminator/{service}', request_)

    assert not any(getattr(answer, field) for field in answer.get_fields_and_field_types())
    assert own_ros.enable().success


def test_best_effort_publisher_of_a_command_is_heard(
    own_ros: Ros, served: tuple[Program, ServedLight],
) -> None:
    publisher = own_ros.node.create_publisher(Bool, '/illuminator/cmd/enable', BEST_EFFORT)
    eventually(publisher.get_subscription_count)

    eventually(lambda: publisher.publish(Bool(data=True)) or served[1].commands(ON_OFF))

    served[0].wait_for('light 1/243 was switched on by topic')


def test_second_bridge_of_the_same_name_is_noticed(own_ros: Ros, port: int) -> None:
    with (running_bridge(own_ros.domain, port) as bridge,
          ended(start_bridge(own_ros.domain, port + 1))):
        bridge.wait_for('another node is called /illuminator')


@pytest.mark.parametrize(('arguments', 'line'), [
    (['-r', '~/enable:=/x', '-r', '~/refresh:=/x'], 'cannot create the node: '),
    (['-r', '~/enabled:=/x', '-r', '~/mode:=/x'], 'cannot create the node: '),
    (['-r', f'__node:={"a" * 230}'], 'node name and namespace have 231 characters together'),
    (['-p', 'payloads:=[kite]'], "parameter payloads: 'kite' is not one of illuminator"),
])
def test_wrong_start_is_refused_in_one_line(arguments: list[str], line: str) -> None:
    bridge = python(BRIDGE, '--ros-args', *arguments)

    assert bridge.wait() == 2
    assert [text.startswith(f'bridge: {line}') for text in bridge.lines] == [True]


def test_directory_for_log_files_that_cannot_be_written_is_named() -> None:
    bridge = python(BRIDGE, env={'ROS_LOG_DIR': '/proc/none'})

    assert bridge.wait() == 2
    assert 'log files cannot be written to /proc/none: ' in bridge.log


def test_too_few_descriptors_end_the_start_without_a_traceback() -> None:
    bridge = Program('sh', '-c', f'ulimit -n 20; exec {sys.executable} -m {BRIDGE}')

    assert bridge.wait() == 2
    assert 'bridge: cannot start: ' in bridge.log
    assert 'Traceback' not in bridge.log
