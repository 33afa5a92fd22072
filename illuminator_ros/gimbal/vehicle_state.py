# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The state of the vehicle that carries a gimbal, from the link or from ROS."""

from __future__ import annotations

import math
from typing import Generic, TypeVar

from .messages import AutopilotStateForGimbalDevice
from ..geometry.rotation import Quaternion, Vector
from ..mavlink.messages import Address
from ..payload.messages import (
    Attitude,
    GeoPoint,
    GlobalPositionInt,
    is_place,
    is_plausible,
    is_rate,
    place_of,
)

T = TypeVar('T')

# s after which a value is out of date.
MAX_AGE = 1.0
# s for which AUTOPILOT_STATE_FOR_GIMBAL_DEVICE is not sent after an autopilot has sent it, and the
# shortest time between two that are sent.
AUTOPILOT_SILENCE = 2.0
AUTOPILOT_INTERVAL = 0.02
# ESTIMATOR_STATUS_FLAGS: attitude, and horizontal and vertical velocity.
ESTIMATES_ATTITUDE, ESTIMATES_VELOCITY = 1, 2 | 4


class _Latest(Generic[T]):
    """The latest values from the link and from ROS; the link's value takes precedence."""

    def __init__(self) -> None:
        # Of ROS, and of the link.
        self._values: list[tuple[T | None, float]] = [(None, -math.inf)] * 2

    def set(self, value: T, now: float, *, link: bool = False) -> None:  # noqa: A003
        self._values[link] = value, now

    def get(self, now: float) -> T | None:
        for value, at in reversed(self._values):
            if now < at + MAX_AGE:
                return value
        return None

    def is_of_ros(self, now: float) -> bool:
        """Return whether the value is one of ROS."""
        (_, at), (_, link_at) = self._values
        return link_at + MAX_AGE <= now < at + MAX_AGE


class VehicleState:
    """
    Attitude, velocity and position of the vehicle; NED and FRD. No I/O; times are s.

    Values of the link's autopilot take precedence over values from ROS. A value older than
    :data:`MAX_AGE` is unknown.

    :ivar attitude: with the rate about the down axis, rad/s, NaN if unknown.
    :ivar position: its place.
    :ivar home_altitude: of the home position, m above mean sea level, None if unknown.
    """

    def __init__(self) -> None:
        self.attitude: _Latest[tuple[Quaternion, float]] = _Latest()
        self._velocity: _Latest[Vector] = _Latest()
        self.position: _Latest[GeoPoint] = _Latest()
        self.home_altitude: float | None = None
        self._autopilot_at = self._sent_at = -math.inf

    def receive(self, message: Attitude | GlobalPositionInt, now: float) -> None:
        """Receive a message of the autopilot; ignore impossible values, or no position."""
        if isinstance(message, Attitude):
            if is_plausible(message) and is_rate(message.yawspeed):
                self.attitude.set((Quaternion.from_euler(
                    message.roll, message.pitch, message.yaw), message.yawspeed), now, link=True)
        elif is_place(message):
            self.position.set(place_of(message), now, link=True)
            self._velocity.set(
                (message.vx / 100, message.vy / 100, message.vz / 100), now, link=True)
            self.home_altitude = (message.alt - message.relative_alt) / 1e3

    def set_velocity(self, velocity: Vector, now: float) -> None:
        """Receive a velocity from ROS, m/s, unless it is not finite."""
        if all(map(math.isfinite, velocity)):
            self._velocity.set(velocity, now)

    def heading(self, now: float) -> float | None:
        """Return the yaw from north, rad, None if it is unknown."""
        known = self.attitude.get(now)
        return known and known[0].euler()[2]

    def autopilot_sent(self, now: float) -> None:
        """Note that an autopilot has sent AUTOPILOT_STATE_FOR_GIMBAL_DEVICE."""
        self._autopilot_at = now

    def for_device(self, device: Address, now: float) -> AutopilotStateForGimbalDevice | None:
        """
        Return the message to be sent to a gimbal device.

        :return: None if an autopilot sends it, it was just sent, or the attitude is unknown.
        """
        known, velocity = self.attitude.get(now), self._velocity.get(now)
        if (known is None or now < self._autopilot_at + AUTOPILOT_SILENCE
                or now < self._sent_at + AUTOPILOT_INTERVAL):
            return None
        self._sent_at = now
        attitude, yaw_rate = known
        return AutopilotStateForGimbalDevice(
            *device, int(now * 1e6), attitude, 0, *(velocity or (math.nan,) * 3), 0, math.nan,
            ESTIMATES_ATTITUDE | (ESTIMATES_VELOCITY if velocity else 0), 0, yaw_rate)
