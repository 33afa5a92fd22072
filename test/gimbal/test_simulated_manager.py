# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The simulated gimbal with a manager of its own, and the profiles of PX4 and ArduPilot."""

from __future__ import annotations

import math
from typing import Any

from illuminator_ros.geometry.mount_attitude import YawFrame
from illuminator_ros.geometry.rotation import Quaternion
from illuminator_ros.gimbal import messages as gimbal
from illuminator_ros.gimbal.simulated_manager import PROFILES, SIMULATED
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.payload.messages import (
    GimbalDeviceAttitudeStatus,
    GlobalPositionInt,
)
import pytest
from support.bench import DeviceBench

NAN = math.nan
UNSET = (NAN, NAN, NAN)
PLAYER, OTHER = mav.Address(1, 195), mav.Address(255, 190)
ACCEPTED, DENIED, FAILED = (mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED,
                            mavlink.MAV_RESULT_FAILED)
CONFIGURE, PITCHYAW = (mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE,
                       mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW)
ROI, ROI_NONE = mavlink.MAV_CMD_DO_SET_ROI_LOCATION, mavlink.MAV_CMD_DO_SET_ROI_NONE
FOLLOW = mavlink.GIMBAL_DEVICE_FLAGS_ROLL_LOCK | mavlink.GIMBAL_DEVICE_FLAGS_PITCH_LOCK
LOCK = FOLLOW | mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
every_profile = pytest.mark.parametrize('profile', PROFILES)


class Bench(DeviceBench):
    """A simulated gimbal with a manager; angles in degrees."""

    peer = PLAYER

    def __init__(self, profile: str = 'reference', **settings: object) -> None:
        settings = {'profile': profile, **settings}
        self.address = SIMULATED.address(settings)
        super().__init__(SIMULATED.make(settings, self.address), 1000.0)
        self.take()

    def take(
        self, source: mav.Address = PLAYER, secondary: mav.Address = gimbal.NO_COMPONENT,
    ) -> int:
        return self.result(CONFIGURE, *source, *secondary, source=source)

    def point(
        self, *degrees: float, flags: int = FOLLOW, rates: tuple[float, float, float] = UNSET,
        source: mav.Address = PLAYER, device_id: int = 1,
    ) -> None:
        q = Quaternion.from_euler(*map(math.radians, degrees or UNSET))
        self.give(source, gimbal.GimbalManagerSetAttitude(
            *self.address, flags, device_id, q, *rates))

    def message(self, cls: Any) -> Any:
        return self.device.message(cls.id, self.now)

    @property
    def control(self) -> tuple[int, ...]:
        status = self.message(gimbal.GimbalManagerStatus)
        return (status.primary_control_sysid, status.primary_control_compid,
                status.secondary_control_sysid, status.secondary_control_compid)

    def angles(self, seconds: float = 5.0) -> tuple[float, ...]:
        """Let time pass, and return roll, pitch and yaw as they are reported."""
        self.now += seconds
        euler = Quaternion(*self.message(GimbalDeviceAttitudeStatus).q).euler()
        return tuple(round(math.degrees(angle), 3) + 0.0 for angle in euler)


# Control

@pytest.mark.parametrize(('profile', 'values', 'result', 'control'), [
    ('reference', (255, 190, 1, 195), ACCEPTED, (255, 190, 1, 195)),
    ('reference', (-1, -1, 255, 190), ACCEPTED, (1, 195, 255, 190)),
    ('reference', (-3, -3, -3, -3), ACCEPTED, (1, 195, 0, 0)),
    ('reference', (-2, -2, -1, -1), ACCEPTED, (255, 190, 0, 0)),
    ('reference', (0, 0, 0, 0), ACCEPTED, (0, 0, 0, 0)),
    *(('reference', (value, 190, 0, 0), DENIED, (1, 195, 0, 0))
      for value in (-4, 256, 0.5, NAN, math.inf)),
    ('px4', (255, 190, 1, 195), ACCEPTED, (255, 190, 0, 0)),
    ('px4', (-2, -2, -2, -2), ACCEPTED, (1, 1, 0, 0)),
    ('px4', (-4, 256, 0, 0), ACCEPTED, (1, 195, 0, 0)),
    ('ardupilot', (255, 190, 1, 195), ACCEPTED, (255, 190, 0, 0)),
    ('ardupilot', (-2, -2, -2, -2), ACCEPTED, (255, 190, 0, 0)),
    ('ardupilot', (-4, 256, 0, 0), FAILED, (1, 195, 0, 0))])
def test_configure_gives_control_as_the_status_shows(
        profile: str, values: tuple[float, ...], result: int, control: tuple[int, ...],
) -> None:
    bench = Bench(profile)
    assert bench.result(CONFIGURE, *values, source=OTHER) == result
    assert bench.control == control


