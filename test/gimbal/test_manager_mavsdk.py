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

"""MAVSDK's Gimbal plugin as player of our manager, with our simulated gimbal."""

from __future__ import annotations

from collections.abc import Callable
import math

from illuminator_ros.gimbal.manager_control import ControlSettings, Role
from illuminator_ros.gimbal.messages import GimbalCommand
from illuminator_ros.gimbal.simulated_device import SimulatedGimbal
from illuminator_ros.mavlink.messages import Address, MavResult
from illuminator_ros.payload.arbitration import Policy
import pytest
from support.gimbal_vehicle import HERE, managed_gimbal
from support.ports import free_port
from support.waiting import eventually

pytest.importorskip('mavsdk.mavsdk', reason='the wheel of mavsdk is not installed')

from support.mavsdk_player import player, plugin, result  # noqa: E402, I100

FIRST, SECOND = Address(1, 195), Address(1, 196)
GIMBAL = 1
# MAVSDK's name of MAV_RESULT_DENIED.
DENIED = 'ERROR'


def points_to(device: SimulatedGimbal, pitch: float, yaw: float) -> Callable[[], bool]:
    """Return whether the gimbal points somewhere, deg relative to the vehicle."""
    return lambda: all(
        abs(math.degrees(angle) - asked) < 0.5
        for angle, asked in zip(device.mount.motion.angles[1:], (pitch, yaw), strict=True))


def turns(device: SimulatedGimbal) -> Callable[[], bool]:
    """Return whether the gimbal has turned up by a degree since now."""
    before = device.mount.motion.angles[1]
    return lambda: device.mount.motion.angles[1] > before + math.radians(1)


@pytest.mark.timeout(180)
def test_mavsdk_lists_controls_and_releases_and_a_second_one_is_denied() -> None:
    port = free_port()
    with managed_gimbal(port) as (manager, device, vehicle), player(FIRST, port) as gimbal, \
            player(SECOND, port) as second:
        [item] = gimbal.gimbal_list().gimbals
        assert (item.gimbal_device_id, item.gimbal_manager_component_id) == (154, 194)
        assert item.model_name == 'simulator'
        follow, lock = plugin.GimbalMode.YAW_FOLLOW, plugin.GimbalMode.YAW_LOCK
        once, stream = plugin.SendMode.ONCE, plugin.SendMode.STREAM
        primary = plugin.ControlMode.PRIMARY
        assert result(gimbal.set_angles, GIMBAL, 0.0, -20.0, 0.0, follow, once) == DENIED
        assert result(gimbal.take_control, GIMBAL, primary) == 'SUCCESS'

        assert result(gimbal.set_angles, GIMBAL, 0.0, -20.0, 10.0, follow, once) == 'SUCCESS'
        eventually(points_to(device, -20.0, 10.0))
        assert result(gimbal.set_angles, GIMBAL, 0.0, -30.0, -15.0, follow, stream) == 'SUCCESS'
        eventually(points_to(device, -30.0, -15.0))
        # The vehicle heads east.
        assert result(gimbal.set_angles, GIMBAL, 0.0, -30.0, 80.0, lock, stream) == 'SUCCESS'
        eventually(points_to(device, -30.0, -10.0))
        for mode in (once, stream):
            assert result(gimbal.set_angular_rates, GIMBAL, 0.0, 10.0, 0.0, follow,
                          mode) == 'SUCCESS'
            eventually(turns(device))
        latitude, longitude, altitude = HERE
        assert result(gimbal.set_roi_location, GIMBAL, latitude, longitude + 0.01,
                      altitude) == 'SUCCESS'
        eventually(points_to(device, 0.0, 0.0))

        eventually(lambda: gimbal.get_control_status(GIMBAL).compid_primary_control
                   == FIRST.component)
        eventually(lambda: abs(gimbal.get_attitude(GIMBAL).euler_angle_north.yaw_deg - 90) < 1)
        assert result(second.take_control, GIMBAL, primary) == DENIED
        assert result(second.set_angles, GIMBAL, 0.0, -20.0, 0.0, follow, once) == DENIED
        answers = [ack.result for ack in vehicle.acks if ack.command in set(GimbalCommand)
                   and (ack.target_system, ack.target_component) == SECOND]
        assert answers[-2:] == [MavResult.DENIED] * 2
        assert manager.control.holder(Role.PRIMARY) == FIRST

        assert result(gimbal.release_control, GIMBAL) == 'SUCCESS'
        eventually(lambda: gimbal.get_control_status(GIMBAL).compid_primary_control == 0)
        assert result(second.take_control, GIMBAL, primary) == 'SUCCESS'


@pytest.mark.timeout(180)
@pytest.mark.parametrize('control', [
    ControlSettings(Policy.TAKEOVER), ControlSettings(overruling=frozenset({SECOND}))])
def test_a_second_mavsdk_wins_under_takeover_or_when_it_overrules(
        control: ControlSettings) -> None:
    port = free_port()
    with managed_gimbal(port, control) as (manager, _, _), player(FIRST, port) as first, \
            player(SECOND, port) as second:
        for gimbal in (first, second):
            assert result(gimbal.take_control, GIMBAL, plugin.ControlMode.PRIMARY) == 'SUCCESS'

        assert manager.control.holder(Role.PRIMARY) == SECOND
        assert result(first.set_angles, GIMBAL, 0.0, -20.0, 0.0, plugin.GimbalMode.YAW_FOLLOW,
                      plugin.SendMode.ONCE) == DENIED
