# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The end of a rate: whether a device turns, and a zero that is repeated until it stands."""

from __future__ import annotations

from collections.abc import Callable
import math

from .axes import TURNING
from .messages import rates_of
from ..geometry.mount_attitude import MountAttitude
from ..mavlink.retries import Retries, RetryPolicy
from ..payload.messages import GimbalDeviceAttitudeStatus

ZERO_RATE = RetryPolicy('a rate of zero, until the gimbal stands', 0.1, 0.1, 10)
STILL_TURNING = RetryPolicy('a rate of zero after these', 1.0, 1.0)
# s; the least time between two attitudes that show whether a device turns, since one may be a copy
# of the other; and from a zero to the first attitude that counts. Many devices send one in 0.1 s.
ATTITUDE_SPACING = 0.09
# s after the end of a rate in which a message with the rate may still arrive.
LATE_TIME = 1.5


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
    Sends the message that ends a rate, until an attitude shows that the device stands.

    The message may be lost, and nothing else would end the rate: its user is gone, the process
    ends, another manager has the device, or the link was lost. No I/O; times are s.

    :param told: called with False when :data:`ZERO_RATE` is over and no
        attitude has shown that the device stands, with True each time when one shows that.
    :param lasts: whether it then goes on with :data:`STILL_TURNING`, and sends
        the message again if the device turns within :data:`LATE_TIME` by a rate that was late.
    :ivar is_running: whether the device may turn at the rate, or the rate may be late.
    :ivar begun: when the rate ended.
    :ivar turns: whether the device turns, by the attitudes since then; None if none has shown it.
    """

    def __init__(self, told: Callable[[bool], None], *, lasts: bool = False) -> None:
        self.is_running = False
        self.begun = -math.inf
        self.turns: bool | None = None
        self._told = told
        self._lasts = lasts
        self._retries = Retries(ZERO_RATE, math.inf)
        # Whether it must be sent once, even if the device stands: it may end a place, too.
        self._must_be_sent = False
        self._send: Callable[[float], None] = lambda now: None
        self._detector = TurningDetector()

    @property
    def due(self) -> float:
        """Return when :meth:`poll` is due, infinity while nothing is sent, s."""
        return self._retries.due

    @property
    def may_turn(self) -> bool:
        """Whether the device may turn at the rate: no attitude has shown that it stands."""
        return self.is_running and self.turns is not False

    def begin(self, send: Callable[[float], None], now: float, *, was_sent: bool = False) -> None:
        """
        Send the message from now on.

        :param was_sent: whether it has just been sent for the first time.
        """
        self.cancel()
        self.is_running, self._send, self.begun = True, send, now
        self._must_be_sent = not was_sent
        self._retries = Retries(ZERO_RATE, now)
        if was_sent:
            self._retries.note_try(now)

    def owe(self, send: Callable[[float], None], now: float) -> None:
        """Send the message as soon as an attitude shows that the device turns."""
        self.is_running, self._must_be_sent, self._send, self.begun = True, False, send, now
        # An attitude that showed that it stood may be older than the rate.
        self.turns = self.turns or None
        self._retries.stop()

    def cancel(self) -> None:
        """Send nothing: the device has another setpoint."""
        self.is_running, self.turns = False, None
        self._retries.stop()
        self._detector.reset()

    def reported(self, status: GimbalDeviceAttitudeStatus, now: float) -> None:
        """Receive a status of the device."""
        turns = self._detector.turns(status, now)
        # An earlier status may be older than the message.
        is_early = now < self.begun + ATTITUDE_SPACING or self._must_be_sent
        if turns is None or not turns and is_early:
            return
        before, self.turns = self.turns, turns
        if not self.is_running:
            return
        if turns:
            if self.due == math.inf:
                self._retries = Retries(ZERO_RATE, now)
        else:
            self._retries.stop()
            self.is_running = self._lasts and now < self.begun + LATE_TIME
            if before is not False:
                self._told(True)

    def poll(self, now: float) -> None:
        """Send the message, or note that the time is over, if that is due."""
        if now < self.due:
            return
        if not self._retries.is_spent:
            self._retries.note_try(now)
            self._must_be_sent = False
            self._send(now)
            return
        if self._lasts:
            self._retries = Retries(STILL_TURNING, now)
        else:
            self.cancel()
        self._told(False)
