# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Whether a gimbal points where it was asked to: a table of moves and attitudes."""

from __future__ import annotations

from dataclasses import replace
import math

from illuminator_ros.geometry.mount_attitude import MountAttitude, YawFrame
from illuminator_ros.geometry.rotation import Quaternion
from illuminator_ros.gimbal.commands import Attitude, Move, NEUTRAL, Rates, RETRACT
from illuminator_ros.gimbal.pointing import line_of_sight, off_target, Seen
from illuminator_ros.payload.messages import GeoPoint
import pytest

TOLERANCE = math.radians(2.0)
EARTH, VEHICLE = YawFrame.EARTH, YawFrame.VEHICLE
HOME = GeoPoint(47.397742, 8.545594, 488.0)
# About 100 m north and east of there, and as much lower as it is far.
NORTH, EAST = GeoPoint(47.398642, 8.545594, 488.0), GeoPoint(47.397742, 8.546920, 388.0)


def rotation(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return a rotation in ROS by angles in degrees."""
    return Quaternion.from_euler(*map(math.radians, (roll, pitch, yaw)))


def seen(
    roll: float, pitch: float, yaw: float, frame: YawFrame = VEHICLE,
    heading: float | None = None, **known: object,
) -> Seen:
    """Return what is known of a gimbal with these angles; heading: of the vehicle, degrees."""
    return replace(Seen(MountAttitude(
        rotation(roll, pitch, yaw), frame,
        heading=None if heading is None else math.radians(heading)),
        turns=False, position=HOME), **known)  # type: ignore[arg-type]


ASKED = Attitude(rotation(0, 45, 30), VEHICLE)
NOT_EAST = 'it is 90.0 degrees off'
NO_HEADING = 'the heading of the vehicle is unknown'


@pytest.mark.parametrize(('move', 'known', 'reason'), [
    pytest.param(None, seen(0, 0, 0), 'nothing is asked for', id='nothing'),
    pytest.param(Rates((0.0, 0.1, 0.0)), seen(0, 0, 0), 'nothing is asked for', id='rate'),
    pytest.param(ASKED, Seen(None), 'its attitude is unknown', id='no attitude'),

    pytest.param(ASKED, seen(0, 45, 30), '', id='attitude'),
    pytest.param(ASKED, seen(0, 43.1, 30), '', id='within the tolerance'),
    pytest.param(ASKED, seen(0, 42.9, 30), 'it is 2.1 degrees off', id='beyond it'),
    pytest.param(ASKED, seen(3, 45, 30), 'it is 3.0 degrees off', id='roll'),
    pytest.param(ASKED, seen(0, 45, 120, EARTH, 0.0), '', id='yaw in the other frame'),
    pytest.param(ASKED, seen(0, 45, 120, EARTH), 'its yaw relative to the vehicle is unknown',
                 id='yaw in the other frame without a heading'),
    pytest.param(Attitude(rotation(0, 90, 0), VEHICLE), seen(0, 90, 0), '', id='straight down'),
    pytest.param(Attitude(rotation(0, 0, 179), EARTH), seen(0, 0, -179.5, EARTH), '',
                 id='across half a turn'),

    pytest.param(NORTH, seen(0, 0, 90, EARTH), '', id='place in the north'),
    pytest.param(NORTH, seen(20, 0, 90, EARTH), '', id='place, with a roll'),
    pytest.param(NORTH, seen(0, 0, 0, EARTH), NOT_EAST, id='place in the north, looking east'),
    pytest.param(EAST, seen(0, 45, 0, EARTH), '', id='place in the east, lower'),
    pytest.param(EAST, seen(0, 45, -90, VEHICLE, 0.0), '', id='to the right of north'),
    pytest.param(EAST, seen(0, 45, 0), NO_HEADING, id='heading unknown'),
    pytest.param(EAST, seen(0, 45, 0, position=None), NO_HEADING, id='neither is known'),
    pytest.param(EAST, seen(0, 45, 0, EARTH, position=None),
                 'the position of the vehicle is unknown', id='position unknown'),
    pytest.param(HOME, seen(0, 90, 0, EARTH), 'the place is where the vehicle is', id='here'),

    pytest.param(NEUTRAL, seen(0, 0, 0, flags=NEUTRAL.flag), '', id='pose'),
    pytest.param(NEUTRAL, seen(0, 0, 0, flags=NEUTRAL.flag, asked_ago=0.5), 'it may still turn',
                 id='pose that was just asked for'),
    pytest.param(NEUTRAL, seen(0, 0, 0, flags=NEUTRAL.flag, turns=True), 'it may still turn',
                 id='pose, turning'),
    pytest.param(NEUTRAL, seen(0, 0, 0, flags=NEUTRAL.flag, turns=None), 'it may still turn',
                 id='pose, motion unknown'),
    pytest.param(RETRACT, seen(0, 0, 0, flags=NEUTRAL.flag),
                 'its status shows neutral', id='another pose')])
def test_gimbal_is_on_target_only_where_its_attitude_shows_that(
        move: Move, known: Seen, reason: str) -> None:
    assert off_target(move, known, TOLERANCE) == reason


def test_heading_of_the_vehicle_serves_a_gimbal_that_reports_none() -> None:
    known = replace(seen(0, 45, -90), heading=0.0)

    assert off_target(EAST, known, TOLERANCE) == ''


@pytest.mark.parametrize(('place', 'pitch', 'yaw'), [
    (NORTH, 0.0, 90.0), (EAST, 45.0, 0.0),
    # Two degrees of latitude away: the horizon curves.
    (GeoPoint(49.397742, 8.545594, 488.0), 1.0, 90.0)])
def test_line_of_sight_has_the_place_ahead(place: GeoPoint, pitch: float, yaw: float) -> None:
    line = line_of_sight(HOME, place)

    assert line is not None
    _, down, left = map(math.degrees, line.euler())
    assert (down, left) == pytest.approx((pitch, yaw), abs=0.1)
