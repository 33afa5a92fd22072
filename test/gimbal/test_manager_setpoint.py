# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Setpoints of a gimbal: conversions against independent ones, mixing, limits, directions."""

from __future__ import annotations

import math
from typing import Any

from hypothesis import assume, example, given
from hypothesis import strategies as st
from illuminator_ros.geometry.mount_attitude import AXES, STILL, YawFrame
from illuminator_ros.geometry.rotation import Quaternion, Vector
from illuminator_ros.gimbal.axes import known_ranges, Range, UNLIMITED
from illuminator_ros.gimbal.manager_setpoint import (
    clip,
    Clipped,
    direction,
    Setpoint,
    turned,
    turned_by,
)
from illuminator_ros.payload.messages import GeoPoint
import pytest
from support.gimbal_manager import information

Rotation = pytest.importorskip('scipy.spatial.transform').Rotation
ANGLES = st.floats(-math.pi, math.pi)
PITCHES = st.floats(-math.pi / 2, math.pi / 2) | st.sampled_from((-math.pi / 2, math.pi / 2))
ATTITUDES = st.tuples(ANGLES, PITCHES, ANGLES)
RANGES = st.tuples(*(st.tuples(st.floats(-3, 0), st.floats(0, 3)).map(lambda ends: Range(*ends))
                     for _ in range(3)))


def made_of(angles: Vector, turning: Vector = STILL) -> Setpoint:
    return Setpoint(angles=angles, turning=turning)


def scipy(attitude: Quaternion) -> Any:
    return Rotation.from_quat((attitude.x, attitude.y, attitude.z, attitude.w))


def apart(attitude: Quaternion, other: Any) -> float:
    """Return the angle between two rotations, rad."""
    return float((scipy(attitude).inv() * other).magnitude())


@given(st.floats(-1, 1), PITCHES, ANGLES)
def test_gm_4_pitch_and_yaw_become_the_quaternion_that_another_program_makes(
        roll: float, pitch: float, yaw: float) -> None:
    setpoint = Setpoint(angles=(roll, pitch, yaw)).resolved(STILL, 0.0, turns=False)

    assert setpoint.attitude is not None
    assert apart(setpoint.attitude, Rotation.from_euler('ZYX', (yaw, pitch, roll))) < 1e-6


@given(ATTITUDES, ANGLES)
def test_gm_2_another_yaw_frame_is_a_turn_about_the_down_axis(
        angles: tuple[float, float, float], heading: float) -> None:
    turned = turned_by(angles, heading)

    assert apart(Quaternion.from_euler(*turned), Rotation.from_euler('z', heading) * scipy(
        Quaternion.from_euler(*angles))) < 1e-6


@given(ATTITUDES, ATTITUDES)
def test_gm_9_offsets_add_to_the_angles(angles: Vector, offsets: Vector) -> None:
    assume(abs(angles[1] + offsets[1]) < math.pi / 2)

    mixed, clipped = clip(made_of(angles), UNLIMITED, 0.0, offsets)

    assert clipped == ()
    for angle, offset, sum_ in zip(angles, offsets, mixed, strict=True):
        assert math.remainder(angle + offset - sum_, math.tau) == pytest.approx(0.0, abs=1e-9)


@given(ATTITUDES, st.floats(0.0, 1.0))
def test_gm_9_an_offset_is_the_angle_or_the_limit_where_that_is_smaller(
        angles: tuple[float, float, float], limit: float) -> None:
    for angle, offset in zip(angles, Setpoint(angles=angles).offsets(limit), strict=True):
        assert abs(offset) == min(abs(angle), limit)
        assert offset * angle >= 0


@example((0.0, 0.0, 0.5), (Range(-1.0, 1.0),) * 3, 2.0)
@given(ATTITUDES, RANGES, st.none() | ANGLES)
def test_a_clipped_attitude_is_within_all_ranges_and_its_violations_are_named(
        angles: tuple[float, float, float], ranges: tuple[Range, Range, Range],
        zero: float | None) -> None:
    (roll, pitch, yaw), clipped = clip(made_of(angles), ranges, zero)

    assert ranges[0].clip(roll) == roll
    assert ranges[1].clip(pitch) == pitch
    assert zero is None or ranges[2].clip(yaw - zero) == pytest.approx(yaw - zero, abs=1e-9)
    # Only an angle that is named differs, whole turns and rounding aside.
    for axis, before, after in zip(AXES, angles, (roll, pitch, yaw), strict=True):
        is_named = axis in [one.axis for one in clipped]
        assert (abs(math.remainder(after - before, math.tau)) > 1e-5) is is_named
    assert clip(made_of((roll, pitch, yaw)), ranges, zero)[1] == ()


@pytest.mark.parametrize(('yaw', 'range_', 'limit'), [
    (3.0, Range(-2.0, 2.0), 2.0), (-3.0, Range(-2.0, 2.0), -2.0), (-2.0, Range(0.0, 5.0), -2.0),
    (3.0, Range(-math.pi, math.pi), 3.0), (3.0, Range(), 3.0), (0.4, Range(0.0, 0.0), 0.0)])
def test_a_yaw_is_clipped_to_the_nearer_end_of_its_range(
        yaw: float, range_: Range, limit: float) -> None:
    inside, _ = clip(made_of((0.0, 0.1, yaw)), (Range(), Range(), range_), 0.0)

    assert inside[:2] == pytest.approx((0.0, 0.1))
    assert math.remainder(inside[2] - limit, math.tau) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(('end', 'degrees', 'expected'), [
    (2.0, 4.0, 2.0), (2.0, 6.0, -2.0), (-2.0, -4.0, -2.0), (-2.0, -6.0, 2.0)])
