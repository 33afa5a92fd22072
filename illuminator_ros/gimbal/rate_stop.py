# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The end of a rate: whether a device turns, and a zero that is repeated until it stands."""

from __future__ import annotations

from collections.abc import Callable
import math

from .axes import TURNING
from .messages import rates_of
from ..mavlink.retries import Retries, ZERO_RATE
from ..payload.messages import GimbalDeviceAttitudeStatus
from ..payload.mount_attitude import MountAttitude

# s; the least time between two attitudes that show whether a device turns, since one may be a copy
# of the other; and from a zero to the first attitude that counts. Many devices send one in 0.1 s.
ATTITUDE_SPACING = 0.09


class TurningDetector:
    """Finds out from the attitudes of a device whether it turns."""

    def __init__(self) -> None:
        # An attitude of a device that reports no rates, and its time; a later one is compared.
        self._seen: tuple[MountAttitude, float] | None = None

    def reset(self) -> None:
        """Compare later attitudes only."""
        self._seen = None

    def turns(self, status: GimbalDeviceAttitudeStatus, now: float) -> bool | None:
        """Return whether the device turns, None if that is not known yet."""
        rates = rates_of(status)
        if any(abs(rate) > TURNING for rate in rates):
            return True
        if all(map(math.isfinite, rates)):
            return False
        try:
            attitude = MountAttitude.from_status(status)
        except ValueError:
            return None
        if self._seen is None or self._seen[0].frame is not attitude.frame:
            self._seen = attitude, now
        before, at = self._seen
        if now < at + ATTITUDE_SPACING:
            return None
        turns = before.rotation.angle_to(attitude.rotation) > TURNING * (now - at)
        if turns:
            self._seen = attitude, now
        return turns


class RateStop:
    """
    Sends a rate of zero to a device that may turn, until an attitude shows that it stands.

    The message may be lost, and nothing else would end the rate: the process ends, another manager
    has the device, or the link was lost. No I/O; times are s.

    :param ended: called with whether an attitude has shown that, before the time was over.
    """

    def __init__(self, ended: Callable[[bool], None]) -> None:
        self._retries = Retries(ZERO_RATE, math.inf)
        self._ended = ended
        self._send: Callable[[], None] = lambda: None
        self._begun = -math.inf
        self._detector = TurningDetector()

    @property
    def due(self) -> float:
        """Return when :meth:`poll` is due, infinity while nothing is sent, s."""
        return self._retries.due

    @property
    def is_running(self) -> bool:
        """Whether the zero is being repeated."""
        return self.due < math.inf

    def begin(self, send: Callable[[], None], now: float, *, was_sent: bool) -> None:
        """
        Send the zero, and repeat it.

        :param was_sent: whether it has just been sent for the first time.
        """
        self._send, self._begun = send, now
        self._retries = Retries(ZERO_RATE, now)
        if was_sent:
            self._retries.note_try(now)
        self._detector.reset()
        self.poll(now)

    def reported(self, status: GimbalDeviceAttitudeStatus, now: float) -> None:
        """Take a status of the device."""
        if not self.is_running:
            return
        turns = self._detector.turns(status, now)
        # An earlier status may be older than the zero.
        if turns is False and now >= self._begun + ATTITUDE_SPACING:
            self._end(True)

    def poll(self, now: float) -> None:
        """Send the zero, or end, if that is due."""
        if now < self.due:
            return
        if self._retries.is_spent:
            self._end(False)
        else:
            self._retries.note_try(now)
            self._send()

    def _end(self, stands: bool) -> None:
        self._retries.stop()
        self._ended(stands)
