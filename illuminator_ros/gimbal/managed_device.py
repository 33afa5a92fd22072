# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The device of a gimbal manager: its abilities, and what it reports."""

from __future__ import annotations

import math

from .axes import HAS_AXIS, HAS_LOCK, known_ranges, Ranges, read_capabilities, TURNING, UNLIMITED
from .manager_setpoint import POSES, Setpoint
from .manager_state import ManagerState, StateTracker
from .messages import GimbalDeviceInformation, rates_of
from .vehicle_state import VehicleState
from ..geometry.mount_attitude import (
    heading_of,
    names_frame,
    rotation_of,
    STILL,
    yaw_frame,
    YawFrame,
)
from ..geometry.rotation import Vector
from ..mavlink.command_sender import CommandResult, CommandSender, request_message
from ..mavlink.dialect import mavlink
from ..mavlink.retries import Retries, RetryPolicy
from ..payload.messages import GimbalDeviceAttitudeStatus

DEVICE_INFORMATION = RetryPolicy('GIMBAL_DEVICE_INFORMATION, by `gimbal_manager`', 0.5, 5.0)
# Requests for GIMBAL_DEVICE_INFORMATION without the message after which the manager announces the
# gimbal without it; and the longest time of one, s, which a device may prolong with progress, and
# command_timeout too.
INFORMATION_REQUESTS = 3
INFORMATION_TIMEOUT = 2.0
# s after which the attitude of a device is out of date.
ATTITUDE_AGE = 1.0


# The capability that a flag needs.
_NEEDED = {mavlink.GIMBAL_DEVICE_FLAGS_RETRACT: mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_RETRACT,
           mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL: mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_NEUTRAL,
           mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK: mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK}


def _capabilities(ranges: Ranges) -> int:
    """Return those of a gimbal that is stabilised and points to any attitude within the ranges."""
    capabilities = mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_NEUTRAL
    if not ranges[2].is_fixed:
        capabilities |= mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_FOLLOW
    for range_, *flags in zip(ranges, HAS_AXIS, HAS_LOCK, strict=True):
        capabilities |= 0 if range_.is_fixed else sum(flags)
    return capabilities


class ManagedDevice:
    """
    The facts that a manager knows of its device. Times are s.

    :param tracker: knows its address.
    :param ranges: of the axes of a device without MAVLink.
    :ivar capabilities: 0 where unknown.
    :ivar ranges: of roll, pitch, and yaw relative to the vehicle.
    :ivar newest: status, None before the first.
    :ivar information: None until it has come.
    :ivar request: of the information.
    """

    def __init__(
        self, tracker: StateTracker, commands: CommandSender, vehicle: VehicleState,
        ranges: Ranges,
    ) -> None:
        self.capabilities, self.ranges = (
            (0, UNLIMITED) if tracker.has_mavlink else (_capabilities(ranges), ranges))
        self.information: GimbalDeviceInformation | None = None
        self.request = Retries(DEVICE_INFORMATION, math.inf)
        self._tracker = tracker
        self._commands = commands
        self._vehicle = vehicle
        self.newest: GimbalDeviceAttitudeStatus | None = None
        self._newest_at = -math.inf

    # Information

    @property
    def is_awaited(self) -> bool:
        """Whether its information is requested and may still come."""
        return (self._tracker.has_mavlink and self.information is None
                and self.request.tried < INFORMATION_REQUESTS)

    def found(self, now: float) -> None:
        """Request its information."""
        if self._tracker.has_mavlink and self.information is None:
            self.request.due = now
            self._set_due()

    def lost(self) -> None:
        """Forget its abilities: the next device may be another one."""
        self.request = Retries(DEVICE_INFORMATION, math.inf)
        if self._tracker.has_mavlink:
            self.information, self.capabilities, self.ranges = None, 0, UNLIMITED

    def receive_information(self, message: GimbalDeviceInformation) -> None:
        """Receive GIMBAL_DEVICE_INFORMATION."""
        self.information = message
        self.capabilities, self.ranges = read_capabilities(message), known_ranges(message)
        self.request.stop()

    def _set_due(self) -> None:
        self._commands.schedule.at(self._request_information, self.request.due)

    def _request_information(self, now: float) -> None:
        if now >= self.request.due and self._tracker.device is not None:
            self.request.stop()
            self._commands.start(
                request_message(self._tracker.device, GimbalDeviceInformation.id), now,
                self._answered, deadline=now + INFORMATION_TIMEOUT)

    def _answered(self, result: CommandResult, now: float) -> None:
        if self.information is None and self._tracker.state is not ManagerState.NO_DEVICE:
            self.request.note_try(now)
            self._set_due()

    # Reports

    def receive_status(self, status: GimbalDeviceAttitudeStatus, now: float) -> None:
        """Receive GIMBAL_DEVICE_ATTITUDE_STATUS."""
        self.newest, self._newest_at = status, now

    def status(self, now: float) -> GimbalDeviceAttitudeStatus | None:
        """Return the newest status, None if it is out of date."""
        return self.newest if now < self._newest_at + ATTITUDE_AGE else None

    def lacks(self, flags: int) -> int:
        """Return the flags that it cannot follow."""
        return sum([flag for flag, needed in _NEEDED.items()
                    if flags & flag and self.capabilities and not self.capabilities & needed])

    def accepts_earth_frame(self, now: float) -> bool:
        """Return whether it accepts a yaw relative to north."""
        status = self.status(now)
        if status is not None and names_frame(status.flags):
            return bool(status.flags & mavlink.GIMBAL_DEVICE_FLAGS_ACCEPTS_YAW_IN_EARTH_FRAME)
        return not self.capabilities or bool(
            self.capabilities & mavlink.GIMBAL_DEVICE_CAP_FLAGS_SUPPORTS_YAW_IN_EARTH_FRAME)

    def heading(self, now: float) -> float | None:
        """Return the vehicle's heading as the device reports it, else as the vehicle does."""
        status = self.status(now)
        # The heading in the status of a device without MAVLink is an older one of the vehicle.
        own = heading_of(status) if self._tracker.has_mavlink and status is not None else None
        return self._vehicle.heading(now) if own is None else own

    def pointing(self, now: float) -> tuple[Vector, YawFrame] | None:
        """Return its roll, pitch and yaw, rad, and the frame of the yaw; None if unknown."""
        status = self.status(now)
        if status is None:
            return None
        try:
            return rotation_of(status.q).euler(), yaw_frame(status.flags)
        except ValueError:
            return None

    def end_of_motion(self, now: float) -> Setpoint | None:
        """Return a rate of zero if it turns, as a manager has left it that was killed."""
        status, pointing = self.status(now), self.pointing(now)
        if status is None or pointing is None or status.flags & POSES:
            return None
        turns = any(abs(rate) > TURNING for rate in rates_of(status))
        return Setpoint(status.flags, pointing[1], rates=STILL) if turns else None
