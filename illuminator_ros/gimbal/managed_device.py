# Copyright 2026 The illuminator_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""The device of a gimbal manager: its abilities, and what it reports."""

from __future__ import annotations

import math

from .axes import Ranges, TURNING
from .manager_setpoint import GimbalModel, POSES, Setpoint
from .manager_state import ManagerState, StateTracker
from .messages import GimbalDeviceInformation, rates_of
from .vehicle_state import VehicleState
from ..mavlink.command_sender import Command, CommandResult, CommandSender
from ..mavlink.dialect import mavlink
from ..mavlink.retries import DEVICE_INFORMATION
from ..payload.messages import GimbalDeviceAttitudeStatus
from ..payload.mount_attitude import heading_of, rotation_of, STILL, yaw_frame, YawFrame
from ..payload.rotation import Vector

# Requests for GIMBAL_DEVICE_INFORMATION without the message after which the manager announces the
# gimbal without it; and the longest time of one, s, which a device may prolong with progress, and
# command_timeout too.
INFORMATION_REQUESTS = 3
INFORMATION_TIMEOUT = 2.0
# s after which the attitude of a device is out of date.
ATTITUDE_AGE = 1.0


class ManagedDevice:
    """
    The facts that a manager knows of its device. Times are s.

    :param tracker: knows its address.
    :param ranges: of the axes of a device without MAVLink.
    :ivar model: its abilities.
    :ivar information: None until it has come.
    :ivar request_due: when the information is requested.
    """

    def __init__(
        self, tracker: StateTracker, commands: CommandSender, vehicle: VehicleState,
        ranges: Ranges,
    ) -> None:
        self.model = GimbalModel() if tracker.has_mavlink else GimbalModel.from_ranges(ranges)
        self.information: GimbalDeviceInformation | None = None
        self.request_due = math.inf
        self._tracker = tracker
        self._commands = commands
        self._vehicle = vehicle
        self._status: GimbalDeviceAttitudeStatus | None = None
        self._status_at = -math.inf
        self._requests = 0

    # Information

    @property
    def is_awaited(self) -> bool:
        """Whether its information is requested and may still come."""
        return (self._tracker.has_mavlink and self.information is None
                and self._requests < INFORMATION_REQUESTS)

    def found(self, now: float) -> None:
        """Request its information."""
        if self._tracker.has_mavlink and self.information is None:
            self.request_due = now

    def lost(self) -> None:
        """Forget its abilities: the next device may be another one."""
        self.request_due, self._requests = math.inf, 0
        if self._tracker.has_mavlink:
            self.information, self.model = None, GimbalModel()

    def take_information(self, message: GimbalDeviceInformation) -> None:
        """Take GIMBAL_DEVICE_INFORMATION."""
        self.information, self.request_due = message, math.inf
        self.model = GimbalModel.from_information(message)

    def poll(self, now: float) -> None:
        """Request the information if that is due."""
        if now >= self.request_due and self._tracker.device is not None:
            self.request_due = math.inf
            command = Command(self._tracker.device, mavlink.MAV_CMD_REQUEST_MESSAGE,
                              (GimbalDeviceInformation.id,))
            self._commands.start(
                command, now, self._answered, deadline=now + INFORMATION_TIMEOUT)

    def _answered(self, result: CommandResult, now: float) -> None:
        if self.information is None and self._tracker.state is not ManagerState.NO_DEVICE:
            self._requests += 1
            self.request_due = now + DEVICE_INFORMATION.wait(self._requests)

    # Reports

    def take_status(self, status: GimbalDeviceAttitudeStatus, now: float) -> None:
        """Take GIMBAL_DEVICE_ATTITUDE_STATUS."""
        self._status, self._status_at = status, now

    def status(self, now: float) -> GimbalDeviceAttitudeStatus | None:
        """Return the newest status, None if it is out of date."""
        return self._status if now < self._status_at + ATTITUDE_AGE else None

    def accepts_earth_frame(self, now: float) -> bool:
        """Return whether it accepts a yaw relative to north."""
        status = self.status(now)
        return self.model.accepts_earth_frame(status.flags if status else None)

    @property
    def has_reported(self) -> bool:
        """Whether it has ever sent a status."""
        return self._status is not None

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
