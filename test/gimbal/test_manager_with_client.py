# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""ROS as a player: a manager with a client in its own process."""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import Any

from illuminator_ros.geometry.mount_attitude import YawFrame
from illuminator_ros.geometry.rotation import Quaternion
from illuminator_ros.gimbal.axes import Range
from illuminator_ros.gimbal.commands import Attitude, Rates
from illuminator_ros.gimbal.events import AttitudeReceived
from illuminator_ros.gimbal.gimbal import Gimbal, GimbalSettings
from illuminator_ros.gimbal.manager import GimbalManager, ManagerSettings
from illuminator_ros.gimbal.manager_control import Role
from illuminator_ros.gimbal.manager_state import ManagerState
from illuminator_ros.gimbal.manager_with_client import ManagerWithClient
from illuminator_ros.gimbal.messages import GimbalDeviceSetAttitude, GimbalManagerStatus
from illuminator_ros.mavlink.command_sender import CommandSender
from illuminator_ros.mavlink.component import Component
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import CommandLong
from illuminator_ros.payload.device_events import DeviceConnected, DeviceDisconnected
from illuminator_ros.payload.messages import GeoPoint, GimbalDeviceAttitudeStatus
from illuminator_ros.payload.requests import Result
import pytest
from support.gimbal_manager import (
    AUTOPILOT,
    DEVICE,
    euler,
    GUEST,
    ManagerRig,
    of,
    OURS,
    PILOT,
    position,
)
from support.gimbals import setpoint


class Rig(ManagerRig):
    """A manager that is used by ROS, too."""

    def __init__(self, **settings: Any) -> None:
        self.results: list[Result] = []
        super().__init__(**settings)

    def make(
        self, commands: CommandSender, settings: ManagerSettings,
    ) -> tuple[GimbalManager, Component]:
        self.both = ManagerWithClient(commands, settings, GimbalSettings(attitude_interval=0.05))
        self.told: list[Any] = []
        self.both.client.events.subscribe(self.told.append)
        return self.both.manager, Component(commands, [self.both])

    @property
    def gimbal(self) -> Gimbal:
        [gimbal] = self.both.client.gimbals.values()
        return gimbal

    def ask(self, request: Callable[..., None], *arguments: Any) -> str:
        """Return '' if a request of ROS succeeds, otherwise the reason."""
        before = len(self.results)
        request(*arguments, self.now, lambda result, now: self.results.append(result))
        self.run(2.0, each=self.heartbeats(PILOT))
        [result] = self.results[before:]
        return '' if result.success else result.message


def test_ros_takes_control_sets_the_attitude_and_releases() -> None:
    rig = Rig()

    assert rig.ask(rig.gimbal.take_control) == ''
    assert rig.manager.control.holder(Role.PRIMARY) == OURS
    assert setpoint(rig.gimbal, Attitude(
        Quaternion.from_euler(0.0, 0.2, 0.3), YawFrame.VEHICLE), rig.now) == ''
    [message] = of(GimbalDeviceSetAttitude, rig.give(PILOT))
    # ROS: pitch down and yaw left are positive.
    assert euler(message) == (0.0, -0.2, -0.3)

    assert rig.ask(rig.gimbal.release_control) == ''
    assert rig.manager.control.holder(Role.PRIMARY) is None


def test_a_setpoint_of_another_player_reaches_the_device_once() -> None:
    rig = Rig()
    rig.take(PILOT)

    assert [euler(one) for one in rig.points(PILOT, 0.2)] == [(0.0, 0.2, 0.0)]


def test_ros_is_subject_to_the_policy() -> None:
    rig = Rig()
    rig.take(PILOT)

    assert 'DENIED' in rig.ask(rig.gimbal.take_control)
    assert rig.manager.control.holder(Role.PRIMARY) == PILOT


