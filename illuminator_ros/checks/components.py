# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The components on a link, and which of them is the device that is checked."""

from __future__ import annotations

from collections.abc import Collection
import math

from .outcomes import Skipped
from ..mavlink.messages import Address
from ..mavlink.search.component_kinds import listed


def names(addresses: Collection[Address]) -> str:
    """Return addresses as text, the first few by name."""
    return listed([str(one) for one in sorted(addresses)])


class Components:
    """
    Recognises the device.

    :param own: the address of the session.
    :param target: the device; None selects the first that is heard.
    :param component: the component id that alone identifies the device, whose system id changes;
        None if its address stays the same.
    :ivar found: the present address of the device, once it is heard.
    :ivar heard: the addresses of all components that were heard.
    :ivar devices: the addresses of the devices of this payload among them.
    :ivar last_heard: when the device was heard, s.
    """

    def __init__(self, own: Address, target: Address | None, component: int | None) -> None:
        self.target = target
        self.found: Address | None = None
        self.heard: set[Address] = set()
        self.devices: set[Address] = set()
        self.last_heard = -math.inf
        self._own = own
        self._component = component

    def hear(self, source: Address, now: float, *, identifies: bool) -> bool:
        """
        Take a message, and return whether the device has sent it.

        :param identifies: whether the message identifies its sender as a device of this payload.
        """
        self.heard.add(source)
        if identifies and self._component in (None, source.component):
            self.devices.add(source)
        if self.found is None and (self._is_same(source, self.target) if self.target
                                   else source in self.devices):
            self.found = source
        if not self.is_device(source):
            return False
        if source != self.found:
            self.heard.discard(self.device)
            self.devices.discard(self.device)
        self.found, self.last_heard = source, now
        return True

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
        system, taken = self.device.system, {*self.heard, self._own}
        for component in range(first, 256):
            if (system, component) not in taken:
                return Address(system, component)
        raise Skipped(f'each component id from {first} of system {system} is in use')

    def free_system(self) -> int:
        """
        Return a system id from which nothing was heard.

        :raises Skipped: if all are in use.
        """
        taken = {one.system for one in (*self.heard, self._own)}
        for system in range(240, 0, -1):
            if system not in taken:
                return system
        raise Skipped('each system id up to 240 is in use')
