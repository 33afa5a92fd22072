# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A bridge under attack and under load: it answers, reports the cause, and ends in time."""

from collections.abc import Iterator
import re
import signal
import sys
import threading

from diagnostic_msgs.msg import DiagnosticArray
import pytest
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Bool, Float32
from std_srvs.srv import SetBool
from support import ros
from support.embedded import embedded_bridge
from support.light import eventually, free_port, ServedLight
from support.processes import ended, Program, python, start_interpreter
from support.slow import CLOCK, pass_time_until

BRIDGE = 'illuminator_ros.bridge'


def test_shutdown_covers_lights_that_have_no_node_yet_and_names_each(
    own_ros: ros.Ros, port: int,
) -> None:
    count = 8
    lights = [text for number in range(1, count + 1) for text in ('--light', f'1/{number}')]
    with (ros.running_bridge(own_ros.domain, port, off_on_shutdown=True) as bridge,
          ros.running_simulator(f'udpout://127.0.0.1:{port}', *lights)):
        bridge.wait_for('light 1/1 connected')
        eventually(lambda: f'{count} of {count} on' in own_ros.call(
            SetBool, '/illuminator/enable_all', SetBool.Request(data=True)).message)

        assert bridge.end(signal.SIGTERM) == 0

        assert bridge.count('is off: off, confirmed') == count


@pytest.fixture
def served(own_ros: ros.Ros, port: int) -> Iterator[tuple[Program, ServedLight]]:
    """Run a bridge with a light."""
    with ros.running_bridge(own_ros.domain, port) as bridge, ServedLight(port) as light:
        ros.Parameters(own_ros).wait(brightness=100.0)
        yield bridge, light


def test_second_bridge_of_the_same_name_is_logged_once_when_it_comes_and_when_it_goes(
    own_ros: ros.Ros, port: int,
) -> None:
    came, went = (f'{text}another node is called /illuminator' for text in (
        '[illuminator]: ', 'no longer: '))
    with ros.running_bridge(own_ros.domain, port) as bridge:
        with ended(ros.start_bridge(own_ros.domain, free_port())):
            pass_time_until(lambda: bridge.count(came), step=5.0)
            for _ in range(3):
                diagnostics = own_ros.subscribe(DiagnosticArray, '/diagnostics', ros.STREAM)
                CLOCK.forward(5.0)
                # Housekeeping checks the names in the turn in which it publishes diagnostics.
                diagnostics.wait(lambda array: str(port) in array.status[0].hardware_id)
        pass_time_until(lambda: bridge.count(went), step=5.0)

        assert (bridge.count(came), bridge.count(went)) == (1, 1)


@pytest.mark.parametrize('module', [BRIDGE, 'illuminator_ros.monitor'])
@pytest.mark.parametrize(('env', 'reason'), [
    ({'ROS_LOG_DIR': '/proc/none'}, 'to /proc/none: '),
    ({'HOME': '', 'ROS_HOME': '', 'ROS_LOG_DIR': ''}, 'to ~/.ros/log: HOME is not set')])
def test_directory_for_log_files_that_cannot_be_written_is_named(
    module: str, env: dict[str, str], reason: str,
) -> None:
    program = python(module, env=env)

    assert program.wait() == 2
    assert f'log files cannot be written {reason}' in program.log
    assert program.log.count('\n') == 1


@pytest.mark.parametrize('module', [BRIDGE, 'illuminator_ros.monitor'])
@pytest.mark.parametrize(('env', 'reason'), [
    ({'ROS_DOMAIN_ID': '500'}, "ROS_DOMAIN_ID: '500' is not a number from 0 to 232"),
    ({'ROS_DOMAIN_ID': 'robot1'}, "ROS_DOMAIN_ID: 'robot1' is not a number from 0 to 232"),
    ({'ROS_SECURITY_ENABLE': 'true', 'ROS_SECURITY_STRATEGY': 'Enforce'},
     "ROS_SECURITY_KEYSTORE: '' is not a folder, but ROS_SECURITY_ENABLE is true")])
def test_wrong_environment_of_ros_is_one_line_with_status_2(
    module: str, env: dict[str, str], reason: str,
) -> None:
    program = python(module, env=env)

    assert program.wait() == 2
    assert program.log.partition(': ')[2].rstrip() == reason


def test_reason_is_printed_if_ros_itself_ends_the_start() -> None:
    # The import of rclpy exits if this middleware is not installed.
    program = start_interpreter(BRIDGE, env={'RMW_IMPLEMENTATION': 'rmw_missing_cpp'})

    assert program.wait() != 0
    assert "'rmw_missing_cpp'" in program.log


def test_bridge_serves_while_standard_error_is_closed(own_ros: ros.Ros, port: int) -> None:
    with ended(Program(
            'sh', '-c', f'exec {sys.executable} -m {BRIDGE} "$@" 2>&-', 'sh',
            *ros.bridge_arguments(port), env={'ROS_DOMAIN_ID': str(own_ros.domain)})):
        assert 'no light connected' in own_ros.enable().message


@pytest.mark.parametrize(('name', 'descriptors'), [
    *(('bridge', number) for number in (8, 20)), ('monitor', 14)])
def test_too_few_descriptors_end_the_start_without_a_traceback(
    name: str, descriptors: int,
) -> None:
    program = Program(
        'sh', '-c', f'ulimit -n {descriptors}; exec {sys.executable} -m illuminator_ros.{name}')

    assert program.wait() == 2
    # Some errors of the middleware do not show that descriptors are lacking.
    assert len(re.findall(f'{name}: cannot (?:start|create the node): ', program.log)) == 1
    assert 'Traceback' not in program.log


def test_thread_that_cannot_be_started_is_tried_again(
    own_ros: ros.Ros, port: int, monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    start, refused = threading.Thread.start, list[str]()

    def start_later(thread: threading.Thread) -> None:
        if thread.name == 'mavlink-link' and refused.count(thread.name) < 2:
            refused.append(thread.name)
            raise RuntimeError("can't start new thread")
        start(thread)

    with ServedLight(port):
        monkeypatch.setattr(threading.Thread, 'start', start_later)
        with embedded_bridge(own_ros.domain, port):
            ros.Parameters(own_ros).wait(brightness=100.0)
    assert len(refused) == 2
    assert "can't start new thread for the link: too many threads" in capfd.readouterr().err


@pytest.mark.parametrize(('type_', 'reliability', 'reason'), [
    (Bool, ReliabilityPolicy.BEST_EFFORT, 'it publishes best effort'),
    (Float32, ReliabilityPolicy.RELIABLE, 'it publishes std_msgs/msg/Float32 instead of'),
])
def test_publisher_that_cannot_be_heard_is_logged_once(
    own_ros: ros.Ros, port: int, type_: type, reliability: ReliabilityPolicy, reason: str,
) -> None:
    own_ros.node.create_publisher(
        type_, '/illuminator/cmd/enable', QoSProfile(depth=1, reliability=reliability))
    own_ros.node.create_publisher(Bool, '/illuminator/cmd/enable_all', 1)
    text = f'/illuminator/cmd/enable: messages of /tester are not received: {reason}'
    with ros.running_bridge(own_ros.domain, port) as bridge:
        pass_time_until(lambda: bridge.count(text), step=5.0)
        for _ in range(2):
            diagnostics = own_ros.subscribe(DiagnosticArray, '/diagnostics', ros.STREAM)
            CLOCK.forward(5.0)
            diagnostics.wait(lambda array: True)

        assert bridge.count('are not received') == 1
