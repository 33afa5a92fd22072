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
CLOSING = RetryPolicy('a command while the process ends, which has less than a second', 0.1, 0.1)
CONNECTION = RetryPolicy('the opening of a link, with half of the wait at random', 0.05, 0.5)
RESOURCE = RetryPolicy('a node or a thread for which the system has no room', 0.5, 0.5)
