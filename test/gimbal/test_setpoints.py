# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Setpoints of a gimbal: attitudes, angles and rates, and when they stop."""

from __future__ import annotations

from collections.abc import Callable
import math

from illuminator_ros.geometry.mount_attitude import from_mavlink, STILL, to_mavlink, YawFrame
from illuminator_ros.geometry.rotation import Quaternion, Vector
from illuminator_ros.gimbal.commands import Attitude, Rates
from illuminator_ros.gimbal.events import ControlChanged, GimbalKey, RateStopped
from illuminator_ros.gimbal.gimbal import GimbalSettings
from illuminator_ros.gimbal.messages import DEVICE_ID_PARAM, GimbalManagerSetAttitude, rates_of
from illuminator_ros.gimbal.setpoint_stream import REPEATS
from illuminator_ros.mavlink.dialect import mavlink, replaced
from illuminator_ros.mavlink.messages import Address, CommandLong
import pytest
from pytest import approx
from support.gimbals import (
    ALL,
    DEVICE,
    FakeManager,
    in_control,
    NAN,
    OTHER,
    OURS,
    PLACE,
    Rig,
)

EARTH, VEHICLE = YawFrame.EARTH, YawFrame.VEHICLE
LEVEL = mavlink.GIMBAL_DEVICE_FLAGS_ROLL_LOCK | mavlink.GIMBAL_DEVICE_FLAGS_PITCH_LOCK
# 45 degrees down and 30 to the left, in ROS and in MAVLink.
DOWN_LEFT = (0.0, math.radians(45), math.radians(30))
# Rates of a device, in MAVLink.
STANDING, TURNING = (0.0, 0.0, 0.0), (0.0, 0.0, -0.2)
NOBODY = Address(0, 0)


def setpoints(rig: Rig) -> list[tuple[float, GimbalManagerSetAttitude]]:
    return [(at, one) for at, one in rig.sent if isinstance(one, GimbalManagerSetAttitude)]


def euler(message: GimbalManagerSetAttitude) -> Vector:
    """Return roll, pitch and yaw of a setpoint in MAVLink, deg."""
    roll, pitch, yaw = map(math.degrees, Quaternion(*message.q).euler())
    return roll, pitch, yaw


def test_gm_2_gm_4_attitude_is_sent_in_the_frame_and_the_signs_of_mavlink() -> None:
    rig = in_control()

    assert rig.send(Attitude(Quaternion.from_euler(*DOWN_LEFT), VEHICLE)) == ''
    assert rig.send(Attitude(Quaternion.from_euler(*DOWN_LEFT), EARTH)) == ''
    rig.run(0.1)

    (_, relative), (_, absolute) = setpoints(rig)
    assert euler(relative) == approx((0, -45, -30))
    # A yaw of 30 degrees from east to the left is 60 degrees from north to the right.
    assert euler(absolute) == approx((0, -45, 60))
    assert relative.flags == LEVEL | mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
    # PX4 and ArduPilot read the lock as the frame.
    assert (absolute.flags == LEVEL | mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME
            | mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK)
    assert (relative.target_system, relative.target_component, relative.gimbal_device_id) == (
        1, 1, 154)
    assert all(map(math.isnan, rates_of(relative)))


def test_attitude_is_sent_again_a_few_times_unless_another_replaces_it() -> None:
    rig = in_control()
    rig.send(Attitude(Quaternion(), VEHICLE))
    start = rig.now
    rig.run(5.0)

    assert [at - start for at, _ in setpoints(rig)] == approx([0.0, *REPEATS], abs=0.03)
    for rotation in (Quaternion.from_euler(0.0, 0.2, 0.0), Quaternion.from_euler(*DOWN_LEFT)):
        rig.send(Attitude(rotation, VEHICLE))
    rig.run(5.0)
    assert [one.q[3] == 0.0 for _, one in setpoints(rig)[1 + len(REPEATS):]] == [
        True, *[False] * (1 + len(REPEATS))]


