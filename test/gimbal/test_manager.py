# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A gimbal manager: its messages, and the path of a setpoint from a player to the device."""

from __future__ import annotations

from collections.abc import Callable
import math
import operator
from typing import Any

from hypothesis import assume, example, given
from hypothesis import strategies as st
from illuminator_ros.geometry.mount_attitude import UNSET_QUATERNION, UNSET_VECTOR, YawFrame
from illuminator_ros.geometry.rotation import flip, Quaternion
from illuminator_ros.gimbal import managed_device, setpoint_mixer
from illuminator_ros.gimbal.axes import Range
from illuminator_ros.gimbal.manager import AddressShared, RequestRefused
from illuminator_ros.gimbal.manager_control import (
    ControlSettings,
    IDENTITY_TIME,
    Role,
    RoleHolderChanged,
)
from illuminator_ros.gimbal.manager_state import ManagerState
from illuminator_ros.gimbal.messages import (
    AutopilotStateForGimbalDevice,
    GimbalDeviceInformation,
    GimbalDeviceSetAttitude,
    GimbalManagerInformation,
    GimbalManagerSetAttitude,
    GimbalManagerSetManualControl,
    GimbalManagerSetPitchyaw,
    GimbalManagerStatus,
    rates_of,
)
from illuminator_ros.gimbal.setpoint_mixer import AnglesClipped, ReferenceLost, SetpointSent
from illuminator_ros.gimbal.vehicle_state import ESTIMATES_ATTITUDE
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import (
    MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME,
    mavlink,
    replaced,
)
from illuminator_ros.payload.arbitration import Cause, Policy
from illuminator_ros.payload.messages import GimbalDeviceAttitudeStatus
import pytest
from support.gimbal_manager import (
    attitude_status,
    AUTOPILOT,
    configure,
    DEVICE,
    euler,
    EVERYWHERE,
    FULL,
    GUEST,
    information,
    long,
    ManagerRig,
    NAN,
    of,
    OURS,
    PILOT,
    pitch_yaw,
    pitch_yaw_command,
    position,
    region,
    request,
    vehicle_yaw,
)

ACCEPTED, DENIED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED
LATER = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
ROLL_LOCK, PITCH_LOCK, YAW_LOCK, NEUTRAL, RETRACT, NORTH, AHEAD, ACCEPTS_NORTH = (
    getattr(mavlink, f'GIMBAL_DEVICE_FLAGS_{name}') for name in (
        'ROLL_LOCK', 'PITCH_LOCK', 'YAW_LOCK', 'NEUTRAL', 'RETRACT', 'YAW_IN_EARTH_FRAME',
        'YAW_IN_VEHICLE_FRAME', 'ACCEPTS_YAW_IN_EARTH_FRAME'))
POINTS = mavlink.GIMBAL_DEVICE_CAP_FLAGS_CAN_POINT_LOCATION_GLOBAL
# The capabilities of devices that accept no yaw relative to north, and have no yaw lock.
WITHOUT_NORTH = FULL & ~mavlink.GIMBAL_DEVICE_CAP_FLAGS_SUPPORTS_YAW_IN_EARTH_FRAME
WITHOUT_LOCK = FULL & ~mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK
# The settings of a manager whose device has no MAVLink.
SERVO: dict[str, Any] = {
    'device_id': 1, 'ranges': (Range(0.0, 0.0), Range(-1.5, 0.5), Range(-2.0, 2.0))}


def in_control(player: mav.Address = PILOT, **settings: Any) -> ManagerRig:
    """Return a manager with a player in primary control."""
    rig = ManagerRig(**settings)
    assert rig.take(player) == ACCEPTED
    return rig


def nudged(pitch: float = 0.1, yaw: float = 0.1, **settings: Any) -> ManagerRig:
    """Return a manager with a setpoint, and offsets of a player in secondary control."""
    rig = in_control(**settings)
    rig.points(PILOT, 0.2, 0.1)
    assert rig.result(GUEST, configure(-1, -1, *GUEST)) == ACCEPTED
    rig.points(GUEST, pitch, yaw)
    return rig


def last(rig: ManagerRig) -> GimbalDeviceSetAttitude:
    return rig.messages(GimbalDeviceSetAttitude)[-1]


def setpoints(sent: list[Any]) -> list[GimbalDeviceSetAttitude]:
    return of(GimbalDeviceSetAttitude, sent)


def refusals(rig: ManagerRig) -> list[str]:
    return [one.reason for one in of(RequestRefused, rig.events)]


def clipped(rig: ManagerRig) -> list[tuple[str, float, float]]:
    """Return each clipped angle that was reported, rad."""
    return [(one.axis, round(one.requested, 4), round(one.limit, 4))
            for event in of(AnglesClipped, rig.events) for one in event.clipped]


# GM-10, GM-27: INFORMATION is static and on request, STATUS names the players in control

@pytest.mark.parametrize('to', [OURS, mav.Address(1, 0), mav.Address(0, 0)])
def test_gm_27_information_is_sent_on_request_with_what_the_device_reports(
        to: mav.Address) -> None:
    rig = ManagerRig(device=information(yaw_max=NAN, cap_flags2=0))

    ack, answer = rig.give(PILOT, request(GimbalManagerInformation, to))

    assert ack.result == ACCEPTED
    assert replaced(answer, time_boot_ms=0, yaw_max=0.0) == GimbalManagerInformation(
        0, int(FULL | POINTS), DEVICE.component, -0.5, 0.5, -0.5, 0.5, -0.5, 0.0)
    assert math.isnan(answer.yaw_max)
    assert len(rig.messages(GimbalManagerInformation)) == 1


# How many answers of the device, and how many GIMBAL_DEVICE_INFORMATION, are lost; the result 3 s
# after the device is heard first, and whether the manager ever announces its capabilities.
LOSSES = {
    'no message is lost': ((0, 0), ACCEPTED, True),
    'the information is lost twice': ((0, 2), ACCEPTED, True),
    'no answer comes for some time': ((9, 0), LATER, True),
    'no information ever comes': ((0, math.inf), ACCEPTED, False),
    'no answer ever comes': ((math.inf, 0), LATER, False),
}


