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
from ..mavlink.dialect import flag_names, mavlink
from ..mavlink.messages import Address
from ..payload.messages import GimbalDeviceAttitudeStatus
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
    command: int = mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE

    @property
    def params(self) -> tuple[float, ...]:
        """See :class:`~..payload.request.Change`."""
        # The address instead of SENDER, which PX4 reads as the autopilot.
        primary = self.us if self.take else (REMOVE_SENDER, REMOVE_SENDER)
        secondary = UNCHANGED if self.take else REMOVE_SENDER
        return *primary, secondary, secondary, 0, 0, self.device_id

    @property
    def goal(self) -> str:
        """See :class:`~..payload.request.Change`."""
        return 'control taken' if self.take else 'control released'

    def shown_by(self, status: GimbalManagerStatus) -> bool:
        """See :class:`~..payload.request.Change`."""
        control = Control.of(status)
        return control.primary == self.us if self.take else not control.includes(self.us)

    def evidence(self, status: GimbalManagerStatus) -> str:
        """See :class:`~..payload.request.Change`."""
        return 'confirmed by GIMBAL_MANAGER_STATUS'

    def actual(self, status: GimbalManagerStatus) -> str:
        """See :class:`~..payload.request.Change`."""
        return str(Control.of(status))


@dataclass(frozen=True)
class SetFlags:
    """
    Sets flags of the gimbal, and leaves its angles and rates as they are.

    The status of the device shows the flags; GIMBAL_MANAGER_STATUS of ArduPilot does not.

    :param flag: the flag that changes.
    :param goal: the state to be reached, for people.
    """

    flags: int
    flag: int
    device_id: int
    goal: str
    note: str = ''
    command: int = mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW

    @property
    def params(self) -> tuple[float, ...]:
        """See :class:`~..payload.request.Change`."""
        return *(math.nan,) * 4, self.flags, 0, self.device_id

    def shown_by(self, status: GimbalDeviceAttitudeStatus) -> bool:
        """See :class:`~..payload.request.Change`."""
        return status.flags & self.flag == self.flags & self.flag

    def evidence(self, status: GimbalDeviceAttitudeStatus) -> str:
        """See :class:`~..payload.request.Change`."""
        return 'confirmed by GIMBAL_DEVICE_ATTITUDE_STATUS'

    def actual(self, status: GimbalDeviceAttitudeStatus) -> str:
        """See :class:`~..payload.request.Change`."""
        return ', '.join(flag_names('GIMBAL_DEVICE_FLAGS', status.flags)) or 'no flags'