def hold_button(rig: Rig, press: Callable[[], object], seconds: float = 5.0) -> int:
    """Repeat a message at 50 Hz; return how many setpoints and places reach the manager."""
    manager = rig.managers[0]
    places = mavlink.MAV_CMD_DO_SET_ROI_LOCATION
    manager.received.clear()
    manager.commands.clear()
    for _ in range(round(seconds * 50)):
        press()
        rig.run(0.02)
    return len(manager.received) + sum(one.command == places for one in manager.commands)


@pytest.mark.parametrize(('rates', 'least', 'most'), [(STANDING, 5, 25), (TURNING, 250, 300)])
def test_equal_angles_that_a_gimbal_does_not_show_are_sent_once_a_second_or_while_it_moves(
        rates: Vector, least: int, most: int) -> None:
    rig = in_control()
    rig.managers[0].rates = rates

    def press() -> None:
        rig.send_angles(DOWN_LEFT, VEHICLE)

    hold_button(rig, press)

    assert least <= hold_button(rig, press) <= most


def test_equal_rates_are_always_sent_and_equal_places_once_a_second() -> None:
    rig = in_control()

    assert hold_button(rig, lambda: turn(rig)) == 250
    rig.managers[0].rates = STANDING
    rig.send(Rates(STILL))
    rig.run(3.0)
    assert hold_button(rig, lambda: rig.gimbal.request(
        PLACE, rig.now, rig.done, is_call=False)) == 5


def test_rate_is_a_message_in_rad_per_s_and_ends_with_a_zero() -> None:
    rig = in_control(setpoint_timeout=0.5)
    rig.managers[0].rates = STANDING
    start = rig.now
    for _ in range(3):
        assert rig.send(Rates((0.0, 0.2, -0.1))) == ''
        rig.run(0.3)
    rig.run(5.0)

    sent = setpoints(rig)
    assert [at - start for at, _ in sent[:4]] == approx([0.0, 0.3, 0.6, 1.1], abs=0.03)
    assert [rates_of(one) for _, one in sent[:4]] == [(0.0, -0.2, 0.1)] * 3 + [STILL]
    assert all(map(math.isnan, setpoints(rig)[0][1].q))


@pytest.mark.parametrize(('timeout', 'zero_at'), [(0.3, 1.3), (60.0, 5.0)])
def test_a_rate_that_lasts_ends_after_a_shorter_timeout_and_never_later_than_it_would(
        timeout: float, zero_at: float) -> None:
    rig = in_control(setpoint_timeout=5.0)
    start = rig.now
    rig.send(Rates((0.0, 0.2, 0.0)))
    rig.run(1.0)

    rig.client.change_settings(GimbalSettings(setpoint_timeout=timeout), rig.now)
    rig.run(10.0)

    assert [at - start for at, _ in setpoints(rig)[:2]] == approx([0.0, zero_at], abs=0.03)


def turn(rig: Rig) -> None:
    assert rig.send(Rates((0.0, 0.0, 0.2))) == ''


def send_attitude(rig: Rig, lock: bool = False) -> None:
    rig.send(Attitude(Quaternion(), EARTH if lock else VEHICLE))


@pytest.mark.parametrize('rates', [STANDING, (NAN, 0.0, 0.001), (NAN, NAN, NAN)])
def test_a_zero_is_not_sent_again_once_attitudes_show_that_the_gimbal_stands(
        rates: Vector) -> None:
    rig = in_control()
    rig.managers[0].rates = rates
    start = rig.now
    rig.send(Rates(STILL))
    rig.run(10.0)

    # Without rates two attitudes are compared, of five in a second.
    assert setpoints(rig)[-1][0] - start < 0.5


def test_a_zero_that_is_lost_is_sent_slower_with_time_and_not_after_it_has_arrived() -> None:
    rig = in_control()
    manager = rig.managers[0]
    turn(rig)
    rig.run(0.1)
    manager.rates, manager.hears = TURNING, False
    rig.run(200.0)
    assert 200 <= len(setpoints(rig)) < 215
    manager.hears = True
    rig.run(1.1)
    manager.rates = STANDING
    rig.run(3.0)
    after = len(setpoints(rig))
    rig.run(10.0)

    assert manager.received[-1].angular_velocity_z == 0.0
    assert len(setpoints(rig)) == after