@pytest.mark.parametrize(('lost', 'first', 'known'), LOSSES.values(), ids=LOSSES)
def test_gm_10_information_waits_for_that_of_the_device_or_three_requests_for_it(
        lost: tuple[float, float], first: int, known: bool) -> None:
    rig = ManagerRig(active=False, lost=lost)
    results, announced = [], []

    for seconds in (3.0, 7.0):
        rig.run(seconds)
        ack, *answers = rig.give(PILOT, request(GimbalManagerInformation))
        results.append(ack.result)
        announced += [one.cap_flags for one in answers]

    assert results == [first, ACCEPTED]
    assert set(announced) == {POINTS | (FULL if known else 0)}


@pytest.mark.parametrize('seconds', [0.0, 1.0, 3.0], ids=['no device', 'listening', 'active'])
def test_gm_10_information_that_was_requested_too_early_is_sent_once_later(
        seconds: float) -> None:
    rig = ManagerRig(active=False, lost=(6, 0))
    rig.run(seconds)
    early = rig.result(PILOT, request(GimbalManagerInformation))

    rig.run(10.0)

    assert early == LATER
    assert [one.cap_flags for one in rig.messages(GimbalManagerInformation)] == [POINTS | FULL]


def test_gm_10_information_does_not_wait_for_a_device_that_reports_progress_for_ever() -> None:
    rig = ManagerRig(active=False, lost=(math.inf, 0))
    progress = mav.CommandAck(
        mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAV_RESULT_IN_PROGRESS, 0, 0, *OURS)

    rig.run(10.0, each=lambda: rig.component.receive(DEVICE, progress, rig.now))

    assert rig.result(PILOT, request(GimbalManagerInformation)) == ACCEPTED


def test_gm_10_no_information_is_requested_once_it_has_come_without_an_acknowledgement() -> None:
    rig = ManagerRig(active=False, lost=(math.inf, 0))
    rig.run(0.1)
    rig.component.receive(DEVICE, rig.device_information, rig.now)

    rig.run(60.0)

    [_] = [one for one in rig.messages(mav.CommandLong)
           if one.param1 == GimbalDeviceInformation.id and not one.confirmation]


def test_the_manager_passes_on_the_information_of_its_device() -> None:
    rig = ManagerRig()

    _, answer = rig.give(PILOT, request(GimbalDeviceInformation))

    assert answer == replaced(rig.device_information, gimbal_device_id=DEVICE.component)


def test_gm_10_gm_13_the_status_is_sent_five_times_a_second_and_no_player_stops_it() -> None:
    rig = in_control()
    begun = rig.now
    interval = long(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, GimbalManagerStatus.id, -1)

    assert rig.result(PILOT, interval) == DENIED
    rig.run(10.0, each=rig.heartbeats(PILOT))

    statuses = rig.messages(GimbalManagerStatus, begun)
    assert 49 <= len(statuses) <= 51
    assert {(one.gimbal_device_id, one.primary_control_sysid, one.primary_control_compid,
             one.secondary_control_sysid, one.secondary_control_compid)
            for one in statuses[1:]} == {(DEVICE.component, *PILOT, 0, 0)}


def test_a_change_of_control_is_sent_at_once_and_at_a_limited_rate() -> None:
    rig = ManagerRig()

    changes = [rig.give(PILOT, configure(*player)) for player in (PILOT, (-3, -3), PILOT)]

    assert [len(of(GimbalManagerStatus, sent)) for sent in changes] == [1, 0, 0]


def test_the_status_has_the_flags_of_the_setpoint() -> None:
    rig = in_control()
    flags = ROLL_LOCK | PITCH_LOCK | YAW_LOCK

    rig.give(PILOT, pitch_yaw(0.0, 0.0, flags=flags))

    assert rig.manager.status(rig.now).flags == flags | NORTH | ACCEPTS_NORTH


@pytest.mark.parametrize(('rate', 'flags', 'zeros'), [
    (0.3, 0, True), (0.005, 0, False), (NAN, 0, False), (0.3, RETRACT, False)])
def test_a_device_that_turns_when_the_manager_becomes_active_is_stopped(
        rate: float, flags: int, zeros: bool) -> None:
    rig = ManagerRig(active=False)
    rig.turning, rig.flags = rate, rig.flags | flags

    rig.run(6.0)

    assert rig.manager.tracker.state is ManagerState.ACTIVE
    sent = rig.messages(GimbalDeviceSetAttitude)
    assert bool(sent) is zeros
    for one in sent:
        assert all(map(math.isnan, one.q))
        assert rates_of(one) == (0.0, 0.0, 0.0)


# GM-16, GM-17, GM-19: only the player in control reaches the device

@pytest.mark.parametrize('holder', [None, PILOT])
@pytest.mark.parametrize('message', [
    pitch_yaw(0.1, 0.0), pitch_yaw_command(1, 1), region(47.1, 8.0, 0.0),
    long(mavlink.MAV_CMD_DO_SET_ROI_NONE)], ids=lambda one: type(one).__name__)
def test_gm_14_a_player_that_is_not_in_control_is_refused(
        message: Any, holder: mav.Address | None) -> None:
    rig = in_control(holder) if holder else ManagerRig()
    rig.give(AUTOPILOT, position(47.0, 8.0, 500.0))

    sent = rig.give(GUEST, message)

    assert [ack.result for ack in of(mav.CommandAck, sent)] == (
        [] if isinstance(message, GimbalManagerSetPitchyaw) else [DENIED])
    assert rig.messages(GimbalDeviceSetAttitude) == []
    assert of(RequestRefused, rig.events) == [RequestRefused(
        GUEST, f'{holder} has control' if holder else 'the player must take control first')]


@pytest.mark.parametrize(('policy', 'overrules', 'result'), [
    (Policy.HOLD, False, DENIED), (Policy.HOLD, True, ACCEPTED),
    (Policy.TAKEOVER, False, ACCEPTED)])
def test_gm_17_control_moves_as_the_policy_says(
        policy: Policy, overrules: bool, result: int) -> None:
    rig = in_control(control=ControlSettings(
        policy, overruling=frozenset({GUEST} if overrules else ())))

    assert rig.take(GUEST) is result

    obeyed, ignored = (GUEST, PILOT) if result == ACCEPTED else (PILOT, GUEST)
    assert (len(rig.points(obeyed)), rig.points(ignored)) == (1, [])


@pytest.mark.parametrize('device_id', [0, DEVICE.component, 155])
def test_gm_28_messages_and_commands_of_other_devices_are_refused(device_id: int) -> None:
    rig = in_control()
    ours = device_id != 155

    result = rig.result(PILOT, pitch_yaw_command(1, 1, device_id=device_id))
    sent = rig.give(PILOT, pitch_yaw(0.1, 0.1, device_id=device_id))

    assert result is (ACCEPTED if ours else DENIED)
    assert len(sent) == ours


