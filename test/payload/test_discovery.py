# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The discovery of devices, whatever they are."""

from __future__ import annotations

from collections.abc import Callable
import math

from illuminator_ros.mavlink.schedule import Schedule
from illuminator_ros.payload.discovery import (
    CANDIDATE_TIME,
    Discovery,
    FORGET_AFTER,
    MAX_CANDIDATES,
)


class Device:
    """A device that wants to be called each second."""

    was_commanded = False

    def __init__(self, schedule: Schedule, lost_at: float = math.inf) -> None:
        self.lost_at = lost_at
        self.polls: list[float] = []
        self._schedule = schedule
        self.poll(0.0)

    def poll(self, now: float) -> None:
        self.polls.append(now)
        self._schedule.at(self.poll, now + 1.0)


def found(lost_at: float = math.inf, *, proved: bool = True) -> tuple[
        Schedule, Discovery[int, Device], Device, Callable[[int], Device]]:
    """Return a discovery with one device."""
    schedule = Schedule()
    discovery = Discovery[int, Device](schedule)

    def make(key: int) -> Device:
        return Device(schedule, lost_at)

    device = discovery.hear(0, 0.0, make, proved=proved)
    assert device is not None
    return schedule, discovery, device, make


def test_a_candidate_that_another_one_replaces_is_not_called_any_more() -> None:
    schedule, discovery, device, make = found(proved=False)
    for key in range(1, MAX_CANDIDATES + 1):
        discovery.hear(key, CANDIDATE_TIME, make, proved=False)
    assert 0 not in discovery.candidates

    schedule.run(5.0)

    assert device.polls == [0.0]


def test_a_device_is_forgotten_a_while_after_its_loss_and_is_not_called_any_more() -> None:
    schedule, discovery, device, _ = found()
    device.lost_at = 30.0
    while schedule.due < 30.0 + FORGET_AFTER:
        schedule.run(schedule.due)
    assert 0 in discovery.devices

    schedule.run(30.0 + FORGET_AFTER)
    calls = len(device.polls)
    schedule.run(1000.0)

    assert (len(device.polls), list(discovery.devices)) == (calls, [])
    assert schedule.due == math.inf