@pytest.mark.parametrize(('rates', 'turns'), [(TURNING, True), (None, None)])
def test_a_gimbal_that_turns_a_second_after_its_rate_is_reported_and_when_it_stands(
        rates: Vector | None, turns: bool | None) -> None:
    rig = in_control()
    manager = rig.managers[0]
    manager.rates, manager.device_reports = rates or TURNING, rates is not None
    turn(rig)
    rig.run(1.4)
    assert rig.all_of(RateStopped) == []
    rig.run(10.0)
    unstopped = rig.gimbal.snapshot(rig.now)
    manager.rates, manager.device_reports = STANDING, True
    rig.run(3.0)

    key = GimbalKey(DEVICE)
    assert rig.all_of(RateStopped) == [
        RateStopped(key, False, turns), RateStopped(key, True, False)]
    assert unstopped.unstopped_since == approx(rig.now - 13.9, abs=0.03)
    assert unstopped.turns is turns
    assert rig.gimbal.snapshot(rig.now).unstopped_since is None


def test_no_report_is_made_of_a_gimbal_that_stands_soon_or_turns_to_an_attitude() -> None:
    rig = in_control()
    rig.managers[0].rates = TURNING
    turn(rig)
    send_attitude(rig)
    rig.run(5.0)
    rig.managers[0].rates = STANDING
    turn(rig)
    rig.run(5.0)

    assert rig.all_of(RateStopped) == []


def test_a_late_attitude_is_ignored_unless_the_device_has_restarted() -> None:
    rig = in_control()

    def pitch_after(milliseconds: int, pitch: float) -> float:
        status = replaced(rig.managers[0].attitude(), time_boot_ms=milliseconds,
                          q=Quaternion.from_euler(0.0, pitch, 0.0))
        rig.receive(rig.managers[0].device, status)
        attitude = rig.gimbal.snapshot(rig.now).attitude
        assert attitude is not None
        return attitude.rotation.euler()[1]

    assert pitch_after(90_000, -0.3) == approx(0.3)
    assert pitch_after(89_100, -0.2) == approx(0.3)
    assert pitch_after(90_000, -0.4) == approx(0.4)
    assert pitch_after(100, -0.5) == approx(0.5)


@pytest.mark.parametrize(('primary', 'may_turn'), [(OTHER, True), (NOBODY, True), (OTHER, False)])
def test_a_loss_of_control_tells_whether_the_gimbal_may_turn_at_our_rate(
        primary: Address, may_turn: bool) -> None:
    rig = in_control()
    if may_turn:
        turn(rig)
    rig.managers[0].primary = primary
    rig.run(1.0)

    lost = rig.all_of(ControlChanged)[-1]
    assert (lost.was_lost, lost.may_turn) == (True, may_turn)


@pytest.mark.parametrize('names_frame', [True, False])
@pytest.mark.parametrize('lost', [0, 1, 3, 10, 14])
def test_zero_that_is_lost_is_sent_again_to_a_device_that_reports_no_rates(
        lost: int, names_frame: bool) -> None:
    rig = in_control()
    manager = rig.managers[0]
    if not names_frame:
        manager.flags = 0
    turn(rig)
    yaw = 0.0
    for _ in range(500):
        zeros = [one for _, one in setpoints(rig) if one.angular_velocity_z == 0.0]
        if len(zeros) <= lost:
            yaw -= 0.2 * 0.02
            manager.q = Quaternion.from_euler(0.0, 0.0, yaw)
        # Each status comes twice.
        for _ in range(2):
            rig.receive(manager.device, manager.attitude())
        rig.run(0.02)

    assert lost < len(zeros) <= lost + 6


@pytest.mark.parametrize('is_end', [False, True])
@pytest.mark.parametrize(('lost', 'turning', 'most'), [
    (0, 0.2, 0.35), (1, 0.2, 0.45), (99, NAN, 0.5), (20, 0.2, 12.0)])