def test_ros_keeps_control_without_heartbeats_on_the_link_and_others_are_denied() -> None:
    rig = Rig()
    rig.ask(rig.gimbal.take_control)

    rig.run(30.0)

    assert rig.manager.control.holder(Role.PRIMARY) == OURS
    assert rig.take(GUEST) == mavlink.MAV_RESULT_DENIED


def test_ros_gets_the_attitude_of_the_device_and_a_region_of_interest() -> None:
    rig = Rig()
    assert len(of(DeviceConnected, rig.told)) == 1
    assert of(AttitudeReceived, rig.told)
    rig.ask(rig.gimbal.take_control)
    rig.give(AUTOPILOT, position(47.0, 8.0, 500.0))

    assert rig.ask(rig.gimbal.request, GeoPoint(47.001, 8.0, 500.0)) == ''

    assert math.isclose(euler(rig.messages(GimbalDeviceSetAttitude)[-1])[2], 0.0, abs_tol=1e-3)


def test_gm_22_ros_turns_a_device_without_mavlink_that_reports_no_attitude() -> None:
    rig = Rig(device_id=1, ranges=(Range(0.0, 0.0), Range(-1.0, 1.0), Range(-2.0, 2.0)))

    assert rig.ask(rig.gimbal.take_control) == ''
    setpoint(rig.gimbal, Attitude(
        Quaternion.from_euler(0.0, 0.2, 0.3), YawFrame.VEHICLE), rig.now)
    rig.run(1.0)

    attitude = of(AttitudeReceived, rig.told)[-1].attitude
    assert attitude is not None
    assert attitude.rotation.euler() == pytest.approx((0.0, 0.2, 0.3))
    assert rig.messages(GimbalDeviceSetAttitude) == []


def test_the_requests_of_the_client_to_the_device_are_sent_on_the_link() -> None:
    assert [(one.param1, one.param2) for one in Rig().messages(CommandLong)
            if one.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
            and one.target_component == DEVICE.component] == [
        (GimbalDeviceAttitudeStatus.id, 50_000)]


def test_the_client_loses_the_gimbal_with_the_line_of_its_device() -> None:
    rig = Rig()

    rig.component.components_lost([DEVICE], rig.now, 'cut')

    assert [one.reason for one in of(DeviceDisconnected, rig.told)] == ['cut']


def test_the_client_ends_its_requests_when_the_link_is_lost() -> None:
    rig = Rig()
    rig.gimbal.take_control(rig.now, lambda result, now: rig.results.append(result))

    rig.component.link_closed(rig.now, 'cut')

    [result] = rig.results
    assert (result.success, result.message) == (False, 'cut')


def test_a_setpoint_of_ros_that_may_have_waited_during_a_stop_of_the_process_is_not_sent() -> None:
    rig = Rig()
    rig.ask(rig.gimbal.take_control)

    rig.component.stalled(7.0, rig.now)

    assert 'may be 7.00 s old' in setpoint(rig.gimbal, Rates((0.0, 0.0, 0.2)), rig.now)
    rig.run(1.0)
    assert setpoint(rig.gimbal, Rates((0.0, 0.0, 0.2)), rig.now) == ''


def test_gm_18_another_manager_with_our_own_address_makes_ours_inactive() -> None:
    rig = Rig()

    rig.give(OURS, GimbalManagerStatus(0, 0, DEVICE.component, 0, 0, 0, 0))

    assert rig.manager.tracker.state is ManagerState.INACTIVE
    assert rig.manager.tracker.other == OURS


def test_setpoint_that_is_reported_as_the_attitude_is_not_measured() -> None:
    rig = Rig(device_id=1)
    is_measured = rig.both.client.is_measured

    assert not is_measured(rig.now)
    rig.manager.receive_attitude((Quaternion(), YawFrame.VEHICLE), rig.now)
    assert is_measured(rig.now)
    assert not is_measured(rig.now + 1.0)
    assert Rig().both.client.is_measured(0.0)
