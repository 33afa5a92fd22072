# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The events of gimbals, and snapshots of gimbals for other threads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

from .axes import Ranges
from .commands import Control
from .messages import GimbalDeviceInformation
from ..geometry.mount_attitude import MountAttitude
from ..mavlink.dialect import raw
from ..mavlink.messages import Address
from ..payload.device_events import DeviceEvent
from ..payload.identity import text


class GimbalKey(NamedTuple):
    """
    A gimbal device.

    :param address: of the component that sends the attitude: the device, or its manager.
    :param number: 1..6 for a device that is not a component of its own, else 0.
    """

    address: Address
    number: int = 0

    @property
    def device_id(self) -> int:
        """Return the gimbal device id that messages to its manager carry."""
        return self.number or self.address.component

    def __str__(self) -> str:
        return f'{self.number} of {self.address}' if self.number else str(self.address)


@dataclass(frozen=True)
class DeviceIdentity:
    """The identity in GIMBAL_DEVICE_INFORMATION; '' is an empty text or no version."""

    vendor: str
    model: str
    custom_name: str
    firmware_version: str
    hardware_version: str
    uid: int

    @classmethod
    def of(cls, message: GimbalDeviceInformation) -> DeviceIdentity:
        """Read a message."""
        return cls(text(raw(message, 'vendor_name')), text(raw(message, 'model_name')),
                   text(raw(message, 'custom_name')), _version(message.firmware_version),
                   _version(message.hardware_version), message.uid)


def _version(number: int) -> str:
    """Return a version as major.minor.patch, '' for none."""
    return '.'.join(str(number >> shift & 0xFF) for shift in (0, 8, 16)) if number else ''


GimbalEvent: TypeAlias = DeviceEvent[GimbalKey]


@dataclass(frozen=True)
class AttitudeReceived(GimbalEvent):
    """
    The device has sent GIMBAL_DEVICE_ATTITUDE_STATUS.

    :param attitude: None if the status has no valid attitude.
    """

    attitude: MountAttitude | None
    flags: int
    errors: int


@dataclass(frozen=True)
class ControlChanged(GimbalEvent):
    """
    The components in control have changed, or have become unknown.

    :param before: the last known control, None if it was never known.
    :param after: None if it is unknown.
    :param ours: whether this component has primary control.
    :param was_lost: whether this component had primary control and has not released it.
    :param may_turn: whether the gimbal may then still turn at a rate of this component.
    """

    before: Control | None
    after: Control | None
    ours: bool
    was_lost: bool
    may_turn: bool = False


@dataclass(frozen=True)
class RateStopped(GimbalEvent):
    """
    A rate has ended 1 s ago and the gimbal may still turn, or such a gimbal stands.

    :param turns: whether the attitudes show that it turns, None if none has come since.
    """

    stands: bool
    turns: bool | None


@dataclass(frozen=True)
class SecondManager(GimbalEvent):
    """Another manager announces the gimbal, although only one may be active."""

    manager: Address
    other: Address


@dataclass(frozen=True)
class ManagerChanged(GimbalEvent):
    """The gimbal is controlled through another manager, since the previous one is lost."""

    before: Address
    after: Address


@dataclass(frozen=True)
class AutomaticTakeFailed(GimbalEvent):
    """The automatic request for control has failed."""

    message: str


@dataclass(frozen=True)
class GimbalSnapshot:
    """
    A gimbal at one moment, for any thread.

    :param unreachable: why it is not connected, for people; '' if it is.
    :param managers: the managers that announce it and are heard; the first one is used.
    :param capabilities: None if the manager has not sent them; likewise ``ranges``.
    :param identity: None if the device has not sent it; likewise ``attitude``.
    :param attitude_at: when the last attitude status came, s; -inf if none has.
    :param attitude_problem: why the last status has no attitude, '' if it has one.
    :param control: the components in control, None if they are not known.
    :param control_since: when that changed last, s.
    :param in_control: whether this component has primary control.
    :param status_at: when the last GIMBAL_MANAGER_STATUS came, s; -inf if none has.
    :param enforces_control: False if the manager is known to obey components without control.
    :param setpoints_sent: since the gimbal was found, with repetitions.
    :param has_place: whether it points at a place as this component has requested.
    :param unstopped_since: when a rate of this component has ended, if no attitude shows that the
        gimbal stands, s; None if it stands or another component has control.
    :param turns: whether the attitudes since then show that it turns, None if they do not tell.
    :param holder: the source of commands that holds it, '' if none does; None without sources.
    :param held_since: when it got this holder, s.
    """

    key: GimbalKey
    unreachable: str
    managers: tuple[Address, ...]
    capabilities: int | None
    ranges: Ranges | None
    identity: DeviceIdentity | None
    attitude: MountAttitude | None
    attitude_at: float
    attitude_problem: str
    flags: int
    errors: int
    control: Control | None
    control_since: float
    in_control: bool
    status_at: float
    enforces_control: bool
    setpoints_sent: int
    has_place: bool
    unstopped_since: float | None
    turns: bool | None
    holder: str | None = None
    held_since: float = 0.0