def test_gm_9_secondary_control_adds_limited_angles() -> None:
    bench = Bench()
    bench.take(PLAYER, OTHER)
    bench.point(0.0, -30.0, 10.0)
    bench.point(0.0, -5.0, 90.0, source=OTHER)
    assert bench.angles() == (0.0, -35.0, 30.0)
    bench.point(0.0, -40.0, 0.0)
    assert bench.angles() == (0.0, -40.0, 0.0)
    # The next player in primary control has set no angles yet.
    bench.take(OTHER, PLAYER)
    bench.point(0.0, -5.0, 5.0)
    assert bench.angles() == (0.0, -5.0, 5.0)


# Setpoints

@pytest.mark.parametrize(('profile', 'flags', 'yaw'), [
    ('reference', FOLLOW | YawFrame.EARTH.flag, 30.0), ('reference', LOCK, 30.0),
    ('reference', FOLLOW, 30.0), ('px4', FOLLOW | YawFrame.EARTH.flag, 30.0),
    ('px4', LOCK, 30.0), ('ardupilot', LOCK, -10.0)])
def test_gm_2_the_flags_tell_the_frame_of_a_yaw(profile: str, flags: int, yaw: float) -> None:
    bench = Bench(profile, heading=40.0)
    bench.point(0.0, 0.0, 30.0, flags=flags)
    status = bench.message(GimbalDeviceAttitudeStatus)
    assert math.degrees(status.delta_yaw) == pytest.approx(40.0)
    assert bench.angles() == (0.0, 0.0, yaw)
    frame = bench.message(GimbalDeviceAttitudeStatus).flags & 96
    earth = profile == 'reference' and flags != FOLLOW or profile == 'px4' and flags == LOCK
    assert frame == (YawFrame.EARTH if earth else YawFrame.VEHICLE).flag


@every_profile
def test_gm_28_a_message_for_another_device_is_ignored_except_by_px4(profile: str) -> None:
    bench = Bench(profile)
    bench.point(0.0, -20.0, 0.0, device_id=2)
    ignored = profile != 'px4'
    assert bench.angles() == (0.0, 0.0 if ignored else -20.0, 0.0)
    assert (bench.result(PITCHYAW, -10, 0, NAN, NAN, 0, 0, 2) != ACCEPTED) is ignored
    assert (bench.result(CONFIGURE, 0, 0, 0, 0, 0, 0, 2) != ACCEPTED) is ignored
    bench.take()
    bench.point(0.0, -15.0, 0.0, device_id=0)
    assert bench.angles() == (0.0, -15.0, 0.0)


# Region of interest

@pytest.mark.parametrize(('place', 'frame', 'degrees'), [
    ((47.397742 + 0.001, 8.545594, 488.0), 0, (0.0, 0.0, 0.0)),
    ((47.397742, 8.545594 + 0.001, 488.0 - 75.494), 0, (0.0, -45.0, 90.0)),
    ((47.397742 - 0.001, 8.545594, -111.195), 3, (0.0, -45.0, 180.0))])
def test_gm_8_the_manager_computes_the_direction_of_a_place(
        place: tuple[float, float, float], frame: int, degrees: tuple[float, ...]) -> None:
    bench = Bench(heading=90.0)
    latitude, longitude, altitude = place
    assert bench.result(
        ROI, 1, 0, 0, 0, round(latitude * 1e7), round(longitude * 1e7), altitude,
        form=mav.CommandInt, frame=frame) == ACCEPTED
    assert bench.angles() == pytest.approx(degrees, abs=0.01)
    assert bench.result(ROI_NONE, 1) == ACCEPTED
    assert bench.angles() == (0.0, 0.0, 0.0)


def test_gm_8_it_keeps_pointing_at_the_place_while_the_vehicle_moves_until_the_next_setpoint(
        ) -> None:
    bench = Bench()
    bench.result(ROI, 0, 0, 0, 0, 47.398742, 8.545594, 488.0)
    moved = GlobalPositionInt(0, 473987420, 85455940 - 10000, 488000, 0, 0, 0, 0, 0)
    bench.give(mav.Address(2, 1), moved)
    assert bench.angles() == pytest.approx((0.0, 0.0, 0.0), abs=0.01)
    bench.give(mav.Address(1, 1), moved)
    assert bench.angles() == pytest.approx((0.0, 0.0, 90.0), abs=0.01)
    bench.point(0.0, -10.0, 0.0)
    bench.give(mav.Address(1, 1), moved)
    assert bench.angles() == (0.0, -10.0, 0.0)
