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

"""
Discovery of devices by what they send, and their liveness.

A device is announced once it has proved that it is one, by a valid status or by an answer to a
request: a heartbeat alone can be forged for any number of addresses. Until then it is a
candidate, which a newer candidate may push out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
import math
from typing import Generic, Protocol, TypeVar

from ..mavlink.messages import Address

# Devices of one kind; one more is ignored, so that memory is bounded.
MAX_DEVICES = 128
# Candidates; one more takes the place of the oldest, if that has had its time to answer, s.
MAX_CANDIDATES = 32
CANDIDATE_TIME = 1.0
# Ignored devices that are remembered, to name them where the target is missing.
MAX_IGNORED = 8
# s after the loss of a device that was never commanded, after which it is forgotten.
FORGET_AFTER = 60.0


class Device(Protocol):
    """A device as the discovery sees it."""

    @property
    def lost_at(self) -> float:
        """When it was lost, s; infinity while it is heard."""

    @property
    def was_commanded(self) -> bool:
        """Whether a user has ever sent it a command."""


D = TypeVar('D', bound=Device)


class Discovery(Generic[D]):
    """
    The devices of one kind on a link.

    :param make: makes the device at an address.
    :param drop: called with a candidate that another one takes the place of.
    :param wanted: tells whether a device at an address is of interest; others are ignored.
    :ivar devices: the announced devices, by address, in the order of their announcement.
    :ivar ignored: the first devices that are not wanted, by address.
    :ivar limit_reached: whether more than :data:`MAX_DEVICES` have been heard.
    """

    def __init__(
        self, make: Callable[[Address], D], drop: Callable[[D], None],
        wanted: Callable[[Address], bool],
    ) -> None:
        self.devices: dict[Address, D] = {}
        self.ignored: dict[Address, None] = {}
        self.limit_reached = False
        self._make = make
        self._drop = drop
        self._wanted = wanted
        self._candidates: dict[Address, D] = {}
        self._found_at: dict[Address, float] = {}

    def __iter__(self) -> Iterator[D]:
        """Return the devices and the candidates."""
        yield from self.devices.values()
        yield from self._candidates.values()

    def get(self, address: Address) -> D | None:
        """Return the device or the candidate at an address."""
        return self.devices.get(address) or self._candidates.get(address)

    def hear(self, address: Address, now: float, *, proved: bool) -> D | None:
        """
        Return the device at an address; a new one becomes a candidate.

        :param proved: whether the message proves that it is a device, which entitles it to a
            place. Otherwise it may replace a candidate only after :data:`CANDIDATE_TIME`.
        :return: None if the device is not wanted, or if there are too many.
        """
        device = self.devices.get(address) or self._candidates.get(address)
        if device is not None:
            return device
        if not self._wanted(address):
            if len(self.ignored) < MAX_IGNORED:
                self.ignored[address] = None
            return None
        if len(self.devices) >= MAX_DEVICES:
            self.limit_reached = True
            return None
        if len(self._candidates) >= MAX_CANDIDATES:
            oldest, found_at = next(iter(self._found_at.items()))
            if not proved and now < found_at + CANDIDATE_TIME:
                return None
            self._drop(self.forget(oldest))
        device = self._candidates[address] = self._make(address)
        self._found_at[address] = now
        return device

    def prove(self, address: Address) -> bool:
        """Note a valid status or an answer; return whether the device is announced by it."""
        if address not in self._candidates or len(self.devices) >= MAX_DEVICES:
            return False
        del self._found_at[address]
        self.devices[address] = self._candidates.pop(address)
        return True

    def forgotten_at(self, device: D) -> float:
        """Return when a device is dropped if it stays silent, s."""
        return math.inf if device.was_commanded else device.lost_at + FORGET_AFTER

    def forget(self, address: Address) -> D:
        """Drop a device or a candidate, and return it."""
        self._found_at.pop(address, None)
        if address in self._candidates:
            return self._candidates.pop(address)
        self.limit_reached = False
        return self.devices.pop(address)
