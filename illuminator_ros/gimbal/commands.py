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

"""Control of a gimbal, and the changes that need a command."""

from __future__ import annotations

from dataclasses import dataclass
import math

from .axes import LEVEL
from .messages import GimbalManagerStatus, REMOVE_SENDER, UNCHANGED
from ..mavlink.command_sender import Position
from ..mavlink.dialect import flag_names, mavlink
from ..mavlink.messages import Address
from ..payload.messages import GeoPoint, GimbalDeviceAttitudeStatus
from ..payload.mount_attitude import YawFrame


@dataclass(frozen=True)
class Control:
    """The components that control a gimbal, None for none."""

    primary: Address | None = None
    secondary: Address | None = None

    @classmethod
    def of(cls, status: GimbalManagerStatus) -> Control:
        """Return the control that a status shows."""
        return cls(_component(status.primary_control_sysid, status.primary_control_compid),
                   _component(status.secondary_control_sysid, status.secondary_control_compid))

    def includes(self, component: Address) -> bool:
        """Return whether a component has primary or secondary control."""
        return component in (self.primary, self.secondary)

    def __str__(self) -> str:
        return f'primary {self.primary or "none"}, secondary {self.secondary or "none"}'


def _component(system: int, component: int) -> Address | None:
    return Address(system, component) if system else None


MAV_FRAME_GLOBAL = 0


def setpoint_flags(frame: YawFrame) -> int:
    """
    Return the flags of a setpoint whose yaw is relative to a frame.

    PX4 and ArduPilot read YAW_LOCK as the frame of the yaw, so the two flags always agree.
    """
    lock = mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK if frame is YawFrame.EARTH else 0
    return LEVEL | frame.flag | lock


@dataclass(frozen=True)
class Configure:
    """
    Takes primary control, or releases all control of this component.

    :param us: the address of this component.
    """

    us: Address
    device_id: int
    take: bool
    note: str = ''
    position: None = None
    command: int = mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE

    @property
    def params(self) -> tuple[float, ...]:
        """See :class:`~..payload.attempt.Change`."""
        # The address instead of SENDER, which PX4 reads as the autopilot.
        primary = self.us if self.take else (REMOVE_SENDER, REMOVE_SENDER)
        secondary = UNCHANGED if self.take else REMOVE_SENDER
        return *primary, secondary, secondary, 0, 0, self.device_id

    @property
    def goal(self) -> str:
        """See :class:`~..payload.attempt.Change`."""
        return 'control taken' if self.take else 'control released'

    def shown_by(self, status: GimbalManagerStatus) -> bool:
        """See :class:`~..payload.attempt.Change`."""
        control = Control.of(status)
        return control.primary == self.us if self.take else not control.includes(self.us)

    def evidence(self, status: GimbalManagerStatus) -> str:
        """See :class:`~..payload.attempt.Change`."""
        return 'confirmed by GIMBAL_MANAGER_STATUS'

    def actual(self, status: GimbalManagerStatus) -> str:
        """See :class:`~..payload.attempt.Change`."""
        return str(Control.of(status))


@dataclass(frozen=True)
class SetFlag:
    """
    Sets or clears one flag of the gimbal, and leaves its angles and rates as they are.

    The status of the device shows the flags; GIMBAL_MANAGER_STATUS of ArduPilot does not.

    :param wish: what is requested, for people.
    :param goal: the state to be reached, for people.
    :param needed: the capability without which it is refused, 0 for none.
    """

    wish: str
    goal: str
    flag: int
    needed: int
    is_set: bool = True
    device_id: int = 0
    note: str = ''
    position: None = None
    command: int = mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW

    @property
    def frame(self) -> YawFrame:
        """Return the yaw frame that the gimbal has afterwards."""
        is_locked = self.is_set and self.flag == mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK
        return YawFrame.EARTH if is_locked else YawFrame.VEHICLE

    @property
    def params(self) -> tuple[float, ...]:
        """See :class:`~..payload.attempt.Change`."""
        flags = setpoint_flags(self.frame) | (self.flag if self.is_set else 0)
        return *(math.nan,) * 4, flags, 0, self.device_id

    def shown_by(self, status: GimbalDeviceAttitudeStatus) -> bool:
        """See :class:`~..payload.attempt.Change`."""
        return bool(status.flags & self.flag) is self.is_set

    def evidence(self, status: GimbalDeviceAttitudeStatus) -> str:
        """See :class:`~..payload.attempt.Change`."""
        return 'confirmed by GIMBAL_DEVICE_ATTITUDE_STATUS'

    def actual(self, status: GimbalDeviceAttitudeStatus) -> str:
        """See :class:`~..payload.attempt.Change`."""
        return ', '.join(flag_names('GIMBAL_DEVICE_FLAGS', status.flags)) or 'no flags'


NEUTRAL = SetFlag('turn to neutral', 'neutral position', mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL,
                  mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_NEUTRAL)
RETRACT = SetFlag('retract', 'retracted', mavlink.GIMBAL_DEVICE_FLAGS_RETRACT,
                  mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_RETRACT)
YAW_LOCKS = {
    True: SetFlag('lock yaw', 'yaw locked', mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK,
                  mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK),
    False: SetFlag('unlock yaw', 'yaw follows the vehicle', mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK,
                   0, is_set=False)}


class _Unconfirmed:
    """A change that no status shows."""

    note = ''

    def shown_by(self, status: None) -> None:
        """See :class:`~..payload.attempt.Change`."""

    def evidence(self, status: None) -> str:
        """See :class:`~..payload.attempt.Change`."""
        return ''

    def actual(self, status: None) -> str:
        """See :class:`~..payload.attempt.Change`."""
        return ''


@dataclass(frozen=True)
class Stop(_Unconfirmed):
    """
    Stops the gimbal where it points: unlike a setpoint of zero rates, it is acknowledged.

    :param flags: as in the setpoint.
    """

    flags: int
    device_id: int
    goal: str = 'stopped'
    position: None = None
    command: int = mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW

    @property
    def params(self) -> tuple[float, ...]:
        """See :class:`~..payload.attempt.Change`."""
        return math.nan, math.nan, 0.0, 0.0, self.flags, 0.0, self.device_id


@dataclass(frozen=True)
class Point(_Unconfirmed):
    """
    Points the gimbal at a place, or at none.

    :param place: with its altitude above mean sea level.
    """

    device_id: int
    place: GeoPoint | None

    @property
    def command(self) -> int:
        """See :class:`~..payload.attempt.Change`."""
        return (mavlink.MAV_CMD_DO_SET_ROI_LOCATION if self.place
                else mavlink.MAV_CMD_DO_SET_ROI_NONE)

    @property
    def params(self) -> tuple[float, ...]:
        """See :class:`~..payload.attempt.Change`."""
        return (float(self.device_id),)

    @property
    def position(self) -> Position | None:
        """See :class:`~..payload.attempt.Change`."""
        return self.place and Position(MAV_FRAME_GLOBAL, *self.place)

    @property
    def goal(self) -> str:
        """See :class:`~..payload.attempt.Change`."""
        if self.place is None:
            return 'point at no place'
        latitude, longitude, altitude = self.place
        return f'point at {latitude:.7g}, {longitude:.7g}, {altitude:.4g} m'
