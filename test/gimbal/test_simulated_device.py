# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The simulated gimbal device follows the gimbal protocol v2: its manager, axes and frames."""

from __future__ import annotations

from collections.abc import Callable
import math

from illuminator_ros.geometry.mount_attitude import YawFrame
from illuminator_ros.geometry.rotation import Quaternion
from illuminator_ros.gimbal import messages as gimbal
from illuminator_ros.gimbal.axes import Range
from illuminator_ros.gimbal.simulated_device import MANAGER_TIMEOUT, SIMULATED
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.payload.messages import GimbalDeviceAttitudeStatus
import pytest
from support.bench import DeviceBench

NAN = math.nan
DEVICE, MANAGER, OTHER = Address(1, 154), Address(1, 191), Address(1, 190)
FOLLOW = mavlink.GIMBAL_DEVICE_FLAGS_ROLL_LOCK | mavlink.GIMBAL_DEVICE_FLAGS_PITCH_LOCK
LOCK = FOLLOW | mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
UNSET = (NAN, NAN, NAN)


class Bench(DeviceBench):
    """A simulated device with a manager; angles in degrees."""

    def __init__(self, *, announced: bool = True, **settings: object) -> None:
        super().__init__(SIMULATED.make(settings, DEVICE), 1000.0)
        self._announced = announced

    def announce(self, source: Address = MANAGER, device_id: int = 154) -> None:
        self.give(source, gimbal.GimbalManagerStatus(0, 0, device_id, 0, 0, 0, 0))

    def heading(self, degrees: float, source: Address = MANAGER) -> None:
        q = Quaternion.from_euler(0.0, 0.0, math.radians(degrees))
        self.give(source, gimbal.AutopilotStateForGimbalDevice(
            1, 154, 0, q, 0, NAN, NAN, NAN, 0, NAN, 0, 0, 1e-5))

    def point(
        self, *degrees: float, flags: int = FOLLOW | YawFrame.VEHICLE.flag,
        rates: tuple[float, float, float] = UNSET, source: Address = MANAGER,
        target: Address = DEVICE,
    ) -> None:
        if self._announced:
            self.announce()
        q = Quaternion.from_euler(*map(math.radians, degrees or UNSET))
        self.give(source, gimbal.GimbalDeviceSetAttitude(*target, flags, q, *rates))

    def after(self, seconds: float) -> GimbalDeviceAttitudeStatus:
        """Let time pass, and return the status."""
        self.now += seconds
        status = self.device.message(GimbalDeviceAttitudeStatus.id, self.now)
        assert isinstance(status, GimbalDeviceAttitudeStatus)
        return status

    def angles(self, seconds: float = 0.0) -> tuple[float, ...]:
        """Let time pass, and return roll, pitch and yaw as the status reports them, degrees."""
        euler = Quaternion(*self.after(seconds).q).euler()
        return tuple(round(math.degrees(angle), 3) + 0.0 for angle in euler)


# An action, the time after it, s, and the angles then, degrees.
Step = tuple[Callable[[Bench], object] | None, float, tuple[float, ...]]
VEHICLE = YawFrame.VEHICLE.flag


def to(*degrees: float, flags: int = FOLLOW | VEHICLE, rate: float = NAN,
       yaw_rate: float = NAN) -> Callable[[Bench], object]:
    """Return an action that points the gimbal, degrees, or turns pitch or yaw, deg/s."""
    rates = NAN, math.radians(rate), math.radians(yaw_rate)
    return lambda bench: bench.point(*degrees, flags=flags, rates=rates)


def pitch_vehicle(bench: Bench) -> None:
    q = Quaternion.from_euler(0.0, math.radians(20.0), 0.0)
    bench.give(MANAGER, gimbal.AutopilotStateForGimbalDevice(
        1, 154, 0, q, 0, NAN, NAN, NAN, 0, NAN, 0, 0))


