# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The axes of a gimbal: their ranges, and the flags of each in the order of AXES."""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

from .messages import GimbalDeviceInformation, GimbalManagerInformation
from ..geometry.mount_attitude import AXES
from ..mavlink.dialect import mavlink


def _flags(name: str) -> tuple[int, int, int]:
    """Return the flag of each axis."""
    roll, pitch, yaw = (getattr(mavlink, name.replace('AXIS', axis.upper(), 1)) for axis in AXES)
    return roll, pitch, yaw


HAS_AXIS = _flags('GIMBAL_DEVICE_CAP_FLAGS_HAS_AXIS_AXIS')
HAS_FOLLOW = _flags('GIMBAL_DEVICE_CAP_FLAGS_HAS_AXIS_FOLLOW')
HAS_LOCK = _flags('GIMBAL_DEVICE_CAP_FLAGS_HAS_AXIS_LOCK')
LOCKS = _flags('GIMBAL_DEVICE_FLAGS_AXIS_LOCK')
AT_LIMIT = _flags('GIMBAL_DEVICE_ERROR_FLAGS_AT_AXIS_LIMIT')
# GIMBAL_DEVICE_ERROR_FLAGS of normal operation, which show no defect.
CONDITIONS = (sum(AT_LIMIT) | mavlink.GIMBAL_DEVICE_ERROR_FLAGS_CALIBRATION_RUNNING
              | mavlink.GIMBAL_DEVICE_ERROR_FLAGS_NO_MANAGER)
# Roll and pitch are relative to the horizon.
LEVEL = mavlink.GIMBAL_DEVICE_FLAGS_ROLL_LOCK | mavlink.GIMBAL_DEVICE_FLAGS_PITCH_LOCK
# rad; angles that differ by less are equal.
RESOLUTION = 1e-6
# rad/s above which an axis turns.
TURNING = 0.01
# rad/s, one turn a second; a player that sends a greater rate probably sends degrees.
RATE_LIMIT = math.tau


class Range(NamedTuple):
    """The range of an axis, rad; an unknown end is infinite."""

    low: float = -math.inf
    high: float = math.inf

    @property
    def is_fixed(self) -> bool:
        """Whether the axis cannot turn."""
        return self.low == self.high

    @property
    def is_endless(self) -> bool:
        """Whether the range is a full turn, which has no stop."""
        return self.high - self.low >= math.tau - RESOLUTION

    def clip(self, angle: float) -> float:
        """Return the nearest angle within the range."""
        return min(max(angle, self.low), self.high)


# The ranges of roll, of pitch, and of yaw relative to the vehicle.
Ranges: TypeAlias = tuple[Range, Range, Range]
UNLIMITED: Ranges = (Range(), Range(), Range())


def read_capabilities(message: GimbalManagerInformation | GimbalDeviceInformation) -> int:
    """Return the capabilities in a message, 0 where unknown."""
    # The extension has those of managers, too.
    return int(message.cap_flags | getattr(message, 'cap_flags2', 0))


def read_ranges(message: GimbalManagerInformation | GimbalDeviceInformation) -> Ranges:
    """Return the ranges in a message as they are; an unknown end may be NaN."""
    return (Range(message.roll_min, message.roll_max), Range(message.pitch_min, message.pitch_max),
            Range(message.yaw_min, message.yaw_max))


def known_ranges(message: GimbalManagerInformation | GimbalDeviceInformation) -> Ranges:
    """
    Return the ranges in a message as far as they have a meaning; an axis that is lacking is at 0.

    An end that is not finite is unknown. If the ends of a range are swapped, both are unknown, and
    so are those of an axis with a range of 0 to 0: the device does not report its limits.
    """
    capabilities = read_capabilities(message)

    def known(read: Range, flag: int) -> Range:
        if capabilities and not capabilities & flag:
            return Range(0.0, 0.0)
        range_ = Range(read.low if math.isfinite(read.low) else -math.inf,
                       read.high if math.isfinite(read.high) else math.inf)
        return Range() if range_.low > range_.high or range_ == (0.0, 0.0) else range_

    roll, pitch, yaw = map(known, read_ranges(message), HAS_AXIS)
    return roll, pitch, yaw


def range_fields(ranges: Ranges) -> dict[str, float]:
    """Return the fields roll_min to yaw_max of an INFORMATION message."""
    return {f'{axis}_{end}': value if math.isfinite(value) else math.nan
            for axis, range_ in zip(AXES, ranges, strict=True)
            for end, value in zip(('min', 'max'), range_, strict=True)}


def other_signs(axis: str, range_: Range) -> Range:
    """Return a range of MAVLink with the signs of ROS, or the reverse: pitch and yaw differ."""
    low, high = range_
    # Adding 0 turns a negative zero into 0.
    return range_ if axis == 'roll' else Range(-high + 0.0, -low + 0.0)
