# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The bridge serves a winch beside a light: one process, one link, one address."""

from collections.abc import Mapping
import contextlib
from contextlib import AbstractContextManager
from pathlib import Path
import sys

from illuminator_ros.cli.bridge import Executable, usage
from payloads.winch import WINCH
import pytest

pytest.importorskip('rclpy')

from std_msgs.msg import Bool, Float32  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.processes import ended, Program  # noqa: E402
from support.ros import own_domain, Ros  # noqa: E402
from support.waiting import eventually  # noqa: E402
from support.winch_package import install_winch  # noqa: E402

PROGRAM = """
import sys
from illuminator_ros.cli import {name}
sys.exit({name}.main({options}))
"""


@pytest.fixture
def env(tmp_path: Path) -> Mapping[str, str]:
    """Return the environment in which the winch is an installed package."""
    return install_winch(tmp_path)


def program(
    name: str, *arguments: str, env: Mapping[str, str], domain: int, options: str = '',
) -> AbstractContextManager[Program]:
    code = PROGRAM.format(name=name, options=options)
    return ended(Program(
        sys.executable, '-c', code, *arguments, env={**env, 'ROS_DOMAIN_ID': str(domain)}))


def test_light_and_winch_are_served_by_one_bridge_and_one_simulator(
        env: Mapping[str, str]) -> None:
    port = free_port()
    with contextlib.ExitStack() as stack:
        domain = stack.enter_context(own_domain())
        stack.enter_context(program(
            'simulator', f'udpout://127.0.0.1:{port}', '--payload', 'illuminator,winch',
            env=env, domain=domain))
        bridge = stack.enter_context(program(
            'bridge', f'udpin://127.0.0.1:{port}', '--ros-args', '-p',
            'payloads:=[illuminator, winch]', env=env, domain=domain))
        ros = Ros(domain)
        stack.callback(ros.close)
        enabled = ros.subscribe(Bool, '/illuminator/enabled')
        length = ros.subscribe(Float32, '/winch/line_length')
        enabled.wait_value(False)
        # Retry: the clock of the machine may pause for longer than a confirmation takes.
        eventually(lambda: ros.enable(True).success)
        enabled.wait_value(True)
        publisher = ros.node.create_publisher(Float32, '/winch/cmd/release', 10)
        length.wait_value(0.0)

        def is_released() -> bool:
            # The first message may precede the discovery of the publisher.
            publisher.publish(Float32(data=2.5))
            return bool(length.values[-1] >= 2.5)

        eventually(is_released)
        eventually(lambda: bridge.count('confirmed by WINCH_STATUS: MAV_RESULT_ACCEPTED'))


def test_executable_of_one_payload_has_its_node_name_link_defaults_and_help(
        env: Mapping[str, str]) -> None:
    with own_domain() as domain:
        with program('bridge', '--help', env=env, domain=domain,
                     options="payload='winch'") as shown:
            assert shown.wait() == 0
        with (program('bridge', f'udpout://127.0.0.1:{free_port()}', '--ros-args', '--log-level',
                      'debug', env=env, domain=domain, options="payload='winch'") as winch,
              contextlib.closing(Ros(domain)) as ros):
            winch.wait_for('sent from 1/195: HEARTBEAT ')
            eventually(lambda: ('winch', '/') in ros.node.get_node_names_and_namespaces())

    lines = [' '.join(line.split()) for line in shown.lines]
    assert lines[0].startswith('usage: winch ')
    assert 'Runs the ROS 2 node /winch for a winch.' in lines
    assert [line for line in lines if line.startswith(('payloads', 'component_id'))] == [
        "payloads ['winch'] kinds of devices that the bridge serves",
        'component_id 195 our MAVLink component id (1 to 255)']


def test_the_help_of_a_payload_without_examples_has_no_gap(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sys, 'argv', ['/opt/ws/install/my_winch/lib/my_winch/winch'])
    text = usage(Executable('winch', {'winch': WINCH}))

    assert '  ros2 run my_winch winch serial:///dev/ttyACM0:57600\n' in text
    assert '\n\n\n' not in text
