# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Whether a device is heard, and the reason why not; no I/O, and time is passed in."""

from __future__ import annotations

import math

from ..mavlink.durations import format_seconds


class Liveness:
    """
    The liveness of one device. Times are s.

    :param timeout: after which the device is silent.
    :param link_failure: why the link is not open, for people; '' while it is.
    :ivar connected: whether it was heard, and :meth:`lose` was not called since.
    :ivar heard_at: the time of the last message; -inf before the first.
    :ivar lost_at: when the device was lost; infinity while it is connected.
    :ivar silent_at: when a connected device is silent; infinity for others.
    """

    def __init__(self, timeout: float, link_failure: str = '') -> None:
        self.link_failure = link_failure
        self.connected = False
        self.heard_at = -math.inf
        self.lost_at = self.silent_at = math.inf
        self._timeout = timeout

    def is_heard(self, now: float) -> bool:
        """Return whether it is connected and not silent."""
        return self.connected and now < self.silent_at

    def hear(self, now: float) -> bool:
        """Take a message; return whether the device is connected by it."""
        was_connected = self.connected
        self.connected, self.heard_at = True, now
        self.lost_at, self.silent_at = math.inf, now + self._timeout
        return not was_connected

    def lose(self, now: float) -> bool:
        """Note the loss; return whether the device was connected."""
        was_connected = self.connected
        if was_connected:
            self.connected, self.lost_at, self.silent_at = False, now, math.inf
        return was_connected

    def silence(self, now: float) -> str:
        """Return for how long it was not heard, for people."""
        return f'no heartbeat for {format_seconds(now - self.heard_at)}'

    def loss(self, name: str, now: float) -> str:
        """Return that a device of this name is lost and why, for people."""
        # Without a link no heartbeat can be heard, so the failure of the link is the reason.
        return f'{name} is lost: {self.link_failure or self.silence(now)}'