def test_a_setpoint_to_another_manager_is_ignored() -> None:
    rig = in_control()

    for other in (mav.Address(1, 1), mav.Address(2, OURS.component)):
        assert rig.give(PILOT, pitch_yaw(0.1, 0.1, to=other)) == []


def test_gm_16_the_gimbal_stays_where_it_points_when_its_player_falls_silent() -> None:
    rig = in_control()
    rig.give(PILOT, pitch_yaw(pitch_rate=0.1, yaw_rate=0.0))
    assert last(rig).q == pytest.approx(UNSET_QUATERNION, nan_ok=True)

    rig.run(3.5)

    assert rates_of(last(rig)) == (0.0, 0.0, 0.0)
    assert of(RoleHolderChanged, rig.events)[-1] == RoleHolderChanged(
        Role.PRIMARY, PILOT, None, Cause.SILENCE)


@pytest.mark.parametrize('message', [
    GimbalManagerSetAttitude(*OURS, 0, 0, (1.0, 0.0, 0.0, 0.0), NAN, NAN, 1.0),
    pitch_yaw(0.1, 0.2, yaw_rate=1.0)])
def test_gm_16_the_rates_beside_an_attitude_end_with_the_control_of_their_player(
        message: Any) -> None:
    rig = in_control()
    rig.give(PILOT, message)
    pointed = euler(last(rig))

    rig.give(PILOT, configure(-3, -3))

    assert last(rig).angular_velocity_z == pytest.approx(NAN, nan_ok=True)
    assert euler(last(rig)) == pointed


# Setpoints

def test_a_setpoint_is_repeated_at_least_once_a_second() -> None:
    rig = in_control()
    rig.points(PILOT)
    begun = rig.now

    rig.run(10.0, each=rig.heartbeats(PILOT))

    times = [begun, *(at for at, message in rig.sent
                      if at > begun and isinstance(message, GimbalDeviceSetAttitude))]
    assert max(b - a for a, b in zip(times, times[1:], strict=False)) <= 1.0
    assert len(times) <= 10.0 / setpoint_mixer.HOLD_INTERVAL + 2


Q = Quaternion.from_euler(0.1, 0.2, 0.3)
HALF = (Q.w / 2, Q.x / 2, Q.y / 2, Q.z / 2)
# A message of a player; the angles (rad), rates (rad/s) and flags that the device then receives.
SETPOINTS: dict[str, tuple[Any, Any, Any, int]] = {
    'quaternion': (
        GimbalManagerSetAttitude(*OURS, int(YAW_LOCK), 0, HALF, NAN, 0.2, 0.3),
        (0.1, 0.2, 0.3), (NAN, 0.2, 0.3), YAW_LOCK | NORTH),
    'rates of a quaternion message': (
        GimbalManagerSetAttitude(*OURS, 0, 0, UNSET_QUATERNION, 0.1, NAN, 0.3),
        None, (0.1, 0.0, 0.3), AHEAD),
    'angles': (pitch_yaw(0.2, 0.3, flags=ROLL_LOCK | NORTH), (0.0, 0.2, 0.3), UNSET_VECTOR,
               ROLL_LOCK | NORTH),
    'angles with rates': (
        pitch_yaw(0.2, 0.3, 0.4, 0.5), (0.0, 0.2, 0.3), (NAN, 0.4, 0.5), AHEAD),
    'pitch only': (pitch_yaw(0.2), (0.0, 0.2, 0.25), UNSET_VECTOR, AHEAD),
    'rates': (pitch_yaw(pitch_rate=0.1), None, (0.0, 0.1, 0.0), AHEAD),
    'flags only': (
        pitch_yaw(flags=PITCH_LOCK), (0.05, 0.15, 0.25), UNSET_VECTOR, PITCH_LOCK | AHEAD),
    'command': (pitch_yaw_command(math.degrees(0.2), math.degrees(-0.3)), (0.0, 0.2, -0.3),
                UNSET_VECTOR, AHEAD),
    'rates of a command': (
        pitch_yaw_command(NAN, NAN, math.degrees(0.1), math.degrees(0.2)),
        None, (0.0, 0.1, 0.2), AHEAD),
    'full deflection': (
        GimbalManagerSetManualControl(*OURS, 0, 0, 1.0, -1.0, NAN, NAN),
        (0.0, 0.5, -0.5), UNSET_VECTOR, AHEAD),
    'rates of a stick': (
        GimbalManagerSetManualControl(*OURS, 0, 0, NAN, NAN, 0.5, -1.0),
        None, (0.0, 0.25, -0.5), AHEAD),
    'neutral': (pitch_yaw(flags=NEUTRAL), None, UNSET_VECTOR, NEUTRAL | AHEAD),
}


@pytest.mark.parametrize('case', SETPOINTS)
def test_each_kind_of_setpoint_reaches_the_device(case: str) -> None:
    message, angles, rates, flags = SETPOINTS[case]
    rig = in_control()
    rig.report(Quaternion.from_euler(0.05, 0.15, 0.25))

    [sent] = setpoints(rig.give(PILOT, message))

    assert (sent.target_system, sent.target_component, sent.flags) == (*DEVICE, flags)
    assert rates_of(sent) == pytest.approx(rates, nan_ok=True)
    assert (euler(sent) == angles) if angles else all(map(math.isnan, sent.q))
    assert of(SetpointSent, rig.events) == []


@pytest.mark.parametrize('message', [
    GimbalManagerSetAttitude(*OURS, 0, 0, (0.0, 0.0, 0.0, 0.0), NAN, NAN, NAN),
    GimbalManagerSetAttitude(*OURS, 0, 0, (1.0, NAN, 0.0, 0.0), NAN, NAN, NAN),
    GimbalManagerSetAttitude(*OURS, 0, 0, UNSET_QUATERNION, math.inf, NAN, NAN),
    GimbalManagerSetAttitude(*OURS, 0, 0, UNSET_QUATERNION, 0.0, 0.0, 1e30),
    pitch_yaw(yaw_rate=-6.3), pitch_yaw(0.0, 0.0, pitch_rate=6.3),
    pitch_yaw(math.inf, 0.0), pitch_yaw(yaw_rate=-math.inf), pitch_yaw(0.0, 0.0, flags=32 | 64),
    GimbalManagerSetManualControl(*OURS, 0, 0, 1.5, 0.0, NAN, NAN),
    pitch_yaw_command(math.inf, 0.0), pitch_yaw_command(0.0, 0.0, flags=96),
    pitch_yaw_command(0.0, 0.0, math.inf), pitch_yaw_command(-400.0, 0.0),
    pitch_yaw_command(NAN, NAN, 0.0, 361.0), pitch_yaw_command(0.0, 0.0, device_id=NAN),
    region(47.1, 8.0, 0.0, device_id=NAN), region(47.1, 8.0, 1e30),
    configure(*PILOT, device_id=NAN), long(mavlink.MAV_CMD_DO_SET_ROI_NONE, NAN),
    pitch_yaw_command(0.0, 0.0, flags=math.inf),
    pitch_yaw_command(NAN, 180.1), pitch_yaw(NAN, -3.15), pitch_yaw(4.0, NAN)], ids=str)
