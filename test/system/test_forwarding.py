# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Programs with MAVSDK use a device on a serial line beside ROS, through the bridge alone."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import json
from pathlib import Path
from typing import Any

from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address
import pytest
from std_msgs.msg import Bool
from support.mavsdk_peer import connected, DENIED, mavlink_direct, plugin, result
from support.ports import free_port
from support.processes import ended, python
from support.ros import own_domain, Ros
from support.waiting import eventually

GIMBAL = 1
FOLLOW, ONCE, PRIMARY = (
    plugin.GimbalMode.YAW_FOLLOW, plugin.SendMode.ONCE, plugin.ControlMode.PRIMARY)


def listed(player: plugin.Gimbal) -> tuple[int, int]:
    """Return the component ids of the only listed gimbal and of its manager."""
    [item] = eventually(lambda: player.gimbal_list().gimbals)
    return item.gimbal_device_id, item.gimbal_manager_component_id


@contextlib.contextmanager
def forwarding(domain: int, device: Path, port: int, *options: str) -> Iterator[None]:
    """Run the bridge of a device on a serial line, which forwards to UDP."""
    eventually(device.exists)
    arguments = (f'connection_url:=serial://{device}:57600',
                 f'forward_urls:=["udpin://127.0.0.1:{port}"]', *options)
    with ended(python('illuminator_ros.bridge', '--ros-args',
                      *(text for one in arguments for text in ('-p', one)),
                      env={'ROS_DOMAIN_ID': str(domain)})) as bridge:
        bridge.wait_for('link open')
        yield


def simulator(device: Path, payload: str) -> Any:
    """Run a simulated device on a serial line."""
    return ended(python('illuminator_ros.simulator', f'pty://{device}', '--payload', payload,
                        '--plain'))


@pytest.mark.timeout(120)
def test_two_programs_use_the_gimbal_on_a_serial_line_of_the_manager(tmp_path: Path) -> None:
    port, device = free_port(), tmp_path / 'gimbal'
    with (own_domain() as domain, simulator(device, 'gimbal'),
          forwarding(domain, device, port, 'payloads:=[gimbal_manager]', 'lease:=3.0'),
          connected(Address(1, 195), port) as one):
        first = plugin.Gimbal(one.get_systems()[0])
        with connected(Address(1, 196), port) as two:
            second = plugin.Gimbal(two.get_systems()[0])
            for player in (first, second):
                assert listed(player) == (154, 193)
            assert result(second.take_control, GIMBAL, PRIMARY) == 'SUCCESS'
            assert result(second.set_angles, GIMBAL, 0.0, -20.0, 10.0, FOLLOW, ONCE) == 'SUCCESS'
            # The first program hears the device itself.
            eventually(lambda: abs(
                first.get_attitude(GIMBAL).euler_angle_forward.pitch_deg + 20) < 1)
            assert result(first.take_control, GIMBAL, PRIMARY) == DENIED
        # The heartbeats of the second program have stopped, so its lease ends.
        eventually(lambda: result(first.take_control, GIMBAL, PRIMARY) == 'SUCCESS')


@pytest.mark.timeout(120)
def test_a_ground_station_and_ros_use_the_light_on_one_serial_line(tmp_path: Path) -> None:
    port, device = free_port(), tmp_path / 'light'
    with (own_domain() as domain, simulator(device, 'illuminator'),
          forwarding(domain, device, port), connected(Address(255, 190), port) as sdk,
          contextlib.closing(Ros(domain)) as ros):
        enabled = ros.subscribe(Bool, '/illuminator/enabled')
        light = mavlink_direct.MavlinkDirect(sdk.get_systems()[0])
        on = mavlink_direct.MavlinkMessage('COMMAND_LONG', 0, 0, 1, 243, json.dumps({
            'target_system': 1, 'target_component': 243, 'confirmation': 0,
            'command': mavlink.MAV_CMD_ILLUMINATOR_ON_OFF, 'param1': 1.0,
            **{f'param{number}': 0.0 for number in range(2, 8)}}))

        acknowledgement = json.loads(light.send_command(on).fields_json)

        assert acknowledgement['result'] == mavlink.MAV_RESULT_ACCEPTED
        enabled.wait_value(True)
        assert ros.enable(False).success
