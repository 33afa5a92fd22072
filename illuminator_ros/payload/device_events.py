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
