# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Where a light on a gimbal points, compared with scipy's rotations."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st
from illuminator_ros.geometry.rotation import Quaternion, Vector
from illuminator_ros.illuminator.mount_orientation import (
    ATTITUDE_LIFETIME,
    MountOrientations,
)
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.payload.messages import Attitude, GimbalDeviceAttitudeStatus
import pytest
from pytest import approx

Rotation = pytest.importorskip('scipy.spatial.transform').Rotation

GIMBAL, AUTOPILOT = Address(1, 154), Address(1, 1)
NAN = math.nan
EARTH, VEHICLE = (mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME,
                  mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME)
angles = st.floats(-3.1, 3.1)
tilts = st.floats(-1.4, 1.4)


def status(
    euler: Vector, flags: int = VEHICLE, *, delta_yaw: float = NAN, number: int = 0,
) -> GimbalDeviceAttitudeStatus:
    """Return the status of a gimbal with roll, pitch and yaw in MAVLink, rad."""
    q = Quaternion.from_euler(*euler)
    return GimbalDeviceAttitudeStatus(
        0, 0, 0, flags, q, NAN, NAN, NAN, 0, delta_yaw, NAN, number)


def vehicle(roll: float, pitch: float, yaw: float) -> Attitude:
    return Attitude(0, roll, pitch, yaw, 0.0, 0.0, 0.0)


def pointed(mounts: MountOrientations, now: float = 0.0, device_id: int = 154) -> Vector | None:
    """Return the direction of the beam in the vehicle's body: ahead, left, up."""
    rotation = mounts.direction(1, device_id, now)
    return None if rotation is None else rotation.rotate((1.0, 0.0, 0.0))


@given(st.tuples(tilts, tilts, angles), st.tuples(tilts, tilts, angles), st.booleans())
def test_beam_points_where_the_gimbal_points_whatever_the_vehicle_does(
        gimbal: Vector, body: Vector, in_earth: bool) -> None:
    mounts = MountOrientations()
    mounts.receive(AUTOPILOT, vehicle(*body), 0.0)
    assert mounts.receive(GIMBAL, status(gimbal, EARTH if in_earth else VEHICLE), 0.0)

    # From the gimbal's axes to NED, then to those of the vehicle's body, FRD.
    in_ned = Rotation.from_euler('ZYX', gimbal[::-1])
    if not in_earth:
        in_ned = Rotation.from_euler('z', body[2]) * in_ned
    x, y, z = (Rotation.from_euler('ZYX', body[::-1]).inv() * in_ned).apply([1, 0, 0])

    assert pointed(mounts) == approx((x, -y, -z), abs=1e-9)


@pytest.mark.parametrize(('message', 'direction'), [
    (status((0.0, 0.0, 0.0)), (1, 0, 0)),
    (status((0.0, -math.pi / 2, 0.0)), (0, 0, -1)),
    (status((0.0, 0.0, math.pi / 2)), (0, -1, 0)),
    # The vehicle looks east, the gimbal north.
    (status((0.0, 0.0, 0.0), EARTH, delta_yaw=math.pi / 2), (0, 1, 0)),
    (status((0.0, 0.0, 0.0), EARTH), None),
    (status((NAN, 0.0, 0.0)), None),
    (status((0.0, 0.0, 0.0), EARTH | VEHICLE), None)])
def test_vehicle_without_attitude_counts_as_level_and_its_heading_must_be_known(
        message: GimbalDeviceAttitudeStatus, direction: Vector | None) -> None:
    mounts = MountOrientations()
    mounts.receive(GIMBAL, message, 0.0)

    assert pointed(mounts) == (None if direction is None else approx(direction, abs=1e-9))


@pytest.mark.parametrize('value', [NAN, math.inf, -math.inf])
def test_attitude_of_the_vehicle_that_is_not_a_rotation_is_ignored(value: float) -> None:
    mounts = MountOrientations()
    mounts.receive(GIMBAL, status((0.0, 0.0, 0.5)), 0.0)
    for body in ((value, 0.0, 0.0), (0.0, value, 0.0), (0.0, 0.0, value)):
        mounts.receive(AUTOPILOT, vehicle(*body), 0.0)
        assert pointed(mounts) == approx((math.cos(0.5), -math.sin(0.5), 0.0))


def test_direction_ends_with_the_attitude_and_belongs_to_one_gimbal() -> None:
    mounts = MountOrientations()
    mounts.receive(GIMBAL, status((0.0, 0.0, 0.0)), 0.0)
    mounts.receive(AUTOPILOT, status((0.0, -1.0, 0.0), number=2), 1.0)
    # Of another component than the autopilot.
    mounts.receive(GIMBAL, vehicle(1.0, 1.0, 1.0), 1.0)

    assert pointed(mounts, 1.9) == approx((1, 0, 0))
    assert pointed(mounts, ATTITUDE_LIFETIME) is None
    assert pointed(mounts, 1.9, device_id=2) == approx((math.cos(1), 0, -math.sin(1)))
    assert pointed(mounts, 1.9, device_id=171) is None
    assert mounts.direction(2, 154, 1.0) is None