MOTIONS: dict[str, tuple[dict[str, object], list[Step]]] = {
    'an attitude is approached at the rate of the axes, and kept': ({'axis_rate': 10.0}, [
        (to(0, -45, -30), 1, (0, -10, -10)), (None, 3, (0, -40, -30)), (None, 10, (0, -45, -30))]),
    'a rate turns until it is zero, an unset setpoint changes nothing': ({}, [
        (to(rate=-10), 1, (0, -10, 0)), (to(rate=0), 1, (0, -10, 0)), (to(), 5, (0, -10, 0))]),
    'a rate beside an angle limits the approach': ({}, [
        (to(0, -30, 5, rate=2), 5, (0, -10, 5))]),
    'a rate leaves the end of a range at once': ({}, [
        (to(rate=57), 10, (0, 45, 0)), (None, 10, (0, 45, 0)), (to(rate=-10), 1, (0, 35, 0))]),
    'a yaw that is driven against its stop stays there': ({}, [
        (to(yaw_rate=50), 3, (0, 0, 150)), (None, 4, (0, 0, 170)),
        *[(None, 1, (0, 0, 170))] * 7]),
    'an unset setpoint ends a motion': ({}, [
        (to(0, -45, 0), 0.5, (0, -30, 0)), (to(), 1, (0, -30, 0))]),
    'a yaw without a stop takes the shorter way': ({'yaw_range': Range(-math.pi, math.pi)}, [
        (to(0, 0, 170), 10, (0, 0, 170)), (to(0, 0, -170), 0.1, (0, 0, 176))]),
    'a locked pitch is held against the horizon': ({}, [
        (to(0, -10, 0), 1, (0, -10, 0)), (pitch_vehicle, 1, (0, -10, 0))]),
    'a pitch without a lock follows the vehicle': ({}, [
        (to(0, -10, 0, flags=mavlink.GIMBAL_DEVICE_FLAGS_ROLL_LOCK | VEHICLE), 1, (0, -10, 0)),
        (pitch_vehicle, 1, (0, 10, 0))]),
    'NEUTRAL takes precedence over the attitude': ({}, [
        (to(0, -20, 30), 2, (0, -20, 30)),
        (to(0, -20, 30, flags=mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL | VEHICLE), 2, (0, 0, 0))]),
    'NEUTRAL is relative to the vehicle, whatever the yaw frame': ({}, [
        (to(0, -20, 30), 2, (0, -20, 30)), (lambda bench: bench.heading(40.0), 0.1, (0, -20, 30)),
        (to(flags=mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL | YawFrame.EARTH.flag), 1, (0, 0, 0))]),
    'RETRACT takes precedence over NEUTRAL': ({}, [
        (to(flags=mavlink.GIMBAL_DEVICE_FLAGS_RETRACT | mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL
            | VEHICLE), 2, (0, 45, 0))]),
}


@pytest.mark.parametrize('case', MOTIONS)
def test_it_moves_as_its_setpoint_says(case: str) -> None:
    settings, steps = MOTIONS[case]
    bench = Bench(announced=True, **settings)
    for do, seconds, angles in steps:
        if do is not None:
            do(bench)
        _, before, _ = bench.angles()
        assert bench.angles(seconds) == angles
        assert bench.after(0.0).angular_velocity_y == pytest.approx(
            math.radians(angles[1] - before) / seconds)


@pytest.mark.parametrize(('degrees', 'reached', 'flag'), [
    ((0.0, 50.0, 0.0), (0.0, 45.0, 0.0), mavlink.GIMBAL_DEVICE_ERROR_FLAGS_AT_PITCH_LIMIT),
    ((60.0, 0.0, 0.0), (45.0, 0.0, 0.0), mavlink.GIMBAL_DEVICE_ERROR_FLAGS_AT_ROLL_LIMIT),
    ((0.0, 0.0, 175.0), (0.0, 0.0, 170.0), mavlink.GIMBAL_DEVICE_ERROR_FLAGS_AT_YAW_LIMIT)])
def test_an_axis_stops_at_the_end_of_its_range_and_reports_it(
        degrees: tuple[float, ...], reached: tuple[float, ...], flag: int) -> None:
    bench = Bench()
    bench.point(*degrees)
    assert bench.angles(4.0) == reached
    assert bench.after(0.1).failure_flags == flag
    bench.point(0.0, 0.0, 0.0)
    assert bench.after(4.0).failure_flags == 0


# Its manager

def test_gm_19_a_device_obeys_the_component_of_its_system_that_announces_it() -> None:
    bench = Bench(announced=False)
    assert bench.after(0.0).failure_flags == mavlink.GIMBAL_DEVICE_ERROR_FLAGS_NO_MANAGER
    bench.announce(device_id=155)
    bench.announce(Address(2, 191))
    bench.point(0.0, -10.0, 0.0)
    assert bench.angles(5.0) == (0.0, 0.0, 0.0)
    bench.announce()
    for stranger in (OTHER, Address(2, 191), Address(255, 190)):
        bench.point(0.0, -10.0, 0.0, source=stranger)
    assert bench.angles(1.0) == (0.0, 0.0, 0.0)
    bench.point(0.0, -10.0, 0.0)
    assert bench.angles(1.0) == (0.0, -10.0, 0.0)
    assert bench.after(0.0).failure_flags == 0


