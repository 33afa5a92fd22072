# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Messages that describe the state of a vehicle or of a mount, for several payloads."""

from __future__ import annotations

import math
from typing import NamedTuple

from ..mavlink.dialect import mavlink

SystemTime = mavlink.MAVLink_system_time_message
Attitude = mavlink.MAVLink_attitude_message
GlobalPositionInt = mavlink.MAVLink_global_position_int_message
GimbalDeviceAttitudeStatus = mavlink.MAVLink_gimbal_device_attitude_status_message


class GeoPoint(NamedTuple):
    """
    A place.

    :param latitude: and longitude, deg.
    :param altitude: m above mean sea level.
    """

    latitude: float
    longitude: float
    altitude: float


# rad/s; no vehicle and no mount turns faster.
FASTEST_RATE = 100.0


def is_angle(angle: float) -> bool:
    """Return whether an angle in rad can be right: two turns at most, and not NaN."""
    return abs(angle) <= 2 * math.tau


def is_rate(rate: float) -> bool:
    """Return whether an angular velocity in rad/s can be right; NaN cannot."""
    return abs(rate) <= FASTEST_RATE


def is_plausible(attitude: Attitude) -> bool:
    """Return whether all angles can be right."""
    return all(map(is_angle, (attitude.roll, attitude.pitch, attitude.yaw)))


def is_place(message: GlobalPositionInt) -> bool:
    """Return whether there is a position; autopilots send 0, 0 while they have no fix."""
    return (bool(message.lat or message.lon) and abs(message.lat) <= 900_000_000
            and abs(message.lon) <= 1_800_000_000)


def place_of(message: GlobalPositionInt) -> GeoPoint:
    """Return the position."""
    return GeoPoint(message.lat / 1e7, message.lon / 1e7, message.alt / 1e3)
