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

"""The components on a link, and which of them is the device that is checked."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
import math

from .outcomes import Skipped
from ...mavlink.messages import Address, Message


class Sender(Enum):
    """The sender of a message."""

    DEVICE = 'device'
    PART = 'part'
    OTHER = 'other'


class Components:
    """
    Recognises the device.

    :param own: the address of the session.
    :param is_device: whether a message identifies its sender as a device of this payload.
    :param target: the device; None selects the first that is heard.
    :param component: the component id that alone identifies the device, whose system id changes;
        None if its address stays the same.
    :param part_of: returns the component id of a part of the device, from a message of the
        device; 0 for no part.
    :ivar found: the present address of the device, once it is heard.
    :ivar heard: the addresses of all components that were heard.
    :ivar devices: the addresses of the devices of this payload among them.
    :ivar last_heard: when the device was heard, s.
    """

    def __init__(
        self, own: Address, is_device: Callable[[Message], bool], target: Address | None,
        component: int | None, part_of: Callable[[Message], int],
    ) -> None:
        self.target = target
        self.found: Address | None = None
        self.heard: set[Address] = set()
        self.devices: set[Address] = set()
        self.last_heard = -math.inf
        self._own = own
        self._is_device = is_device
        self._component = component
        self._part_of, self._part = part_of, 0

    def hear(self, source: Address, message: Message, now: float) -> Sender:
        """Take a message, and return who has sent it."""
        self.heard.add(source)
        if self._component in (None, source.component) and self._is_device(message):
            self.devices.add(source)
        if self.found is None and (self._is_same(source, self.target) if self.target
                                   else source in self.devices):
            self.found = source
        if self.is_device(source):
            if self.found is not None and source != self.found:
                self.heard.discard(self.found)
                self.devices.discard(self.found)
            self.found = source
            self.last_heard = now
            self._part = self._part_of(message) or self._part
            return Sender.DEVICE
        is_part = self.found is not None and source == (self.found.system, self._part)
        return Sender.PART if is_part else Sender.OTHER

    def is_device(self, source: Address) -> bool:
        """Return whether this is the address of the device that was found."""
        return self._is_same(source, self.found)

    def _is_same(self, source: Address, device: Address | None) -> bool:
        return source == device or (
            device is not None and source.component == device.component == self._component)

    @property
    def device(self) -> Address:
        """Return the address of the device, which must have been heard."""
        assert self.found is not None
        return self.found

    def free_component(self, first: int = 192) -> Address:
        """
        Return an address of the device's system from which nothing was heard.

        :param first: the lowest component id.
        :raises Skipped: if all are in use.
        """
        system, taken = self.device.system, self.heard | {self._own, self.device}
        for component in range(first, 256):
            if (system, component) not in taken:
                return Address(system, component)
        raise Skipped(f'each component id from {first} of system {system} is in use')

    def free_system(self) -> int:
        """
        Return a system id from which nothing was heard.

        :raises Skipped: if all are in use.
        """
        taken = {one.system for one in self.heard | {self._own, self.device}}
        for system in range(240, 0, -1):
            if system not in taken:
                return system
        raise Skipped('each system id up to 240 is in use')
