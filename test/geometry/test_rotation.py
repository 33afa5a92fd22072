# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Rotations, compared with scipy's."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st
from illuminator_ros.geometry.rotation import (
    enu_flu,
    enu_ned,
    flip,
    flu_frd,
    ned_frd,
    Quaternion,
    Vector,
)
import pytest
from scipy.spatial.transform import Rotation

ENU_TO_NED = Rotation.from_matrix([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
FLU_TO_FRD = Rotation.from_matrix([[1, 0, 0], [0, -1, 0], [0, 0, -1]])

angles = st.floats(-math.pi, math.pi)
# Straight up and down, exactly and nearly.
vertical = st.builds(lambda tilt, sign: sign * (math.pi / 2 - tilt),
                     st.just(0.0) | st.floats(0.0, 1e-5) | st.floats(0.0, 1e-2),
                     st.sampled_from((-1.0, 1.0)))
quaternions = st.builds(Quaternion.from_euler, angles, vertical | angles, angles)
vectors = st.tuples(*[st.floats(-10, 10)] * 3)


def oracle(q: Quaternion) -> Rotation:
    return Rotation.from_quat([q.x, q.y, q.z, q.w])


def distance(q: Quaternion, expected: Rotation) -> float:
    return float((oracle(q).inv() * expected).magnitude())


@given(quaternions, quaternions, vectors)
def test_composition_inverse_and_vectors_are_those_of_scipy(
        one: Quaternion, other: Quaternion, vector: Vector) -> None:
    assert distance(one * other, oracle(one) * oracle(other)) < 1e-6
    assert distance(one.inverse(), oracle(one).inv()) < 1e-6
    assert one.rotate(vector) == pytest.approx(oracle(one).apply(vector), abs=1e-9)
    assert one.angle_to(other) == pytest.approx(
        (oracle(one).inv() * oracle(other)).magnitude(), abs=1e-6)


@given(angles, vertical | angles, angles)
def test_angles_are_those_of_scipy_and_make_the_same_rotation_again(
        roll: float, pitch: float, yaw: float) -> None:
    q = Quaternion.from_euler(roll, pitch, yaw)

    read = q.euler()

    assert distance(q, Rotation.from_euler('ZYX', (yaw, pitch, roll))) < 1e-6
    assert abs(read[1]) <= math.pi / 2
    assert read[0] == 0 or abs(read[1]) < math.pi / 2
    assert Quaternion.from_euler(*read).angle_to(q) < 2e-6


@given(quaternions, vectors)
def test_frames_of_ros_and_mavlink_are_converted_there_and_back(
        q: Quaternion, vector: Vector) -> None:
    assert distance(ned_frd(q), ENU_TO_NED * oracle(q) * FLU_TO_FRD.inv()) < 1e-6
    assert enu_flu(ned_frd(q)).angle_to(q) < 1e-6
    assert distance(flip(q), FLU_TO_FRD * oracle(q) * FLU_TO_FRD.inv()) < 1e-6
    assert enu_ned(vector) == pytest.approx(ENU_TO_NED.apply(vector), abs=1e-9)
    assert flu_frd(vector) == pytest.approx(FLU_TO_FRD.apply(vector), abs=1e-9)


@pytest.mark.parametrize('q', [
    Quaternion(0, 0, 0, 0), Quaternion(math.nan, 0, 0, 0), Quaternion(math.inf, 0, 0, 1)])
def test_a_quaternion_without_direction_is_refused(q: Quaternion) -> None:
    with pytest.raises(ValueError, match='is not a rotation'):
        q.normalized()
