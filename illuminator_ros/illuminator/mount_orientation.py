# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The direction of the mounts that lights are on, relative to the body of their vehicle."""

from __future__ import annotations

from ..geometry.mount_attitude import MountAttitude, YawFrame
from ..geometry.rotation import flip, Quaternion
from ..mavlink.dialect import mavlink
from ..mavlink.messages import Address, Message
from ..payload.messages import Attitude, GimbalDeviceAttitudeStatus, is_plausible

# s for which an attitude is valid.
ATTITUDE_LIFETIME = 2.0
# The most mounts, and the most vehicles; more are ignored.
MAX_MOUNTS = 32


class MountOrientations:
    """The last attitudes of mounts and vehicles on a link; times are s."""

    messages: tuple[type[Message], ...] = (GimbalDeviceAttitudeStatus, Attitude)

    def __init__(self) -> None:
        # By system and gimbal device id.
        self._mounts: dict[tuple[int, int], tuple[MountAttitude | None, float]] = {}
        self._vehicles: dict[int, tuple[Attitude, float]] = {}

    def receive(self, source: Address, message: Message, now: float) -> bool:
        """Take a message of one of :attr:`messages`; return whether a mount has sent it."""
        if isinstance(message, GimbalDeviceAttitudeStatus):
            key = source.system, message.gimbal_device_id or source.component
            if key in self._mounts or len(self._mounts) < MAX_MOUNTS:
                try:
                    self._mounts[key] = MountAttitude.from_status(message), now
                except ValueError:
                    self._mounts[key] = None, now
                return True
        elif (isinstance(message, Attitude) and is_plausible(message)
                and source.component == mavlink.MAV_COMP_ID_AUTOPILOT1
                and (source.system in self._vehicles or len(self._vehicles) < MAX_MOUNTS)):
            self._vehicles[source.system] = message, now
        return False

    def absence(self, system: int, device_id: int) -> str:
        """Return why the beam of a mount is not shown, for people; '' if the mount was heard."""
        if (system, device_id) in self._mounts:
            return ''
        heard = ', '.join(f'{number} of system {one}' for one, number in sorted(self._mounts))
        return (f'no attitude of gimbal device {device_id} of system {system} has been heard, so '
                f'the beam is not shown; heard: {heard or "none"}')

    def direction(self, system: int, device_id: int, now: float) -> Quaternion | None:
        """
        Return the rotation from the FLU axes of a mount to those of its vehicle's body.

        A vehicle that sends no ATTITUDE counts as level.

        :param device_id: gimbal device id of the mount.
        :return: None if it is not known.
        """
        attitude, at = self._mounts.get((system, device_id), (None, now))
        if attitude is None or now >= at + ATTITUDE_LIFETIME:
            return None
        vehicle, at = self._vehicles.get(system, (None, now))
        if vehicle is None or now >= at + ATTITUDE_LIFETIME:
            return attitude.seen_from(YawFrame.VEHICLE)
        level = attitude.seen_from(YawFrame.VEHICLE, vehicle.yaw)
        tilt = flip(Quaternion.from_euler(vehicle.roll, vehicle.pitch, 0.0))
        return None if level is None else tilt.inverse() * level
