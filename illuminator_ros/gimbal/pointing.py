# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Whether a gimbal points where it was asked to, by the newest attitude. Pure functions."""

from __future__ import annotations

from dataclasses import dataclass
import math

from .commands import Attitude, describe_flags, Flag, Move
from .manager_setpoint import direction
from ..geometry.mount_attitude import MountAttitude, YawFrame
from ..geometry.rotation import Quaternion
from ..payload.messages import GeoPoint

# s from a request for a pose until a gimbal that stands has reached it: it has begun to turn.
POSE_DELAY = 1.0
NOTHING = 'nothing is asked for'


@dataclass(frozen=True)
class Seen:
    """
    The known state of a gimbal at one moment.

    :param attitude: None if it is unknown or out of date.
    :param flags: GIMBAL_DEVICE_FLAGS.
    :param turns: whether the attitudes show that it turns, None if they do not tell.
    :param position: of the vehicle, None if it is unknown.
    :param heading: of the vehicle, rad from north, for a gimbal that reports none; None likewise.
    :param asked_ago: s since it was asked for what it is asked for now.
    """

    attitude: MountAttitude | None
    flags: int = 0
    turns: bool | None = None
    position: GeoPoint | None = None
    heading: float | None = None
    asked_ago: float = math.inf


def off_target(move: Move, seen: Seen, tolerance: float) -> str:
    """
    Return why a gimbal does not show a move, for people; '' if it does.

    A gimbal of which something is unknown does not show it.

    :param tolerance: rad.
    """
    if not isinstance(move, Flag | Attitude | GeoPoint):
        return NOTHING
    if seen.attitude is None:
        return 'its attitude is unknown'
    if isinstance(move, Flag):
        return _off_pose(move, seen)
    if isinstance(move, Attitude):
        shown, wanted = seen.attitude.seen_from(move.frame, seen.heading), move.rotation
        if shown is None:
            return f'its yaw relative to the {move.frame.value} is unknown'
        return _apart(shown.angle_to(wanted), tolerance)
    shown = seen.attitude.seen_from(YawFrame.EARTH, seen.heading)
    if shown is None:
        return 'the heading of the vehicle is unknown'
    if seen.position is None:
        return 'the position of the vehicle is unknown'
    line = line_of_sight(seen.position, move)
    if line is None:
        return 'the place is where the vehicle is'
    # The roll does not move the line of sight.
    ahead, _, _ = (line.inverse() * shown).rotate((1.0, 0.0, 0.0))
    return _apart(math.acos(min(max(ahead, -1.0), 1.0)), tolerance)


def line_of_sight(origin: GeoPoint, place: GeoPoint) -> Quaternion | None:
    """Return the rotation in ENU that has a place ahead, None if both are at the same place."""
    angles = direction(origin, place)
    return angles and Quaternion.from_euler(0.0, -angles[0], math.pi / 2 - angles[1])


def _off_pose(pose: Flag, seen: Seen) -> str:
    # No message has the attitude of a pose.
    if not seen.flags & pose.flag:
        return f'its status shows {describe_flags(seen.flags)}'
    return '' if seen.turns is False and seen.asked_ago >= POSE_DELAY else 'it may still turn'


def _apart(angle: float, tolerance: float) -> str:
    return '' if angle <= tolerance else f'it is {math.degrees(angle):.1f} degrees off'