def test_control_is_released_once_an_attitude_shows_that_the_gimbal_stands(
        lost: int, turning: float, most: float, is_end: bool) -> None:
    rig = in_control()
    manager = rig.managers[0]
    manager.rates = (0.0, -turning, 0.0)
    rig.send(Rates((0.0, 0.2, 0.0)))
    rig.run(0.1)
    asked_at, before = rig.now, len(manager.received)

    if is_end:
        rig.component.close(rig.now, 'the process ends')
    rig.gimbal.release_control(rig.now, rig.done)
    while not rig.results:
        if len(manager.received) > before + lost:
            manager.rates = STANDING
        rig.run(0.02)

    if lost == 20:
        # It is released at the end of the process, which has less than a second.
        assert rig.results[0].success is is_end
        assert 'the gimbal still turns' in rig.results[0].message
        assert rig.now - asked_at == approx(0.5 if is_end else 5.0, abs=0.05)
        assert rig.gimbal.reports.in_control is not is_end
        return
    assert rig.results[0].success
    assert rig.results[0].message.endswith(')')
    sent = [(at, one) for at, one in rig.sent if isinstance(one, CommandLong)
            and one.command in DEVICE_ID_PARAM and at >= asked_at]
    assert [one.command for _, one in sent] == [mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE]
    zeros = [one for at, one in setpoints(rig) if at >= asked_at]
    assert {rates_of(one) for one in zeros} == {(0.0, 0.0, 0.0)}
    assert len(zeros) >= 1 + min(lost, 1) * (turning == 0.2)
    assert sent[0][0] - asked_at <= most


@pytest.mark.parametrize(('has', 'sent'), [
    (0, None),
    (mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK, mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME
     | mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK),
    (mavlink.GIMBAL_DEVICE_CAP_FLAGS_SUPPORTS_YAW_IN_EARTH_FRAME,
     mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME)])
def test_gm_3_yaw_relative_to_the_earth_is_sent_only_to_a_gimbal_that_has_it(
        has: int, sent: int | None) -> None:
    lacking = (ALL & ~mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK
               & ~mavlink.GIMBAL_DEVICE_CAP_FLAGS_SUPPORTS_YAW_IN_EARTH_FRAME)
    rig = Rig(FakeManager(primary=OURS, capabilities=lacking | has)).run(3.0)

    reason = rig.send(Attitude(Quaternion(), EARTH))

    assert reason == ('' if sent else 'gimbal 1/154 does not have HAS_YAW_LOCK or '
                      'SUPPORTS_YAW_IN_EARTH_FRAME')
    rig.run(0.1)
    assert [one.flags for _, one in setpoints(rig)] == ([LEVEL | sent] if sent else [])
    assert rig.send(Attitude(Quaternion(), VEHICLE)) == ''


def turned(roll: float, pitch: float, yaw: float, frame: YawFrame) -> FakeManager:
    """Return a manager whose device has an attitude, given in ROS, rad."""
    lock = mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK if frame is EARTH else 0
    return FakeManager(primary=OURS, flags=frame.flag | lock,
                       q=to_mavlink(Quaternion.from_euler(roll, pitch, yaw), frame))


def test_angle_that_is_nan_stays_where_it_is_and_then_where_it_was_sent() -> None:
    rig = Rig(turned(0.1, 0.2, 0.3, VEHICLE)).run(3.0)

    assert rig.send_angles((NAN, 0.5, NAN), VEHICLE) == ''
    assert rig.send_angles((NAN, NAN, -0.4), VEHICLE) == ''
    rig.run(0.1)

    first, second = (from_mavlink(one.q, VEHICLE).euler() for _, one in setpoints(rig)[:2])
    assert first == approx((0.1, 0.5, 0.3))
    assert second == approx((0.1, 0.5, -0.4))


@pytest.mark.parametrize(('delta_yaw', 'sent'), [(math.radians(90), True), (NAN, False)])
def test_gm_2_axis_is_left_as_it_is_in_the_other_frame_only_if_the_heading_is_known(
        delta_yaw: float, sent: bool) -> None:
    manager = turned(0.0, 0.2, 0.3, VEHICLE)
    manager.delta_yaw = delta_yaw
    rig = Rig(manager).run(3.0)

    reason = rig.send_angles((0.0, 0.5, NAN), EARTH)
    rig.run(0.1)

    assert bool(reason) is not sent
    if sent:
        # The vehicle heads east, which is a yaw of 0 in ROS.
        assert from_mavlink(setpoints(rig)[0][1].q, EARTH).euler() == approx((0.0, 0.5, 0.3))
    else:
        assert 'yaw relative to the earth' in reason