def test_an_invalid_setpoint_is_refused_and_named(message: Any) -> None:
    rig = in_control()

    sent = rig.give(PILOT, message)

    assert setpoints(sent) == []
    assert {ack.result for ack in of(mav.CommandAck, sent)} <= {DENIED}
    assert len(refusals(rig)) == 1


def test_gm_3_a_yaw_lock_is_refused_where_the_device_has_none() -> None:
    rig = in_control(device=information(WITHOUT_LOCK))

    assert rig.result(PILOT, pitch_yaw_command(0, 0, flags=YAW_LOCK)) is DENIED
    assert rig.give(PILOT, pitch_yaw(0.1, 0.0, flags=YAW_LOCK)) == []

    assert refusals(rig) == ['the gimbal does not have YAW_LOCK'] * 2


@pytest.mark.parametrize(('capabilities', 'lost'), [
    (WITHOUT_NORTH & WITHOUT_LOCK, 0), (WITHOUT_NORTH, math.inf)],
    ids=['information', 'status without information'])
def test_gm_2_a_yaw_from_north_is_converted_for_a_device_without_north(
        capabilities: int, lost: float) -> None:
    rig = in_control(device=information(capabilities), lost=(0, lost))
    northward = pitch_yaw(0.1, 1.2, flags=NORTH)
    rig.report()
    assert setpoints(rig.give(PILOT, northward)) == []
    assert refusals(rig) == ['the heading of the vehicle is unknown']

    rig.heading = 1.0
    rig.report()
    [sent] = setpoints(rig.give(PILOT, northward))

    assert (euler(sent), sent.flags) == ((0.0, 0.1, 0.2), AHEAD)
    # The gimbal follows the vehicle when that turns.
    rig.heading = 1.1
    rig.report()
    rig.run(setpoint_mixer.FOLLOW_INTERVAL)
    assert euler(last(rig)) == (0.0, 0.1, 0.1)
    rig.heading, count = NAN, len(rig.messages(GimbalDeviceSetAttitude))
    rig.report()
    rig.run(0.2)
    assert len(rig.messages(GimbalDeviceSetAttitude)) == count
    assert of(ReferenceLost, rig.events) == [ReferenceLost('heading')]


def test_gm_2_an_axis_without_an_angle_keeps_its_direction_in_another_yaw_frame() -> None:
    rig = in_control()
    rig.heading = 1.0
    rig.report()
    rig.points(PILOT, 0.1, 0.2)

    for flag, yaw in ((NORTH, 1.2), (AHEAD, 0.2)):
        rig.give(PILOT, pitch_yaw(0.3, flags=flag))
        assert euler(last(rig)) == (0.0, 0.3, yaw)


@pytest.mark.parametrize('pitch', [1.0, NAN])
@pytest.mark.parametrize(('reported', 'unknown'), [
    (None, 'attitude'), (attitude_status(flags=NORTH), 'heading'),
    (attitude_status((0.0, 0.0, 0.0, 0.0)), 'attitude'),
    (attitude_status(flags=NORTH | AHEAD), 'attitude')])
def test_an_axis_without_an_angle_is_refused_where_its_attitude_is_unknown(
        reported: GimbalDeviceAttitudeStatus | None, unknown: str, pitch: float) -> None:
    rig = in_control()
    rig.give(PILOT, pitch_yaw(pitch_rate=0.0, yaw_rate=0.5))
    rig.device_is_there = False
    rig.run(managed_device.ATTITUDE_AGE)
    if reported:
        rig.give(DEVICE, reported)

    assert rig.result(PILOT, pitch_yaw_command(pitch, NAN)) is DENIED

    assert unknown in refusals(rig)[0]
    assert last(rig).angular_velocity_z == 0.5


def test_a_device_that_has_never_reported_an_attitude_starts_at_0() -> None:
    rig = ManagerRig(active=False)
    rig.device_is_there = False
    rig.run(5.0, each=lambda: rig.component.receive(
        DEVICE, mav.heartbeat(mavlink.MAV_TYPE_GIMBAL), rig.now))
    rig.take(PILOT)

    rig.give(PILOT, pitch_yaw(0.1))

    assert euler(last(rig)) == (0.0, 0.1, 0.0)


@pytest.mark.parametrize('flag', [NEUTRAL, RETRACT])
def test_a_pose_with_a_locked_yaw_needs_no_heading(flag: int) -> None:
    rig = in_control(device=information(WITHOUT_NORTH))

    [sent] = setpoints(rig.give(PILOT, pitch_yaw(flags=flag | YAW_LOCK)))

    assert sent.flags == flag | AHEAD


@pytest.mark.parametrize('is_silent', [False, True])
def test_gm_16_a_locked_yaw_is_stopped_by_its_player_or_its_silence_without_a_heading(
        is_silent: bool) -> None:
    rig = in_control(device=information(WITHOUT_NORTH))
    rig.heading = 1.0
    rig.report()
    rig.give(PILOT, pitch_yaw(yaw_rate=0.2, flags=YAW_LOCK))
    rig.heading, count = NAN, len(rig.messages(GimbalDeviceSetAttitude))
    rig.report()
    rig.run(1.0)
    assert len(rig.messages(GimbalDeviceSetAttitude)) > count

    if is_silent:
        rig.run(3.0)
    else:
        rig.give(PILOT, pitch_yaw(yaw_rate=0.0, flags=YAW_LOCK))

    assert (last(rig).flags, last(rig).angular_velocity_z) == (AHEAD, 0.0)


# GM-9: nudging adds, overriding replaces; limits come last

