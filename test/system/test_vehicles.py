# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The commands of doc/vehicles.md, with simulated devices and MAVSDK as the ground station."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
from pathlib import Path
import re
import shlex
from typing import Any

from illuminator_ros.mavlink.messages import Address
import pytest
from std_srvs.srv import Trigger
from support.gimbal_vehicle import Autopilot
from support.live_link import EndpointLink
from support.mavsdk_peer import DENIED, player, plugin, result
from support.ports import free_port
from support.processes import ended, python, ROOT
from support.ros import Ros
from support.waiting import eventually

PAGE = (ROOT / 'doc' / 'vehicles.md').read_text()
STATION = 'udpout://192.168.1.20:14550'
GIMBAL = 1
pytestmark = pytest.mark.timeout(180)


def command(program: str, device: str, folder: Path, port: int) -> list[str]:
    """Return the arguments of a command, with devices in a folder and the ground station here."""
    text = re.sub(r'\\\n\s*', '', PAGE)
    [found] = re.findall(
        rf'^ros2 run illuminator_ros {program} (serial:///dev/{device}\S+.*?)(?:  #.*)?$', text,
        re.MULTILINE)
    return shlex.split(found.replace('serial:///dev/', f'serial://{folder}/').replace(
        STATION, f'udpout://127.0.0.1:{port}'))


@contextlib.contextmanager
def device(folder: Path, name: str, *arguments: str) -> Iterator[None]:
    """Run a simulated device on a serial line."""
    with ended(python('illuminator_ros.simulator', f'pty://{folder}/{name}', '--plain',
                      *arguments)):
        eventually((folder / name).exists)
        yield


def node(ros: Ros, program: str, arguments: list[str]) -> Any:
    """Run a node with the arguments of the page."""
    return ended(python(f'illuminator_ros.{program}', *arguments,
                        env={'ROS_DOMAIN_ID': str(ros.domain)}))


def ground_station(port: int) -> contextlib.AbstractContextManager[Any]:
    """Return the gimbals of a ground station that listens on a port, as QGroundControl does."""
    return player(Address(255, 190), port, 'udpin')


def call(ros: Ros, node: str, name: str) -> Trigger.Response:
    answer: Trigger.Response = ros.call(Trigger, f'/{node}/{name}', Trigger.Request())
    return answer


def points_down(gimbals: plugin.Gimbal, degrees: float) -> None:
    """Turn the gimbal by the ground station, and wait until the ground station sees it."""
    assert result(gimbals.set_angles, GIMBAL, 0.0, -degrees, 0.0, plugin.GimbalMode.YAW_FOLLOW,
                  plugin.SendMode.ONCE) == 'SUCCESS'
    eventually(lambda: abs(
        gimbals.get_attitude(GIMBAL).euler_angle_forward.pitch_deg + degrees) < 1)


def test_ground_station_and_ros_take_turns_at_the_gimbal_of_the_companion_computer(
        own_ros: Ros, tmp_path: Path) -> None:
    port = free_port()
    arguments = command('gimbal_manager', 'ttyUSB1', tmp_path, port)
    with (device(tmp_path, 'ttyUSB1', '--payload', 'gimbal'), contextlib.ExitStack() as stack):
        autopilot = EndpointLink(f'pty://{tmp_path}/ttyACM0', Autopilot())
        stack.callback(autopilot.stop)
        manager = stack.enter_context(node(own_ros, 'gimbal_manager', arguments))
        # The manager manages the gimbal before the client in its process has heard the device.
        manager.wait_for('gimbal 1/154 is managed')
        manager.wait_for('connected, manager')
        gimbals = stack.enter_context(ground_station(port))
        assert call(own_ros, 'gimbal_manager', 'take_control').success

        assert result(gimbals.take_control, GIMBAL, plugin.ControlMode.PRIMARY) == DENIED
        assert call(own_ros, 'gimbal_manager', 'release_control').success
        assert result(gimbals.take_control, GIMBAL, plugin.ControlMode.PRIMARY) == 'SUCCESS'
        points_down(gimbals, 20.0)
        assert not call(own_ros, 'gimbal_manager', 'take_control').success
        assert result(gimbals.release_control, GIMBAL) == 'SUCCESS'
        assert call(own_ros, 'gimbal_manager', 'take_control').success


def test_ground_station_and_ros_take_turns_at_the_gimbal_of_the_autopilot(
        own_ros: Ros, tmp_path: Path) -> None:
    port = free_port()
    arguments = command('gimbal', 'ttyACM0', tmp_path, port)
    with (device(tmp_path, 'ttyACM0', '--payload', 'gimbal_manager', '--component-id', '1'),
          node(own_ros, 'gimbal', arguments) as client):
        client.wait_for('connected, manager 1/1')
        with ground_station(port) as gimbals:
            assert result(gimbals.take_control, GIMBAL, plugin.ControlMode.PRIMARY) == 'SUCCESS'
            points_down(gimbals, 20.0)
            assert call(own_ros, 'gimbal', 'take_control').success
            eventually(lambda: gimbals.get_control_status(GIMBAL).compid_primary_control == 193)


@pytest.mark.parametrize(('program', 'name', 'options', 'text'), [
    ('bridge', 'ttyUSB0', '', 'light 1/243 connected'),
    ('bridge', 'ttyACM0', '', 'light 1/243 connected'),
    ('rededge', 'ttyUSB2', '--payload rededge', '/100 connected')])
def test_a_device_is_found_with_the_command_of_its_section(
        own_ros: Ros, tmp_path: Path, program: str, name: str, options: str, text: str) -> None:
    with (device(tmp_path, name, *options.split()),
          node(own_ros, program, command(program, name, tmp_path, free_port())) as served):
        served.wait_for(text)
