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
Discovery of devices by their messages, and their liveness.

A device is announced once it has proved that it is one, by a valid status or by an answer to a
request: a heartbeat alone can be forged for any number of addresses. Until then it is a candidate,
which a newer candidate may replace.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
import math
from typing import Generic, Protocol, TypeVar

from ..mavlink.command_sender import CommandSender, CommandStatus
from ..mavlink.messages import Address

# Devices of one kind; one more is ignored, so that memory is bounded.
MAX_DEVICES = 128
# Candidates; one more replaces the oldest, if that has had CANDIDATE_TIME, s, to answer.
MAX_CANDIDATES = 8
CANDIDATE_TIME = 1.0
# Ignored devices that are remembered, to name them where the target is missing.
MAX_IGNORED = 8
# s from the loss of a device that was never commanded until it is forgotten.
FORGET_AFTER = 60.0


class Device(Protocol):
    """The part of a device that the discovery uses."""

    @property
    def address(self) -> Address:
        """Return the address that it sends from."""

    @property
    def lost_at(self) -> float:
        """When it was lost, s; infinity while it is heard."""

    @property
    def was_commanded(self) -> bool:
        """Whether a user has ever sent it a command."""

    def poll(self, now: float) -> None:
        """Do everything that is due."""

    def next_deadline(self) -> float:
        """Return when :meth:`poll` is due, infinity if never."""


D = TypeVar('D', bound=Device)


class Discovery(Generic[D]):
    """
    The devices of one kind on a link.

    :param make: makes the device at an address.
    :param commands: ends the commands to a device that is dropped.
    :param found: called when a device is announced.
    :param forgotten: called when an announced device was dropped.
    :param wanted: returns whether a device at an address is of interest; others are ignored.
    :ivar devices: the announced devices, by address, in the order of their announcement.
    :ivar candidates: the devices that are not announced yet, by address.
    :ivar ignored: the first devices that are not wanted, by address.
    :ivar limit_reached: whether more than :data:`MAX_DEVICES` have been heard.
    """

    def __init__(
        self, make: Callable[[Address], D], commands: CommandSender, *,
        found: Callable[[D, float], None] = lambda device, now: None,
        forgotten: Callable[[D], None] = lambda device: None,
        wanted: Callable[[Address], bool] = lambda address: True,
    ) -> None:
        self.devices: dict[Address, D] = {}
        self.ignored: dict[Address, None] = {}
        self.limit_reached = False
        self._make = make
        self._commands = commands
        self._found = found
        self._forgotten = forgotten
        self._wanted = wanted
        self.candidates: dict[Address, D] = {}
        self._found_at: dict[Address, float] = {}

    def __iter__(self) -> Iterator[D]:
        """Return the devices and the candidates."""
        yield from self.devices.values()
        yield from self.candidates.values()

    def get(self, address: Address) -> D | None:
        """Return the device or the candidate at an address."""
        return self.devices.get(address) or self.candidates.get(address)

    def hear(self, address: Address, now: float, *, proved: bool) -> D | None:
        """
        Return the device at an address; a new one becomes a candidate.

        :param proved: whether the message proves that it is a device, which announces it.
            Otherwise it may replace a candidate only after :data:`CANDIDATE_TIME`.
        :return: None if the device is not wanted, or if there are too many.
        """
        device = self.devices.get(address)
        if device is not None:
            return device
        device = self.candidates.get(address) or self._candidate(address, now, proved=proved)
        if device is not None and proved:
            self.prove(address, now)
        return device

    def _candidate(self, address: Address, now: float, *, proved: bool) -> D | None:
        if not self._wanted(address):
            if len(self.ignored) < MAX_IGNORED:
                self.ignored[address] = None
            return None
        if len(self.devices) >= MAX_DEVICES:
            self.limit_reached = True
            return None
        if len(self.candidates) >= MAX_CANDIDATES:
            oldest, found_at = next(iter(self._found_at.items()))
            if not proved and now < found_at + CANDIDATE_TIME:
                return None
            self._drop(oldest, now)
        device = self.candidates[address] = self._make(address)
        self._found_at[address] = now
        return device

    def prove(self, address: Address, now: float) -> None:
        """Note a valid status or an answer, which announces a candidate."""
        if address in self.candidates and len(self.devices) < MAX_DEVICES:
            del self._found_at[address]
            device = self.devices[address] = self.candidates.pop(address)
            self._found(device, now)

    def _forgotten_at(self, device: D) -> float:
        return math.inf if device.was_commanded else device.lost_at + FORGET_AFTER

    def _drop(self, address: Address, now: float) -> None:
        self._found_at.pop(address, None)
        self.candidates.pop(address, None)
        device = self.devices.pop(address, None)
        self._commands.end_all(now, CommandStatus.CANCELLED, address)
        if device is not None:
            self.limit_reached = False
            self._forgotten(device)

    def poll(self, now: float) -> None:
        """Poll the devices that have something to do, and forget silent ones."""
        for device in list(self):
            if now >= self._forgotten_at(device):
                self._drop(device.address, now)
            elif now >= device.next_deadline():
                device.poll(now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` is due, infinity if never."""
        due = math.inf
        for devices in (self.devices, self.candidates):
            for device in devices.values():
                due = min(due, device.next_deadline(), device.lost_at + FORGET_AFTER
                          if not device.was_commanded else math.inf)
        return due