@pytest.mark.parametrize(('asked', 'pitch'), [(0.1, 0.3), (-0.1, 0.1), (1.0, 0.4), (-1.0, 0.0)])
def test_gm_9_the_secondary_player_adds_no_more_than_the_limit(
        asked: float, pitch: float) -> None:
    rig = nudged(asked, 0.0, nudge_limit=0.2)

    assert euler(last(rig)) == (0.0, pitch, 0.1)
    # Overriding replaces the setpoint, not the offset.
    assert euler(rig.points(PILOT, 0.0, 0.0)[0]) == (0.0, round(pitch - 0.2, 4), 0.0)
    assert rig.result(GUEST, configure(-3, -3, -3, -3)) == ACCEPTED
    assert euler(rig.points(PILOT, 0.2, 0.1)[0]) == (0.0, 0.2, 0.1)


@pytest.mark.parametrize('secondary', [GUEST, (-1, -1)])
def test_gm_9_the_offsets_of_a_player_do_not_shift_its_setpoints_in_primary_control(
        secondary: tuple[int, int]) -> None:
    rig = nudged()
    rig.give(PILOT, configure(-3, -3))

    rig.give(GUEST, configure(*GUEST, *secondary))
    rig.run(1.0, each=rig.heartbeats(GUEST))

    assert euler(last(rig)) == (0.0, 0.3, 0.2)
    assert euler(rig.points(GUEST, 0.1, NAN)[0]) == (0.0, 0.1, 0.2)
    assert euler(rig.points(GUEST, 0.2, 0.1)[0]) == (0.0, 0.2, 0.1)


@pytest.mark.parametrize('is_held', [True, False])
def test_gm_16_offsets_end_with_secondary_control_only_where_a_player_has_primary_control(
        is_held: bool) -> None:
    rig = nudged()
    if not is_held:
        rig.give(PILOT, configure(-3, -3))

    rig.give(GUEST, configure(-3, -3, -3, -3))
    rig.run(1.0)

    assert euler(last(rig)) == ((0.0, 0.2, 0.1) if is_held else (0.0, 0.3, 0.2))


def test_gm_16_a_rate_ends_when_a_secondary_player_with_offsets_gets_primary_control() -> None:
    rig = nudged()
    rig.give(PILOT, pitch_yaw(pitch_rate=0.0, yaw_rate=0.1))

    rig.give(PILOT, configure(*GUEST))

    assert rates_of(last(rig))[1:] == (0.0, 0.0)


def test_gm_9_a_change_of_the_secondary_player_does_not_end_the_rate_of_the_primary_one() -> None:
    rig = in_control()
    rig.give(PILOT, pitch_yaw(pitch_rate=0.0, yaw_rate=0.1))

    for secondary in (GUEST, (-3, -3)):
        assert rig.result(PILOT, configure(-1, -1, *secondary)) == ACCEPTED
        rig.run(1.0, each=rig.heartbeats(PILOT))
        assert last(rig).angular_velocity_z == pytest.approx(0.1)


@pytest.mark.parametrize('message', [
    pitch_yaw(pitch_rate=0.1), pitch_yaw(flags=RETRACT), pitch_yaw(0.1, flags=NEUTRAL),
    pitch_yaw()])
def test_gm_9_the_secondary_player_sets_neither_rates_nor_flags(message: Any) -> None:
    rig = nudged()

    assert rig.give(GUEST, message) == []


def test_gm_9_limits_are_applied_after_mixing_and_reported() -> None:
    rig = nudged(0.2, 0.0, nudge_limit=0.2)

    [message] = rig.points(PILOT, 0.4, -0.1)

    assert euler(message) == (0.0, 0.5, -0.1)
    assert clipped(rig) == [('pitch', 0.6, 0.5)]


def test_a_clipped_setpoint_is_reported_once_though_it_is_sent_each_second() -> None:
    rig = in_control()
    rig.points(PILOT, 2.0, 0.0)

    rig.run(3.0, each=rig.heartbeats(PILOT))

    assert clipped(rig) == [('pitch', 2.0, 0.5)]
    rig.points(PILOT, 2.1, 0.0)
    assert len(clipped(rig)) == 2


NORTHWARD = pitch_yaw(0.0, -0.4, flags=NORTH)
TURNING = pitch_yaw(pitch_rate=0.0, yaw_rate=-0.3, flags=NORTH)


@pytest.mark.parametrize(('messages', 'reports'), [
    ([NORTHWARD], 1), ([NORTHWARD] * 40, 1), ([region(47.01, 7.996, 500.0)], 1),
    ([TURNING] * 40, 1), ([NORTHWARD, pitch_yaw(0.0, 0.0), NORTHWARD], 2)],
    ids=['one', 'stream', 'place', 'rate', 'two'])
def test_a_clipped_setpoint_is_reported_once_though_the_vehicle_turns(
        messages: list[Any], reports: int) -> None:
    rig = in_control(device_id=1, ranges=(Range(), Range(-1.0, 1.0), Range(-0.5, 0.5)))
    headings = [0.3 + 0.02 * step for step in range(20)]

    for step, heading in enumerate(headings + headings[::-1]):
        rig.give(AUTOPILOT, position(47.0, 8.0, 500.0), vehicle_yaw(heading))
        rig.give(PILOT, *messages[step:step + 1])
        rig.run(0.1, each=rig.heartbeats(PILOT))

    assert [axis for axis, _, _ in clipped(rig)] == ['yaw'] * reports


def test_gm_9_an_offset_beyond_a_stop_does_not_turn_the_gimbal_to_the_other() -> None:
    rig = nudged(0.0, 0.15, device=information(yaw_min=-3.1, yaw_max=3.1))

    [message] = rig.points(PILOT, 0.0, 3.0)

    assert euler(message) == (0.0, 0.0, 3.1)


@pytest.mark.parametrize('command', [
    pitch_yaw_command(-110.0, 0.0), pitch_yaw_command(-110.0, NAN),
    pitch_yaw_command(-110.0, NAN, yaw_rate=5.0)])
def test_gm_4_a_pitch_beyond_a_right_angle_is_clipped_whatever_the_device_reports(
        command: mav.CommandLong) -> None:
    rig = in_control(device=information(pitch_min=math.radians(-120)))

    rig.give(PILOT, command)
    rig.run(1.0, each=rig.heartbeats(PILOT))

    assert euler(last(rig))[1] == round(-math.pi / 2, 4)
    assert clipped(rig)[-1] == ('pitch', round(math.radians(-110), 4), round(-math.pi / 2, 4))


def by_message(pitch: float, yaw: float) -> mav.Message:
    return pitch_yaw(pitch, yaw)


