# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Conversions between ROS and the camera, compared with scipy's rotations."""

from __future__ import annotations

from dataclasses import replace
import math
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from illuminator_ros.geometry.rotation import flip, Quaternion, Vector
from illuminator_ros.mavlink.dialect import decode, encode
from illuminator_ros.payload.messages import Attitude, GlobalPositionInt
from illuminator_ros.rededge import conversions
from illuminator_ros.rededge.conversions import MountFrame, Position
from illuminator_ros.rededge.messages import CameraFeedback, GpsRawInt, MountStatus
import pytest
from scipy.spatial.transform import Rotation

UTC = 1_700_000_000_123_456
HERE = Position(0, 47.3977421, 8.5455939, 535.5, 1.25, 2.5)
TARGET = (1, 100)
ENU_TO_NED = Rotation.from_matrix([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
FLU_TO_FRD = Rotation.from_euler('x', 180, degrees=True)
# x right, y down, z out of the lens, in a body with x out of the lens, y left, z up.
OPTICAL = Rotation.from_matrix([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
# The camera's axes at its zero pose, in the vehicle (FRD): x down, y right, z to the rear.
ZERO_POSE = Rotation.from_matrix([[0, 0, -1], [0, 1, 0], [1, 0, 0]])

angles = st.floats(-math.pi, math.pi)
# The singular pitches of the vehicle, 90 degrees, and of the mount, and their neighbours.
pitches = st.sampled_from((-90.0, 90.0, -89.999, 89.99, 0.0, 0.3, -1.0)).map(math.radians) | angles
rotations = st.builds(Quaternion.from_euler, angles, pitches, angles)
anything = st.floats(allow_nan=True, allow_infinity=True)


def oracle(q: Quaternion) -> Rotation:
    return Rotation.from_quat([q.x, q.y, q.z, q.w])


def quaternion(rotation: Rotation) -> Quaternion:
    x, y, z, w = rotation.as_quat()
    return Quaternion(w, x, y, z)


def error(one: Rotation, other: Rotation) -> float:
    """Return the angle between two rotations, degrees."""
    return math.degrees((one.inv() * other).magnitude())


def mount(gimbal_pitch: float, gimbal_yaw: float) -> Quaternion:
    """Return a mount in ROS from a gimbal's pitch up and yaw right, degrees."""
    return quaternion(FLU_TO_FRD * Rotation.from_euler(
        'ZYX', [gimbal_yaw, gimbal_pitch, 0], degrees=True) * FLU_TO_FRD)


def recomposed(status: MountStatus) -> Rotation:
    """Return the camera's axes in the vehicle, as the manufacturer composes them."""
    return ZERO_POSE * Rotation.from_euler('ZYX', [
        status.pointing_c / 100, status.pointing_a / 100, status.pointing_b / 100], degrees=True)


@pytest.mark.parametrize(('gimbal_pitch', 'gimbal_yaw', 'expected'), [
    (-90, 0, (0, 0, 0)), (-60, 0, (0, 30, 0)), (-45, 0, (0, 45, 0)), (-90, 30, (30, 0, 0)),
    (-90, -30, (-30, 0, 0)), (-60, 30, (33.69, 25.66, 16.10)), (-45, 30, (39.23, 37.76, 26.57)),
    (0, 0, (0, 90, 0))])
def test_mount_angles_are_those_of_the_camera_s_axes_re_24_re_25(
        gimbal_pitch: float, gimbal_yaw: float, expected: Vector) -> None:
    camera = mount(gimbal_pitch, gimbal_yaw)
    optical = quaternion(oracle(camera) * OPTICAL)

    assert conversions.mount_angles(camera, MountFrame.CAMERA) == pytest.approx(expected, abs=0.01)
    assert conversions.mount_angles(optical, MountFrame.OPTICAL) == pytest.approx(
        expected, abs=0.01)


def test_a_stabilised_camera_counter_rotates_its_vehicle() -> None:
    vehicle = FLU_TO_FRD * Rotation.from_euler('ZYX', [40, -15, 10], degrees=True) * FLU_TO_FRD
    camera = FLU_TO_FRD * Rotation.from_euler('ZYX', [40, -90, 0], degrees=True) * FLU_TO_FRD

    assert conversions.mount_angles(
        quaternion(vehicle.inv() * camera), MountFrame.CAMERA) == pytest.approx(
            (0, 15, 10), abs=0.01)


@given(rotations, st.sampled_from(MountFrame))
def test_mount_status_recomposes_any_mount_within_its_own_step_re_22(
        body: Quaternion, frame: MountFrame) -> None:
    given_ = oracle(body) * OPTICAL if frame is MountFrame.OPTICAL else oracle(body)
    status = conversions.mount_status(
        conversions.mount_angles(quaternion(given_), frame), TARGET)

    # Three angles that are rounded to 0.01 degrees, about axes at right angles.
    assert error(recomposed(status), oracle(flip(body))) < 0.005 * math.sqrt(3) + 1e-4
    assert all(-18000 < value <= 18000 for value in (
        status.pointing_a, status.pointing_b, status.pointing_c))


def test_rounded_angles_do_not_add_up_where_roll_and_yaw_turn_about_one_axis_re_22() -> None:
    exact = ZERO_POSE * Rotation.from_euler('ZYX', [20.0052, 89.8, 10.0048], degrees=True)
    body = flip(quaternion(exact))

    status = conversions.mount_status(
        conversions.mount_angles(body, MountFrame.CAMERA), TARGET)

    assert error(recomposed(status), exact) < 0.006


@given(rotations)
def test_attitude_is_that_of_the_frd_body_in_ned_in_radians_re_20(body: Quaternion) -> None:
    sent = conversions.attitude(body, (0.1, 0.2, -0.3), 7)
    read = decode(Attitude, encode(sent))

    assert error(Rotation.from_euler('ZYX', [read.yaw, read.pitch, read.roll]),
                 ENU_TO_NED * oracle(body) * FLU_TO_FRD) < 0.002
    assert (read.rollspeed, read.pitchspeed, read.yawspeed) == pytest.approx((0.1, -0.2, 0.3))


def test_rates_that_are_not_known_are_sent_as_zero() -> None:
    sent = conversions.attitude(Quaternion(), (math.nan,) * 3, 7)
    assert (sent.rollspeed, sent.pitchspeed, sent.yawspeed) == (0, 0, 0)


def test_gps_raw_int_has_the_units_of_mavlink_and_the_height_above_the_sea_re_14_re_15() -> None:
    sent = conversions.gps_raw_int(HERE, UTC, (3.0, -4.0, 1.0), 14, 48.25)

    assert sent == GpsRawInt(UTC, 3, 473977421, 85455939, 487250, 125, 250, 500, 14313, 14)


def test_values_that_are_not_known_are_sent_as_unknown_re_15() -> None:
    sent = conversions.gps_raw_int(Position(0, 0.5, 0.5, 0.0), UTC, None, None, 0.0)
    assert (sent.eph, sent.epv, sent.vel, sent.cog, sent.satellites_visible) == (
        65535, 65535, 65535, 65535, 255)


@pytest.mark.parametrize(('velocity', 'speed', 'course'), [
    ((0.0, 5.0, 0.0), 500, 0), ((5.0, 0.0, 0.0), 500, 9000), ((-1e-6, 5.0, 0.0), 500, 0),
    ((-0.01, 5.0, 0.0), 500, 35989), ((0.2, 0.2, 0.0), 28, 65535),
    ((700.0, 0.0, 0.0), 65535, 9000), ((math.nan, 1.0, 0.0), 65535, 65535)])
def test_speed_and_course_have_their_ranges_re_15(
        velocity: Vector, speed: int, course: int) -> None:
    sent = conversions.gps_raw_int(HERE, UTC, velocity, 300, 0.0)
    assert (sent.vel, sent.cog, sent.satellites_visible) == (speed, course, 255)


@pytest.mark.parametrize(('status', 'fix'), [(0, 3), (1, 4), (2, 5)])
def test_each_fix_of_ros_is_a_fix_of_the_camera_re_16(status: int, fix: int) -> None:
    assert conversions.gps_raw_int(
        Position(status, 1, 1, 1), UTC, None, None, 0).fix_type == fix > 2


@pytest.mark.parametrize(('position', 'utc', 'reason'), [
    (Position(-1, 1, 1, 1), UTC, r'no fix \(status -1\)'),
    (Position(-2, 1, 1, 1), UTC, r'no fix \(status -2\)'),
    (Position(0, math.nan, 1, 1), UTC, 'latitude of ~/fix: nan deg is outside -90 to 90 deg'),
    (Position(0, 1, 180.1, 1), UTC, 'longitude of ~/fix: 180.1 deg'),
    (Position(0, 1, 1, math.nan), UTC, 'altitude of ~/fix'),
    (Position(0, 1, 1, 1e6), UTC, 'altitude of ~/fix'),
    (HERE, 1_419_999_999_000_000, 'UTC of ~/fix'), (HERE, 123_000_000, 'UTC of ~/fix')])
def test_a_position_that_cannot_be_true_is_not_sent_re_14_re_16_re_18(
        position: Position, utc: int, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        conversions.gps_raw_int(position, utc, None, None, 0.0)
    with pytest.raises(ValueError, match=reason):
        conversions.global_position_int(position, (0, 0, 0), 0.0, 7)
        conversions.system_time(utc, 7)


def test_global_position_int_has_ned_velocities_re_18() -> None:
    assert conversions.global_position_int(HERE, (3.0, -4.0, 1.5), 48.25, 7) == GlobalPositionInt(
        7, 473977421, 85455939, 487250, 0, -400, 300, -150, 65535)
    with pytest.raises(ValueError, match='velocity, north: nan m/s'):
        conversions.global_position_int(HERE, (0.0, math.nan, 0.0), 0.0, 7)


@given(st.builds(Position, st.integers(-128, 127), *[anything] * 5), st.integers(0, 2**63),
       st.none() | st.tuples(anything, anything, anything), st.none() | st.integers(0, 2**32 - 1))
def test_whatever_comes_either_fits_its_fields_or_is_refused(
        position: Position, utc: int, velocity: Any, satellites: int | None) -> None:
    try:
        sent = conversions.gps_raw_int(position, utc, velocity, satellites, 0.0)
    except ValueError:
        return
    assert len(encode(sent)) == 30


def test_standard_deviations_are_the_roots_of_the_variances() -> None:
    assert conversions.standard_deviations([4, 0, 0, 0, 9, 0, 0, 0, 16]) == (3, 4)
    for east, north in ((-1, -1), (4, -9), (-9, 4), (4, math.nan), (math.nan, 4)):
        horizontal, vertical = conversions.standard_deviations(
            [east, 0, 0, 0, north, 0, 0, 0, 1])
        assert math.isnan(horizontal)
        assert vertical == 1


def test_satellites_are_counted_and_no_single_one_is_invented_re_28() -> None:
    assert encode(conversions.gps_status(9)) == bytes([9]) + bytes(100)


def feedback(**changes: Any) -> CameraFeedback:
    return CameraFeedback(**{
        **dict.fromkeys(CameraFeedback.fieldnames, 0), 'lat': 473977421,
        'lng': 85455939, 'alt_msl': 487.25, **changes})


def test_position_of_an_image_is_above_the_ellipsoid() -> None:
    position = conversions.image_position(feedback(), 48.25)
    assert position is not None
    assert replace(position, horizontal=0.0, vertical=0.0) == Position(
        0, 47.3977421, 8.5455939, 535.5, 0.0, 0.0)
    assert math.isnan(position.horizontal)
    assert math.isnan(position.vertical)
    for nothing in ({'lat': 0, 'lng': 0}, {'lat': 900000001}, {'alt_msl': math.nan},
                    {'alt_msl': 1e30}, {'alt_msl': -1001.0}):
        assert conversions.image_position(feedback(**nothing), 0.0) is None


@given(rotations, rotations)
def test_attitude_of_an_image_is_that_of_vehicle_and_mount(
        vehicle: Quaternion, body: Quaternion) -> None:
    # The camera composes what it was sent; zero is straight down with the top to the north.
    status = conversions.mount_status(
        conversions.mount_angles(body, MountFrame.CAMERA), TARGET)
    earth = ENU_TO_NED * oracle(vehicle) * FLU_TO_FRD * recomposed(status) * ZERO_POSE.inv()
    found = {frame: conversions.image_attitude(seen(earth), frame) for frame in MountFrame}

    for frame, axes in ((MountFrame.CAMERA, Rotation.identity()), (MountFrame.OPTICAL, OPTICAL)):
        attitude = found[frame]
        assert attitude is not None
        assert error(oracle(attitude), oracle(vehicle) * oracle(body) * axes) < 0.01
    for wrong in ({'yaw': math.nan}, {'yaw': 1e30}, {'roll': -361.0}, {'pitch': math.inf}):
        assert conversions.image_attitude(feedback(**wrong), MountFrame.CAMERA) is None


def seen(earth: Rotation) -> CameraFeedback:
    # Our own angles: scipy warns at the singular pitch.
    roll, pitch, yaw = map(math.degrees, quaternion(earth).euler())
    return feedback(roll=roll, pitch=pitch, yaw=yaw % 360)
