# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Implausible angles and rates in messages of ROS."""

from __future__ import annotations

import math

import pytest

pytest.importorskip('rclpy')

from geometry_msgs.msg import Vector3, Vector3Stamped  # noqa: E402, I100
from illuminator_ros.geometry.mount_attitude import YawFrame  # noqa: E402
from illuminator_ros.gimbal.ros.conversions import Frames, read_rates  # noqa: E402
from std_msgs.msg import Header  # noqa: E402

FRAMES = Frames('map', 'vehicle')


def message(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Vector3Stamped:
    return Vector3Stamped(header=Header(frame_id='map'), vector=Vector3(x=x, y=y, z=z))


@pytest.mark.parametrize('angles', [
    (-3.1416, 1.571, 3.142), (math.nan, -1.5708, math.nan)])
def test_angles_of_one_turn_are_read_rounded_or_not(angles: tuple[float, float, float]) -> None:
    read, frame = FRAMES.read_angles(message(*angles))

    assert read == pytest.approx(angles, nan_ok=True)
    assert frame is YawFrame.EARTH


@pytest.mark.parametrize(('angles', 'reason'), [
    ((0.0, 2.0, 0.0), 'pitch 2 rad is beyond 1.5708 rad'),
    ((0.0, -45.0, 30.0), 'pitch -45 rad'), ((0.0, 0.0, 4.0), 'yaw 4 rad is beyond 3.1416 rad'),
    ((-4.0, 0.0, 0.0), 'roll -4 rad'), ((0.0, 0.0, math.inf), 'yaw inf rad')])
def test_angles_over_the_zenith_and_in_degrees_are_refused(
        angles: tuple[float, float, float], reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        FRAMES.read_angles(message(*angles))


def test_rates_of_more_than_one_turn_a_second_are_refused() -> None:
    assert read_rates(message(-6.28, 0.0, 6.28)) == (-6.28, 0.0, 6.28)
    for rate in (6.3, -30.0, 1e6, math.inf, math.nan):
        with pytest.raises(ValueError, match='yaw rate .* is not within 6.2832 rad/s'):
            read_rates(message(z=rate))