def by_command(pitch: float, yaw: float) -> mav.Message:
    return pitch_yaw_command(math.degrees(pitch), math.degrees(yaw))


def by_quaternion(pitch: float, yaw: float) -> mav.Message:
    q = Quaternion.from_euler(0.0, pitch, yaw)
    return GimbalManagerSetAttitude(*OURS, 0, 0, q, NAN, NAN, NAN)


@pytest.mark.parametrize('message', [by_message, by_command, by_quaternion])
def test_angles_beyond_half_a_turn_are_refused_and_others_are_clipped_on_their_axis_alone(
        message: Callable[[float, float], mav.Message]) -> None:
    rig = in_control()
    ends = st.floats(0.6, 2.0), st.floats(0.6, 1.5), st.floats(0.0, 3.0), st.floats(0.0, 3.0)
    within, beyond = st.floats(-math.pi, math.pi), st.floats(math.pi + 1e-4, 10.0)
    angle = within if message is by_quaternion else within | beyond | beyond.map(operator.neg)

    @given(angle, angle, st.tuples(*ends))
    @example(-1.9, 0.5, (1.5, 1.0, 2.0, 2.0))
    def check(pitch: float, yaw: float, ends: tuple[float, float, float, float]) -> None:
        down, up, left, right = ends
        rig.give(DEVICE, information(
            pitch_min=-down, pitch_max=up, yaw_min=-left, yaw_max=right))
        # So that no axis is at a stop before.
        rig.points(PILOT, 0.0, 0.0)

        sent = rig.give(PILOT, message(pitch, yaw))

        accepted = abs(pitch) <= math.pi and abs(yaw) <= math.pi
        assert [ack.result for ack in of(mav.CommandAck, sent)] == [
            ACCEPTED if accepted else DENIED] * (message is by_command)
        assert len(setpoints(sent)) == accepted
        limited = max(-min(down, math.pi / 2), min(up, pitch))
        # A yaw between the stops ends at the nearer one.
        gap = math.remainder(yaw - (right - left) / 2, math.tau)
        assume(abs(abs(gap) - math.pi) > 1e-3)
        turned = (right - left) / 2 + max(-(left + right) / 2, min((left + right) / 2, gap))
        for setpoint in setpoints(sent):
            assert Quaternion(*setpoint.q).angle_to(
                Quaternion.from_euler(0.0, limited, turned)) < 1e-4

    check()


def test_gm_5_an_axis_that_the_device_lacks_is_not_turned() -> None:
    rig = in_control(device=information(FULL & ~mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_AXIS))

    [message] = rig.points(PILOT, 0.1, 0.4)

    assert euler(message) == (0.0, 0.1, 0.0)
    assert clipped(rig) == [('yaw', 0.4, 0.0)]


# GM-8: regions of interest

def following(**device: Any) -> ManagerRig:
    """Return a manager that points at a place 1 km north of the vehicle, which heads east."""
    rig = in_control(device=replaced(information(), **EVERYWHERE, **device))
    rig.give(AUTOPILOT, position(47.0, 8.0, 500.0, home=400.0), vehicle_yaw(math.pi / 2))
    assert rig.result(PILOT, region(47.008993, 8.0, 500.0)) == ACCEPTED
    return rig


def test_gm_8_the_gimbal_follows_a_place_while_the_vehicle_moves() -> None:
    rig = following()
    assert euler(last(rig)) == pytest.approx((0.0, 0.0, 0.0), abs=0.001)
    assert last(rig).flags & (YAW_LOCK | NORTH)

    rig.give(AUTOPILOT, position(47.008993, 7.986836, 1500.0))
    rig.run(0.2)

    assert euler(last(rig)) == pytest.approx((0.0, -math.pi / 4, math.pi / 2), abs=0.002)


def test_gm_8_a_device_without_north_gets_the_yaw_from_the_vehicle() -> None:
    rig = following(cap_flags=int(WITHOUT_NORTH & WITHOUT_LOCK))

    assert euler(last(rig)) == pytest.approx((0.0, 0.0, -math.pi / 2), abs=0.001)
    assert last(rig).flags & AHEAD


@pytest.mark.parametrize('ending', [
    pitch_yaw(0.0, 0.0), long(mavlink.MAV_CMD_DO_SET_ROI_NONE), configure(0, 0),
    configure(*GUEST)])
def test_gm_8_a_new_setpoint_clearing_or_the_end_of_control_ends_the_region_of_interest(
        ending: Any) -> None:
    rig = following()
    rig.give(PILOT, ending)
    before = euler(last(rig))

    rig.give(AUTOPILOT, position(46.0, 8.0, 1500.0))
    rig.run(2.0)

    assert euler(last(rig)) == before


@pytest.mark.parametrize(('limit', 'headings', 'expected'), [
    (86.0, (5.0, -1.0, 1.0, -4.0, 4.0, -6.0), [86.0] * 5 + [-86.0]),
    (179.0, (0.5, -2.0, 0.5, -8.0, 2.0, -10.0), [179.0] * 4 + [178.0, -170.0]),
    (179.0, (0.5, -8.0, -10.0), [179.0] * 2 + [-170.0])], ids=['half', 'full', 'far'])
def test_gm_8_a_noisy_heading_keeps_the_gimbal_at_one_stop_where_the_place_is_behind(
        limit: float, headings: tuple[float, ...], expected: list[float]) -> None:
    rig = in_control(device=information(
        WITHOUT_NORTH, yaw_min=math.radians(-limit), yaw_max=math.radians(limit)))
    at: list[float] = []

    for degrees in headings:
        rig.give(AUTOPILOT, position(47.0, 8.0, 500.0),
                 vehicle_yaw(math.pi + math.radians(degrees)))
        if not at:
            rig.give(PILOT, region(47.01, 8.0, 500.0))
        rig.run(0.1, each=rig.heartbeats(PILOT))
        at.append(math.degrees(euler(last(rig))[2]))

    assert at == pytest.approx(expected, abs=0.01)


def test_gm_8_the_gimbal_holds_when_the_position_is_lost_and_says_so() -> None:
    rig = following()
    before = euler(last(rig))

    rig.run(3.0, each=rig.heartbeats(PILOT))

    assert euler(last(rig)) == before
    assert of(ReferenceLost, rig.events) == [ReferenceLost('position')]
    rig.give(AUTOPILOT, position(47.0, 8.0, 500.0))
    rig.run(3.0, each=rig.heartbeats(PILOT))
    assert of(ReferenceLost, rig.events) == [ReferenceLost('position')] * 2


