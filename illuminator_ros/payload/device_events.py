# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The events that devices of each kind have."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Generic, TypeVar

from .arbitration import HolderChanged

K = TypeVar('K', bound=Hashable)


@dataclass(frozen=True)
class DeviceEvent(Generic[K]):
    """
    An event of a device.

    :param key: of the device, such as its address.
    """

    key: K


@dataclass(frozen=True)
class DeviceFound(DeviceEvent[K]):
    """A device has proved for the first time that it is one."""


@dataclass(frozen=True)
class DeviceForgotten(DeviceEvent[K]):
    """A device that stayed silent was dropped, so that another one can take its place."""


@dataclass(frozen=True)
class DeviceConnected(DeviceEvent[K]):
    """
    A device is heard, for the first time or again.

    :param note: more on its connection, for people.
    """

    note: str = ''


@dataclass(frozen=True)
class DeviceDisconnected(DeviceEvent[K]):
    """A device is not heard any more."""

    reason: str


@dataclass(frozen=True)
class DeviceHeld(DeviceEvent[K]):
    """The source of commands that holds a device has changed."""

    change: HolderChanged[str]
