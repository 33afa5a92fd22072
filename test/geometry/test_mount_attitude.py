# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Attitudes of mounts in ROS and MAVLink, compared with scipy's rotations."""

from __future__ import annotations

import math

from hypothesis import example, given
from hypothesis import strategies as st
from illuminator_ros.geometry import mount_attitude as mount
from illuminator_ros.geometry.mount_attitude import MountAttitude, YawFrame
from illuminator_ros.geometry.rotation import Quaternion
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.payload.messages import GimbalDeviceAttitudeStatus
import pytest
from pytest import approx

Rotation = pytest.importorskip('scipy.spatial.transform').Rotation

EARTH, VEHICLE = (mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME,
                  mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME)
LOCK = mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
NAN = math.nan
# The change of axes between ENU and NED, and between FLU and FRD.
ENU_NED = Rotation.from_matrix([[0, 1, 0], [1, 0, 0], [0, 0, -1]]).as_matrix()
FLU_FRD = Rotation.from_matrix([[1, 0, 0], [0, -1, 0], [0, 0, -1]]).as_matrix()
AXES = {YawFrame.EARTH: ENU_NED, YawFrame.VEHICLE: FLU_FRD}

angles = st.floats(-math.pi, math.pi)
pitches = st.one_of(st.floats(-math.pi / 2, math.pi / 2),
                    st.sampled_from([-math.pi / 2, math.pi / 2]))
attitudes = st.builds(lambda *euler: Quaternion.from_euler(*euler), angles, pitches, angles)
frames = st.sampled_from(YawFrame)


def matrix(rotation: Quaternion | None) -> object:
    """Return the matrix that scipy makes of a quaternion."""
    assert rotation is not None
    return Rotation.from_quat(
        [rotation.x, rotation.y, rotation.z, rotation.w]).as_matrix()


def status(
    q: Quaternion, flags: int, *, rates: tuple[float, float, float] = (NAN,) * 3,
    delta_yaw: float = NAN,
) -> GimbalDeviceAttitudeStatus:
    return GimbalDeviceAttitudeStatus(
        0, 0, 1000, flags, q, *rates, 0, delta_yaw)


@pytest.mark.parametrize(('flags', 'frame'), [
    (0, YawFrame.VEHICLE), (LOCK, YawFrame.EARTH), (EARTH, YawFrame.EARTH),
    (VEHICLE, YawFrame.VEHICLE), (LOCK | EARTH, YawFrame.EARTH),
    (LOCK | VEHICLE, YawFrame.VEHICLE),
    (mavlink.GIMBAL_DEVICE_FLAGS_PITCH_LOCK, YawFrame.VEHICLE)])
def test_gm_2_yaw_frame_is_independent_of_the_lock_if_the_flags_name_it(
        flags: int, frame: YawFrame) -> None:
    assert mount.yaw_frame(flags) is frame
    assert mount.names_frame(frame.flag)
    assert mount.yaw_frame(frame.flag) is frame


def test_flags_that_name_both_frames_give_no_attitude() -> None:
    with pytest.raises(ValueError, match='both yaw frames'):
        MountAttitude.from_status(status(Quaternion(), EARTH | VEHICLE))


@given(attitudes, frames)
def test_gm_4_axes_are_changed_as_by_matrices(q: Quaternion, frame: YawFrame) -> None:
    ros = mount.from_mavlink(q, frame)

    assert matrix(ros) == approx(AXES[frame] @ matrix(q) @ FLU_FRD, abs=1e-9)
    back = Quaternion(*mount.to_mavlink(ros, frame))
    assert back.angle_to(q) == approx(0.0, abs=1e-7)


@given(attitudes, angles, frames, st.booleans())
@example(Quaternion.from_euler(0.0, -math.pi / 2, 1.0), 2.0, YawFrame.EARTH, True)
def test_gm_2_delta_yaw_gives_the_attitude_in_the_other_frame(
        q: Quaternion, heading: float, frame: YawFrame, reported: bool) -> None:
    # GIMBAL_DEVICE_ATTITUDE_STATUS: q_earth = q_delta_yaw * q_vehicle.
    turn = Rotation.from_euler('z', heading).as_matrix()
    other = YawFrame.VEHICLE if frame is YawFrame.EARTH else YawFrame.EARTH
    there = (turn.T if frame is YawFrame.EARTH else turn) @ matrix(q)
    attitude = MountAttitude.from_status(
        status(q, frame.flag, delta_yaw=heading if reported else NAN))

    assert matrix(attitude.seen_from(other, None if reported else heading)) == approx(
        AXES[other] @ there @ FLU_FRD, abs=1e-9)
    assert attitude.seen_from(frame) == attitude.rotation
    if not reported:
        assert attitude.seen_from(other) is None


@pytest.mark.parametrize('flags', [0, LOCK])
def test_delta_yaw_counts_only_beside_a_named_frame(flags: int) -> None:
    assert MountAttitude.from_status(status(Quaternion(), flags, delta_yaw=0.0)).heading is None


def test_a_heading_that_cannot_be_right_is_unknown() -> None:
    assert MountAttitude.from_status(status(Quaternion(), EARTH, delta_yaw=1e30)).heading is None


@pytest.mark.parametrize(('rates', 'ros'), [
    ((0.1, 0.2, 0.3), (0.1, -0.2, -0.3)), ((0.1, 0.2, NAN), None), ((NAN,) * 3, None),
    ((0.1, 1e30, 0.3), None)])
def test_rates_have_the_signs_of_ros_or_are_unknown(
        rates: tuple[float, float, float], ros: tuple[float, ...] | None) -> None:
    assert MountAttitude.from_status(status(Quaternion(), VEHICLE, rates=rates)).rates == ros


@pytest.mark.parametrize('q', [
    (NAN,) * 4, (1.0, 0.0, NAN, 0.0), (0.0,) * 4, (math.inf, 0.0, 0.0, 0.0),
    (1e30, 0.0, 0.0, 0.0), (0.1, 0.0, 0.0, 0.0)])
def test_quaternion_that_is_not_a_rotation_gives_no_attitude(
        q: tuple[float, float, float, float]) -> None:
    with pytest.raises(ValueError, match='not a rotation'):
        MountAttitude.from_status(status(Quaternion(*q), VEHICLE))


@given(attitudes, st.floats(0.5, 2.0))
def test_quaternion_is_normalised(q: Quaternion, norm: float) -> None:
    scaled = Quaternion(*(norm * value for value in q))

    rotation = MountAttitude.from_status(status(scaled, EARTH)).rotation

    assert math.hypot(*rotation) == approx(1.0)
    assert rotation.angle_to(mount.from_mavlink(q, YawFrame.EARTH)) == approx(0.0, abs=1e-6)