@pytest.mark.parametrize(('command', 'result'), [
    (region(47.1, 8.0, 100.0, frame=3), ACCEPTED),
    (region(47.1, 8.0, 100.0, frame=10), MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME),
    (region(97.1, 8.0, 100.0), DENIED), (region(47.1, 180.1, 100.0), DENIED),
    (region(47.1, 8.0, NAN), DENIED),
    (long(mavlink.MAV_CMD_DO_SET_ROI_LOCATION, 0, 0, 0, 0, 47, 8, 0), ACCEPTED),
    (long(mavlink.MAV_CMD_DO_SET_ROI_LOCATION, 0, 0, 0, 0, NAN, 8, 0), DENIED)])
def test_gm_8_a_region_of_interest_is_answered_with_its_reason(
        command: Any, result: int) -> None:
    rig = following()

    assert rig.result(PILOT, command) is result
    assert len(refusals(rig)) == (result is not ACCEPTED)


def test_gm_8_an_altitude_above_home_is_converted() -> None:
    rig = following()

    rig.give(PILOT, region(47.008993, 8.0, 1100.0, frame=3))

    # Home is at 400 m and the vehicle at 500 m: the place is 1000 m above it.
    assert euler(last(rig))[1] == pytest.approx(math.pi / 4, abs=0.002)


def test_gm_8_without_a_position_a_region_of_interest_is_rejected_for_now() -> None:
    rig = in_control()
    rig.give(AUTOPILOT, position(0.0, 0.0, 0.0))

    assert rig.result(PILOT, region(47.1, 8.0, 0.0)) is LATER
    assert refusals(rig) == ['the position or the heading of the vehicle is unknown']


# GM-22: a device without MAVLink

def yaws(rig: ManagerRig) -> list[float]:
    """Return the yaws that a device without MAVLink got."""
    return [one.setpoint.angles[2] for one in of(SetpointSent, rig.events)]


def test_gm_22_a_device_without_mavlink_gets_no_message_of_the_gimbal_set() -> None:
    rig = in_control(**SERVO)
    rig.manager.vehicle.attitude.set((Quaternion(), 0.0), rig.now)
    rig.manager.vehicle_changed(rig.now)

    rig.give(PILOT, pitch_yaw(1.0, 0.3))

    assert rig.messages(GimbalDeviceSetAttitude) == []
    assert rig.messages(AutopilotStateForGimbalDevice) == []
    assert of(SetpointSent, rig.events)[-1].setpoint.angles == pytest.approx((0.0, 0.5, 0.3))


def test_gm_22_the_manager_turns_a_device_that_takes_no_rates() -> None:
    rig = in_control(**SERVO)
    rig.give(PILOT, pitch_yaw(0.1, 0.0))

    rig.give(PILOT, pitch_yaw(yaw_rate=0.5))
    rig.run(1.0, each=rig.heartbeats(PILOT))

    assert of(SetpointSent, rig.events)[-1].setpoint.angles == pytest.approx(
        (0.0, 0.1, 0.5), abs=0.03)


def test_gm_22_a_rate_turns_a_device_without_mavlink_no_further_after_a_pause() -> None:
    rig = in_control(device_id=1, ranges=(Range(), Range(-1.0, 1.0), Range()))
    rig.give(PILOT, pitch_yaw(yaw_rate=0.3))
    rig.run(1.0, each=rig.heartbeats(PILOT))
    before = yaws(rig)[-1]

    rig.now += 5.0
    rig.run(0.0)

    assert before == pytest.approx(0.3, abs=0.02)
    assert yaws(rig)[-1] - before <= 0.3 * setpoint_mixer.STEP_LIMIT + 1e-9


def test_gm_22_a_yaw_from_north_follows_each_heading_of_the_vehicle() -> None:
    rig = in_control(device_id=1, ranges=(Range(), Range(), Range()))
    rig.give(AUTOPILOT, vehicle_yaw(0.0))
    rig.give(PILOT, pitch_yaw(0.0, 0.5, flags=NORTH))

    for step in range(1, 20):
        rig.give(AUTOPILOT, vehicle_yaw(0.02 * step))
        rig.run(0.06, each=rig.heartbeats(PILOT))
        assert yaws(rig)[-1] == pytest.approx(0.5 - 0.02 * step)


def test_gm_22_a_rate_against_a_stop_stays_there_while_the_vehicle_turns() -> None:
    limit = math.radians(179.0)
    rig = in_control(device_id=1, ranges=(Range(), Range(), Range(-limit, limit)))
    rig.give(AUTOPILOT, vehicle_yaw(0.0))
    rig.give(PILOT, pitch_yaw(0.0, -3.0, flags=NORTH), TURNING)

    for step in range(1, 60):
        rig.give(AUTOPILOT, vehicle_yaw(0.01 * step))
        rig.run(0.06, each=rig.heartbeats(PILOT))

    assert max(yaws(rig)[1:]) < -2.9
    assert yaws(rig)[-1] == pytest.approx(-limit)


@pytest.mark.parametrize('interval', [0.02, 0.1, 3.0])
@pytest.mark.parametrize('limit', [1.0, 1.5, 3.14159])
def test_gm_22_a_rate_ends_at_the_stop_of_a_device_that_takes_no_rates(
        limit: float, interval: float) -> None:
    rig = in_control(device_id=1, ranges=(Range(), Range(-1.0, 1.0), Range(-limit, limit)))
    rig.give(PILOT, pitch_yaw(0.1, limit - 0.1))

    def turn(rate: float, seconds: float) -> None:
        until = rig.now + seconds
        while rig.now < until - 1e-6:
            rig.give(PILOT, pitch_yaw(pitch_rate=0.0, yaw_rate=rate))
            rig.run(min(interval, until - rig.now), each=rig.heartbeats(PILOT))

    turn(0.5, 6.0)
    assert yaws(rig)[-1] == max(yaws(rig)) == pytest.approx(limit)
    assert min(yaws(rig)) > limit - 0.2
    assert [(axis, end) for axis, _, end in clipped(rig)][-1:] == [('yaw', round(limit, 4))]
    status = rig.messages(GimbalDeviceAttitudeStatus)[-1]
    assert status.failure_flags == mavlink.GIMBAL_DEVICE_ERROR_FLAGS_AT_YAW_LIMIT

    turn(-0.5, 1.0)
    assert yaws(rig)[-1] == pytest.approx(limit - 0.5, abs=0.03)
    rig.give(PILOT, configure(-3, -3))
    stopped = yaws(rig)[-1]
    rig.run(2.0)
    assert yaws(rig)[-1] == stopped == pytest.approx(limit - 0.5, abs=0.03)


