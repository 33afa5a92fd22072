# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Control of a gimbal, the moves that it is asked for, and the changes that need a command."""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import NamedTuple, TypeAlias

from .axes import LEVEL
from .messages import GimbalManagerStatus, NO_COMPONENT, REMOVE_SENDER, UNCHANGED
from ..geometry.mount_attitude import STILL, YawFrame
from ..geometry.rotation import Quaternion, Vector
from ..mavlink.command_sender import CommandPosition
from ..mavlink.dialect import flag_names, mavlink
from ..mavlink.messages import Address
from ..payload.attempt import Change
from ..payload.messages import GeoPoint, GimbalDeviceAttitudeStatus


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

    def params(self) -> tuple[int, ...]:
        """Return the params of MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE that give this control."""
        return *(self.primary or NO_COMPONENT), *(self.secondary or NO_COMPONENT)

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


def configure(us: Address, device_id: int, *, take: bool) -> Change[GimbalManagerStatus]:
    """Return the change that takes primary control, or releases all control of this component."""
    def is_shown(status: GimbalManagerStatus) -> bool:
        control = Control.of(status)
        return control.primary == us if take else not control.includes(us)

    # The address instead of SENDER, which PX4 reads as the autopilot.
    players = (*us, UNCHANGED, UNCHANGED) if take else (REMOVE_SENDER,) * 4
    return Change(
        mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, (*players, 0, 0, device_id),
        'control taken' if take else 'control released', shown_by=is_shown,
        actual=lambda status: str(Control.of(status)))


def describe_flags(flags: int) -> str:
    """Return the flags of a device by name."""
    return ', '.join(flag_names('GIMBAL_DEVICE_FLAGS', flags)) or 'no flags'


class Flag(NamedTuple):
    """
    One flag of the gimbal, set or cleared; the status of the device shows it.

    :param wish: what is requested, for people.
    :param goal: the state to be reached, for people.
    :param needed: the capability without which it is refused, 0 for none.
    """

    wish: str
    goal: str
    flag: int
    needed: int
    is_set: bool = True

    @property
    def is_pose(self) -> bool:
        """Whether it alone sets the attitude."""
        return self.flag != mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK

    @property
    def frame(self) -> YawFrame:
        """Return the frame that yaw has by it; the flags of a pose clear the yaw lock."""
        return YawFrame.EARTH if self.is_set and not self.is_pose else YawFrame.VEHICLE

    def is_shown(self, status: GimbalDeviceAttitudeStatus) -> bool:
        """Return whether a status shows it."""
        return bool(status.flags & self.flag) is self.is_set

    def change(self, device_id: int) -> Change[GimbalDeviceAttitudeStatus]:
        """
        Return the change by a flag of a pose.

        Such a flag takes precedence over the angles and rates (GIMBAL_DEVICE_FLAGS), so they are
        NaN, "unset" (MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW). Without it PX4 would turn to 0.
        """
        return Change(
            mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW,
            (*(math.nan,) * 4, setpoint_flags(YawFrame.VEHICLE) | self.flag, 0, device_id),
            self.goal,
            shown_by=self.is_shown, actual=lambda status: describe_flags(status.flags))


NEUTRAL = Flag('turn to neutral', 'neutral position', mavlink.GIMBAL_DEVICE_FLAGS_NEUTRAL,
               mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_NEUTRAL)
RETRACT = Flag('retract', 'retracted', mavlink.GIMBAL_DEVICE_FLAGS_RETRACT,
               mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_RETRACT)
YAW_LOCKS = {
    True: Flag('lock yaw', 'yaw locked', mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK,
               mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK),
    False: Flag('unlock yaw', 'yaw follows the vehicle', mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK,
                0, is_set=False)}


@dataclass(frozen=True)
class Attitude:
    """
    An attitude that a message sets.

    :param rotation: with norm 1, from the FLU axes of the gimbal as in
        :class:`~..geometry.mount_attitude.MountAttitude`.
    """

    rotation: Quaternion
    frame: YawFrame


@dataclass(frozen=True)
class Rates:
    """Rates of roll, pitch and yaw in ROS, rad/s, that a message sets."""

    rates: Vector = STILL


# A pose, a place, None for no place, and setpoints.
Move: TypeAlias = Flag | GeoPoint | Attitude | Rates | None
SETPOINTS = (Attitude, Rates)


def point(device_id: int, place: GeoPoint | None) -> Change[None]:
    """
    Return the change that points the gimbal at a place, or at none.

    :param place: with its altitude above mean sea level.
    """
    if place is None:
        return Change(
            mavlink.MAV_CMD_DO_SET_ROI_NONE, (float(device_id),), 'point at no place')
    latitude, longitude, altitude = place
    return Change(
        mavlink.MAV_CMD_DO_SET_ROI_LOCATION, (float(device_id),),
        f'point at {latitude:.7g}, {longitude:.7g}, {altitude:.4g} m',
        CommandPosition(MAV_FRAME_GLOBAL, *place))
