# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""How often everything is tried again, and after which waits; no I/O, and time is passed in."""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import NamedTuple


class RetryPolicy(NamedTuple):
    """
    The waits between the tries of one thing.

    :param subject: what is tried, for people.
    :param first: s from the first try to the second.
    :param longest: s; each wait is twice as long as the one before, up to this or ``first``.
    :param tries: how often, infinity until it succeeds or ends for another reason.
    """

    subject: str
    first: float
    longest: float
    tries: float = math.inf

    def wait(self, tried: int) -> float:
        """Return how long to wait after so many tries, >= 1, s."""
        return max(self.first, min(self.first * (1 << min(tried - 1, 16)), self.longest))


@dataclass
class Retries:
    """
    The times of the tries of one thing. Times are s.

    :ivar due: when the next try is due, infinity for never.
    :ivar tried: how often it was tried.
    """

    policy: RetryPolicy
    due: float = -math.inf
    tried: int = 0

    def note_try(self, now: float) -> None:
        """Note a try; the next one is due after the wait."""
        self.tried += 1
        self.due = now + self.policy.wait(self.tried)

    def begin_try(self, now: float) -> bool:
        """Return whether a try is due, and note it."""
        is_due = now >= self.due
        if is_due:
            self.note_try(now)
        return is_due

    @property
    def is_spent(self) -> bool:
        """Whether no try is left."""
        return self.tried >= self.policy.tries

    def stop(self) -> None:
        """Try no more: it has succeeded, or has failed for good."""
        self.due = math.inf


COMMAND = RetryPolicy(
    'a command without an acknowledgement (`command_timeout`, `command_retries`)', 0.25, 1.0, 4)
REJECTED = RetryPolicy('a command that was temporarily rejected', 0.1, 0.8)
STATUS = RetryPolicy('the request for a status, after one that does not show the change',
                     0.05, 0.25)
UNCONFIRMED = RetryPolicy('an automatic OFF that no status shows, and a command that may be '
                          'confused with an earlier one', 0.25, 0.25, 10)
STILL_UNCONFIRMED = RetryPolicy('an automatic OFF after these', 2.0, 2.0)
CLOSING = RetryPolicy('a command while the process ends, which has less than a second', 0.1, 0.1)
REQUIRED = RetryPolicy('a restored configuration, overrides and limits', 2.0, 60.0)
MESSAGE = RetryPolicy('a message that a light acknowledges or refuses, and does not send',
                      0.5, 0.5, 3)
GIMBAL_MESSAGE = RetryPolicy('a message of a gimbal or its manager', 1.0, 60.0)
DEVICE_INFORMATION = RetryPolicy('GIMBAL_DEVICE_INFORMATION, by `gimbal_manager`', 0.5, 5.0)
ZERO_RATE = RetryPolicy('a rate of zero, until the gimbal stands', 0.1, 0.1, 10)
STILL_TURNING = RetryPolicy('a rate of zero after these', 1.0, 1.0)
PING = RetryPolicy('a PING that a service call asks for', 1.0, 1.0, 2)
CONNECTION = RetryPolicy('the opening of a link, with half of the wait at random', 0.05, 0.5)
RESOURCE = RetryPolicy('a node or a thread for which the system has no room', 0.5, 0.5)

# In the order of the table in doc/links.md.
POLICIES = (CONNECTION, COMMAND, REJECTED, STATUS, UNCONFIRMED, STILL_UNCONFIRMED, CLOSING,
            REQUIRED, MESSAGE, GIMBAL_MESSAGE, DEVICE_INFORMATION, ZERO_RATE, STILL_TURNING, PING,
            RESOURCE)