def test_a_clipped_yaw_stays_at_its_end_until_the_other_is_nearer_by_10_degrees(
        end: float, degrees: float, expected: float) -> None:
    behind = made_of((0.0, 0.0, math.pi + math.radians(degrees)))
    before = Clipped('yaw', end, end)

    _, [clipped] = clip(behind, (Range(), Range(), Range(-2.0, 2.0)), 0.0, before=[before])

    assert clipped.limit == expected


@pytest.mark.parametrize('heading', [-0.01, 0.0, 0.01])
def test_a_yaw_from_north_near_the_other_end_stays_at_its_stop_at_each_heading(
        heading: float) -> None:
    end = math.radians(179.0)
    behind = made_of((0.0, 0.0, heading + math.radians(181.5)))._replace(frame=YawFrame.EARTH)
    before = Clipped('yaw', end, end)

    _, [clipped] = clip(behind, (Range(), Range(), Range(-end, end)), heading, before=[before])

    assert clipped.limit == end


@example(Range(-3.14159, 3.14159), 1.0, 0.5, 0.0)
@given(st.tuples(st.floats(-3, 0), st.floats(0, 3)).map(lambda ends: Range(*ends)),
       st.floats(0, 1), st.floats(-1, -1e-3) | st.floats(1e-3, 1), ANGLES)
def test_a_turn_ends_at_a_stop_and_a_turn_back_begins_there(
        range_: Range, share: float, rate: float, ahead: float) -> None:
    ranges = Range(), Range(), range_
    begin = range_.low + share * (range_.high - range_.low)
    setpoint = made_of((0.0, 0.1, begin + ahead), turning=(0.0, 0.0, rate))

    for now in range(1, 11):
        setpoint = turned(setpoint, float(now), ranges, ahead)

    end = range_.clip(begin + 10.0 * rate)
    assert setpoint.angles == pytest.approx((0.0, 0.1, end + ahead), abs=1e-9)
    _, clipped = clip(setpoint, ranges, ahead)
    further = abs(range_.clip(end + rate) - end)
    assume(not 0 < further < 1e-4)
    assert [one.axis for one in clipped] == ['yaw'] * (further == 0)
    back = turned(setpoint._replace(turning=(0.0, 0.0, -rate)), 11.0, ranges, ahead)
    assert back.angles == pytest.approx(
        (0.0, 0.1, range_.clip(end - rate) + ahead), abs=1e-9)


@pytest.mark.parametrize(('low', 'high', 'expected'), [
    (-0.5, 0.4, Range(-0.5, 0.4)), (math.inf, -math.inf, Range()), (0.5, -0.5, Range()),
    (math.nan, 0.4, Range(high=0.4)), (-0.5, math.inf, Range(low=-0.5)), (0.0, 0.0, Range()),
    (0.0, 0.4, Range(0.0, 0.4))])
def test_gm_12_the_range_that_a_device_reports_is_unknown_where_it_has_no_meaning(
        low: float, high: float, expected: Range) -> None:
    assert known_ranges(information(yaw_min=low, yaw_max=high))[2] == expected


@given(st.floats(-70, 70), st.floats(-180, 180), ANGLES, st.floats(20, 5000),
       st.floats(-1000, 1000))
def test_gm_8_the_direction_to_a_place_is_its_bearing_and_elevation_on_the_curved_earth(
        latitude: float, longitude: float, bearing: float, distance: float, up: float) -> None:
    here = GeoPoint(latitude, longitude, 500.0)
    # The radii of curvature of WGS 84 along the meridian and across it, m.
    flattened = 1 - 6.694e-3 * math.sin(math.radians(latitude)) ** 2
    along, across = 6335439 / flattened ** 1.5, 6378137 / math.sqrt(flattened)
    there = GeoPoint(
        latitude + math.degrees(distance * math.cos(bearing) / along),
        longitude + math.degrees(
            distance * math.sin(bearing) / across / math.cos(math.radians(latitude))),
        here.altitude + up)

    angles = direction(here, there)

    assert angles is not None
    drop = distance ** 2 / 2 / 6.37e6
    assert angles[0] == pytest.approx(math.atan2(up - drop, distance), abs=math.radians(0.1))
    assert math.remainder(angles[1] - bearing, math.tau) == pytest.approx(
        0.0, abs=math.radians(0.1))


def test_gm_8_the_same_place_has_no_direction_and_that_over_a_pole_is_ahead() -> None:
    assert direction(GeoPoint(47.0, 180.0, 0.0), GeoPoint(47.0, -180.0, 0.05)) is None
    assert direction(GeoPoint(89.999, 0.0, 0.0), GeoPoint(89.999, 180.0, 0.0)) == pytest.approx(
        (0.0, 0.0), abs=1e-3)


@given(ATTITUDES)
def test_gm_4_a_turn_in_steps_ends_where_a_turn_at_once_ends(angles: Vector) -> None:
    assume(abs(angles[1]) < 1.2)
    moving = made_of(angles, turning=(0.0, 0.1, -0.2))

    half = turned(moving, 1.0, UNLIMITED, 0.0)
    end = turned(half, 2.0, UNLIMITED, None).angles

    assert end[:2] == pytest.approx((angles[0], angles[1] + 0.2))
    assert math.remainder(end[2] - angles[2] + 0.4, math.tau) == pytest.approx(0.0, abs=1e-9)
