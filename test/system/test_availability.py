# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The bridge serves whatever its output, its callers and its publishers do."""

from collections.abc import Iterator
import contextlib
import fcntl
import os
from pathlib import Path
import re
import signal
import subprocess
import sys

from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.link import Link
from illuminator_ros.ros.fast_dds import profile_variable
import pytest
from std_srvs.srv import SetBool
from support.fork_server import prepare_child
from support.light import ON_OFF, ServedLight
from support.processes import ended, environment, Program, python
from support.recording import Call
from support.ros import bridge_arguments, Parameters, Ros, running_bridge, STREAM
from support.slow import pass_time_until
from support.waiting import eventually, PATIENCE


@contextlib.contextmanager
def blocked_pipe() -> Iterator[int]:
    """Yield the write end of a full pipe that no program reads."""
    reading, writing = os.pipe()
    fcntl.fcntl(writing, fcntl.F_SETPIPE_SZ, 4096)
    os.write(writing, bytes(4096))
    try:
        yield writing
    finally:
        os.close(reading)
        os.close(writing)


@pytest.mark.parametrize('light_answers', [True, False])
def test_bridge_whose_output_is_blocked_serves_and_ends_with_its_lights_off(
    own_ros: Ros, port: int, light_answers: bool,
) -> None:
    # Both use the clock of the machine: the bridge compares uptimes with its own time.
    with blocked_pipe() as output, ServedLight(port, link=Link) as light:
        process = subprocess.Popen(
            [sys.executable, '-m', 'illuminator_ros.bridge',
             *bridge_arguments(port, '--log-level', 'debug', off_on_shutdown=True)],
            env=environment({'ROS_DOMAIN_ID': str(own_ros.domain)}), stdin=subprocess.DEVNULL,
            stdout=output, stderr=output, preexec_fn=prepare_child)
        try:
            Parameters(own_ros).wait(brightness=100.0)
            eventually(lambda: own_ros.enable().success)
            light.forget()
            assert Parameters(own_ros).set(brightness=200.0)[0].reason
            if not light_answers:
                light.fake.results[ON_OFF] = None

            process.send_signal(signal.SIGTERM)

            assert process.wait(PATIENCE) == 0
            light.wait_for(ON_OFF)
            eventually(lambda: light.fake.fields['enable'] == int(not light_answers))
        finally:
            process.kill()
            process.wait()


def test_all_of_fifty_calls_at_once_are_answered(own_ros: Ros, port: int) -> None:
    with running_bridge(own_ros.domain, port) as bridge, ServedLight(port) as light:
        bridge.wait_for('connected')
        # Each client receives the answers to all clients, and keeps ten of them by default.
        clients = [own_ros.node.create_client(
            SetBool, '/illuminator/enable', qos_profile=STREAM) for _ in range(50)]
        eventually(lambda: all(client.service_is_ready() for client in clients))
        own_ros.catch_up()
        light.fake.results[ON_OFF] = None

        calls = [Call(client.call_async(SetBool.Request(data=True))) for client in clients]
        light.wait_for(ON_OFF)
        # Calls beyond the limit are answered at once, the others when the light answers.
        eventually(lambda: any(call.answered for call in calls))
        assert 'requests are waiting' in next(
            call.result().message for call in calls if call.answered)
        light.fake.results[ON_OFF] = mavlink.MAV_RESULT_FAILED
        pass_time_until(lambda: all(call.answered for call in calls), step=0.1)
        assert all(call.result().message for call in calls)


@pytest.fixture
def bridge(own_ros: Ros, port: int) -> Iterator[Program]:
    """Yield a bridge with the package's profile of Fast DDS, not with the tests' profile."""
    with ended(python('illuminator_ros.bridge', *bridge_arguments(port), env={
            'ROS_DOMAIN_ID': str(own_ros.domain), profile_variable(): ''})) as bridge:
        bridge.wait_for('link open')
        yield bridge


def test_bridge_receives_through_no_port_in_shared_memory_and_its_profile_is_valid(
    bridge: Program,
) -> None:
    # Other processes may keep writing to the old port of a bridge that was killed and restarted.
    # Each reader of a port keeps the port's lock file open.
    opened = [os.readlink(link) for link in Path(f'/proc/{bridge.pid}/fd').iterdir()]
    assert not [name for name in opened if re.match('/dev/shm/fast.*_port.*_el', name)]
    assert 'PROFILES_FILE' not in bridge.log