def test_gm_18_the_manager_stays_until_it_is_silent() -> None:
    bench = Bench(announced=False)
    bench.announce()
    bench.now += MANAGER_TIMEOUT - 0.1
    bench.announce(OTHER)
    assert bench.device.manager == MANAGER
    bench.now += 0.1
    bench.announce(OTHER)
    assert bench.device.manager == OTHER
    bench.announce()
    bench.point(0.0, -10.0, 0.0)
    assert bench.angles(1.0) == (0.0, 0.0, 0.0)


def test_a_manager_that_is_set_needs_no_announcement_and_cannot_be_replaced() -> None:
    bench = Bench(announced=False, manager_id=191)
    bench.now += 2 * MANAGER_TIMEOUT
    bench.announce(OTHER)
    for source, pitch in ((OTHER, 0.0), (MANAGER, -10.0)):
        bench.point(0.0, -10.0, 0.0, source=source)
        assert bench.angles(1.0) == (0.0, pitch, 0.0)


# Frames, heading and modes

def test_gm_3_without_a_heading_yaw_relative_to_north_is_not_accepted() -> None:
    bench = Bench()
    bench.point(0.0, 0.0, 30.0, flags=LOCK | YawFrame.EARTH.flag)
    status = bench.after(1.0)
    assert bench.angles() == (0.0, 0.0, 0.0)
    assert not status.flags & mavlink.GIMBAL_DEVICE_FLAGS_ACCEPTS_YAW_IN_EARTH_FRAME
    assert math.isnan(status.delta_yaw)


def test_gm_3_a_locked_yaw_follows_the_heading_and_drifts_without_one() -> None:
    bench = Bench(drift=0.5)
    bench.heading(40.0)
    bench.point(0.0, 0.0, 30.0, flags=LOCK | YawFrame.VEHICLE.flag)
    assert bench.angles(1.0) == (0.0, 0.0, 30.0)
    bench.heading(60.0)
    assert bench.angles(1.0) == (0.0, 0.0, 10.0)
    # Two seconds after the last heading it begins to drift.
    assert bench.angles(11.0) == (0.0, 0.0, 5.0)
    bench.heading(60.0)
    assert bench.angles(1.0) == (0.0, 0.0, 10.0)


@pytest.mark.parametrize('lock', [FOLLOW, LOCK])
def test_gm_2_the_frame_of_the_number_and_the_mode_of_the_axis_are_independent(
        lock: int) -> None:
    bench = Bench()
    bench.heading(40.0)
    bench.point(0.0, -20.0, 30.0, flags=lock | YawFrame.EARTH.flag)
    status = bench.after(1.0)
    assert (status.flags == lock | YawFrame.EARTH.flag
            | mavlink.GIMBAL_DEVICE_FLAGS_ACCEPTS_YAW_IN_EARTH_FRAME)
    assert bench.angles() == (0.0, -20.0, 30.0)
    assert math.degrees(status.delta_yaw) == pytest.approx(40.0)
    bench.heading(50.0)
    assert bench.angles(1.0) == (0.0, -20.0, 30.0 if lock == LOCK else 40.0)


def test_gm_5_an_axis_that_it_lacks_does_not_move_and_is_not_offered() -> None:
    lacks = SIMULATED.all_settings['lacks'].read('has_yaw_axis, HAS_YAW_LOCK')
    bench = Bench(lacks=lacks)
    bench.point(0.0, -20.0, 30.0)
    assert bench.angles(2.0) == (0.0, -20.0, 0.0)
    information = bench.device.message(gimbal.GimbalDeviceInformation.id, bench.now)
    assert isinstance(information, gimbal.GimbalDeviceInformation)
    assert not information.cap_flags & (mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_AXIS
                                        | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK)


@pytest.mark.parametrize(('name', 'text', 'reason'), [
    ('pitch_range', '-90', 'is not MIN,MAX'), ('yaw_range', '90,-90', 'minimum is above'),
    ('roll_range', '-200,0', 'outside'), ('lacks', 'has_wings', 'is not one of has_retract')])
def test_a_wrong_setting_is_refused_with_the_reason(name: str, text: str, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        SIMULATED.all_settings[name].read(text)
