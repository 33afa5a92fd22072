# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
Discovery of devices by their messages, and their liveness.

A device is announced once it has proved that it is one, by a valid status or by an answer to a
request: a heartbeat alone can be forged for any number of addresses. Until then it is a candidate,
which a newer candidate may replace.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator
import math
from typing import Generic, Protocol, TypeVar

from .device_events import DeviceEvent, DeviceForgotten, DeviceFound
from ..mavlink.schedule import Schedule

# Devices of one kind; one more is ignored, so that memory is bounded.
MAX_DEVICES = 128
# Candidates; one more replaces the oldest, if that has had CANDIDATE_TIME, s, to answer.
MAX_CANDIDATES = 8
CANDIDATE_TIME = 1.0
# Ignored devices that are remembered, to name them where the target is missing.
MAX_IGNORED = 8
# s from the loss of a device that was never commanded until it is forgotten.
FORGET_AFTER = 60.0


class DiscoveredDevice(Protocol):
    """The part of a device that the discovery uses."""

    @property
    def lost_at(self) -> float:
        """When it was lost, s; while it is heard infinity, or when it was last heard."""

    @property
    def was_commanded(self) -> bool:
        """Whether a user has ever sent it a command."""

    def poll(self, now: float) -> None:
        """Do everything that is due; the schedule calls it."""


K = TypeVar('K', bound=Hashable)
D = TypeVar('D', bound=DiscoveredDevice)


class Discovery(Generic[K, D]):
    """
    The devices of one kind on a link, by keys such as their addresses.

    :param schedule: of the link.
    :param emit: takes :class:`DeviceFound` when a device is announced, and
        :class:`DeviceForgotten` when it was dropped.
    :param found: called when a device was announced.
    :param dropped: called when a device or a candidate was dropped.
    :param wanted: returns whether a device is of interest; others are ignored.
    :param limit: returns how many devices are announced at most, that one included.
    :ivar devices: the announced devices, in the order of their announcement.
    :ivar candidates: the devices that are not announced yet.
    :ivar ignored: the first devices that are not wanted.
    :ivar limit_reached: whether more than the limit have been heard.
    """

    def __init__(
        self, schedule: Schedule,
        emit: Callable[[DeviceEvent[K]], None] = lambda event: None, *,
        found: Callable[[D, float], None] = lambda device, now: None,
        dropped: Callable[[K, float], None] = lambda key, now: None,
        wanted: Callable[[K], bool] = lambda key: True,
        limit: Callable[[K], int] = lambda key: MAX_DEVICES,
    ) -> None:
        self.devices: dict[K, D] = {}
        self.candidates: dict[K, D] = {}
        self.ignored: dict[K, None] = {}
        self.limit_reached = False
        self._schedule = schedule
        self._emit = emit
        self._found = found
        self._dropped = dropped
        self._wanted = wanted
        self._limit = limit
        self._found_at: dict[K, float] = {}

    def __iter__(self) -> Iterator[D]:
        """Return the devices and the candidates."""
        yield from self.devices.values()
        yield from self.candidates.values()

    def get(self, key: K) -> D | None:
        """Return a device or a candidate."""
        return self.devices.get(key) or self.candidates.get(key)

    def hear(self, key: K, now: float, make: Callable[[K], D], *, proved: bool) -> D | None:
        """
        Return a device; a new one becomes a candidate.

        :param make: makes a new one.
        :param proved: whether the message proves that it is a device, which announces it.
            Otherwise it may replace a candidate only after :data:`CANDIDATE_TIME`.
        :return: None if the device is not wanted, or if there are too many.
        """
        device = self.devices.get(key)
        if device is not None:
            return device
        if key not in self.candidates:
            if not self._has_room(key, now, proved=proved):
                return None
            self.candidates[key], self._found_at[key] = make(key), now
            self._schedule.by(self._forget, now + FORGET_AFTER)
        device = self.candidates[key]
        if proved:
            self.prove(key, now)
        return device

    def _has_room(self, key: K, now: float, *, proved: bool) -> bool:
        """Return whether a device may become a candidate, if need be in place of another one."""
        if not self._wanted(key):
            if len(self.ignored) < MAX_IGNORED:
                self.ignored[key] = None
            return False
        if len(self.devices) >= self._limit(key):
            self.limit_reached = True
            return False
        if len(self.candidates) >= MAX_CANDIDATES:
            oldest, found_at = next(iter(self._found_at.items()))
            if not proved and now < found_at + CANDIDATE_TIME:
                return False
            self._drop(oldest, now)
        return True

    def prove(self, key: K, now: float) -> None:
        """Note a valid status or an answer, which announces a candidate."""
        if key in self.candidates and len(self.devices) < self._limit(key):
            del self._found_at[key]
            device = self.devices[key] = self.candidates.pop(key)
            self._emit(DeviceFound(key))
            self._found(device, now)

    def _drop(self, key: K, now: float) -> None:
        self._found_at.pop(key, None)
        if device := self.get(key):
            self._schedule.at(device.poll, math.inf)
        self.candidates.pop(key, None)
        was_announced = self.devices.pop(key, None) is not None
        self._dropped(key, now)
        if was_announced:
            self.limit_reached = False
            self._emit(DeviceForgotten(key))

    def _forget(self, now: float) -> None:
        """Forget the devices that were lost long ago and that no user has commanded."""
        due = math.inf
        for key, device in [*self.devices.items(), *self.candidates.items()]:
            if device.was_commanded:
                continue
            # One that is heard now cannot be forgotten before this time.
            if now >= (forget_at := min(device.lost_at, now) + FORGET_AFTER):
                self._drop(key, now)
            else:
                due = min(due, forget_at)
        self._schedule.at(self._forget, due)