def test_gm_22_the_manager_answers_for_a_device_without_mavlink() -> None:
    rig = ManagerRig(**SERVO)

    [_, device], [_, manager] = (
        rig.give(PILOT, request(cls)) for cls in (GimbalDeviceInformation,
                                                  GimbalManagerInformation))
    rig.manager.receive_attitude((flip(Quaternion(*HALF)), YawFrame.VEHICLE), rig.now)
    rig.give(PILOT)

    assert (device.gimbal_device_id, manager.gimbal_device_id) == (1, 1)
    assert (manager.roll_max, manager.pitch_min, manager.yaw_max) == (0.0, -1.5, 2.0)
    assert not manager.cap_flags & mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_ROLL_AXIS
    assert manager.cap_flags & mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_PITCH_AXIS
    assert manager.cap_flags & mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_FOLLOW
    status = rig.messages(GimbalDeviceAttitudeStatus)[-1]
    assert (status.gimbal_device_id, status.q) == (1, HALF)


def test_gm_22_a_limit_that_neutral_leaves_is_not_reported_any_more() -> None:
    rig = in_control(**SERVO)
    flags = []
    for setpoint in (pitch_yaw(1.0, 0.0), pitch_yaw(flags=NEUTRAL)):
        rig.give(PILOT, setpoint)
        rig.manager.receive_attitude((Quaternion(), YawFrame.VEHICLE), rig.now)
        rig.give(PILOT)
        flags.append(rig.messages(GimbalDeviceAttitudeStatus)[-1].failure_flags)

    assert flags == [mavlink.GIMBAL_DEVICE_ERROR_FLAGS_AT_PITCH_LIMIT, 0]


# GM-20, GM-23: the device and the vehicle

def test_gm_20_the_attitude_of_the_device_is_not_sent_again() -> None:
    rig = ManagerRig()

    rig.give(DEVICE, attitude_status(HALF))

    assert rig.messages(GimbalDeviceAttitudeStatus) == []


def test_the_device_gets_the_state_of_an_autopilot_that_sends_it_to_no_gimbal() -> None:
    rig = ManagerRig()
    # It has no velocity that is not finite.
    rig.manager.vehicle.set_velocity((NAN, 0.0, 0.0), rig.now)

    [message] = of(AutopilotStateForGimbalDevice, rig.give(AUTOPILOT, vehicle_yaw(0.5)))

    assert (message.target_system, message.target_component) == DEVICE
    assert Quaternion(*message.q).euler() == pytest.approx((0.0, 0.0, 0.5))
    assert message.estimator_status == ESTIMATES_ATTITUDE


@pytest.mark.parametrize('value', [NAN, math.inf])
@pytest.mark.parametrize('name', ['roll', 'pitch', 'yaw', 'yawspeed'])
def test_an_attitude_of_the_vehicle_that_is_not_finite_is_ignored(
        name: str, value: Any) -> None:
    rig = ManagerRig()

    assert rig.give(AUTOPILOT, replaced(vehicle_yaw(0.5), **{name: value})) == []

    assert rig.manager.vehicle.heading(rig.now) is None


@pytest.mark.parametrize('autopilot_sends', [False, True])
def test_the_device_gets_the_vehicles_state_from_ros_where_no_autopilot_sends_it(
        autopilot_sends: bool) -> None:
    rig = ManagerRig()
    vehicle = rig.manager.vehicle
    vehicle.set_velocity((1.0, 2.0, 3.0), rig.now)
    vehicle.attitude.set((Q, 0.4), rig.now)
    if autopilot_sends:
        rig.give(AUTOPILOT, AutopilotStateForGimbalDevice(
            *DEVICE, 0, HALF, 0, 0.0, 0.0, 0.0, 0, 0.0, 0, 0))

    for _ in range(3):
        rig.manager.vehicle_changed(rig.now)
    rig.give(PILOT)

    assert [(one.q, one.vx, one.vy, one.vz, one.angular_velocity_z)
            for one in rig.messages(AutopilotStateForGimbalDevice)] == [
        (Q, 1.0, 2.0, 3.0, 0.4)] * (not autopilot_sends)


# A forged address

@pytest.mark.parametrize(('second', 'after', 'shared'), [
    (mavlink.MAV_TYPE_GCS, 0.5, False), (mavlink.MAV_TYPE_SUBMARINE, 0.5, True),
    # The player was restarted as another program.
    (mavlink.MAV_TYPE_SUBMARINE, IDENTITY_TIME, False)])
def test_two_senders_with_the_address_of_the_player_in_control_are_reported(
        second: int, after: float, shared: bool) -> None:
    rig = in_control(control=ControlSettings(lease=60.0))
    rig.give(PILOT, mav.heartbeat(mavlink.MAV_TYPE_GCS))

    rig.run(after)
    rig.give(PILOT, mav.heartbeat(second))

    assert of(AddressShared, rig.events) == [AddressShared(PILOT)] * shared


# States

def test_commands_are_rejected_for_now_until_the_manager_is_active() -> None:
    rig = ManagerRig(active=False)
    rig.run(1.0)

    assert rig.manager.tracker.state is ManagerState.LISTENING
    assert rig.take(PILOT) == LATER
    for command in (pitch_yaw_command(1, 1), region(47.1, 8.0, 0.0)):
        assert rig.result(PILOT, command) == LATER
    assert rig.messages(GimbalManagerStatus) == []
    assert refusals(rig) == ['the manager is not active: listening'] * 2


def test_the_manager_follows_a_device_that_is_exchanged() -> None:
    rig = in_control()
    rig.points(PILOT)
    rig.device_is_there = False
    rig.run(3.5, each=rig.heartbeats(PILOT))
    assert rig.manager.tracker.state is ManagerState.NO_DEVICE

    rig.device_information = information(pitch_max=0.25)
    rig.device_is_there = True
    begun = rig.now
    rig.run(5.0, each=rig.heartbeats(PILOT))

    [told] = of(GimbalManagerInformation, rig.give(PILOT, request(GimbalManagerInformation)))
    assert told.pitch_max == 0.25
    assert rig.messages(GimbalDeviceSetAttitude, begun) == []
    assert len(rig.points(PILOT)) == 1
