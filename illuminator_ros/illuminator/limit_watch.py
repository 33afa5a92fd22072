# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""How a light exceeds the limits that the operator has set, and when it is brought back."""

from __future__ import annotations

import math

from .events import LimitExceeded
from .model import Configuration, SafetyLimits, StrobeRange
from ..mavlink.messages import Address

# s; a light that exceeds a limit is brought back within it once in this time.
LIMIT_INTERVAL = 10.0


class LimitWatch:
    """
    Compares what one light reports with the limits. No I/O; times are s.

    :ivar exceeded: how the light exceeds the limits.
    :ivar limited_at: when a command that brings it back was sent last.
    """

    def __init__(self, address: Address) -> None:
        self.exceeded = LimitExceeded(address, (), '')
        self.limited_at = -math.inf

    def compare(
        self, limits: SafetyLimits, reported: Configuration, strobe_range: StrobeRange, now: float,
    ) -> bool:
        """Compare a reported configuration; return whether :attr:`exceeded` has changed."""
        excess = limits.excess(reported)
        is_again = bool(excess) and (
            self.exceeded.is_again if self.exceeded.excess else now < self.due)
        before, self.exceeded = self.exceeded, LimitExceeded(
            self.exceeded.key, excess, limits.impossible(strobe_range), is_again)
        return self.exceeded != before

    @property
    def due(self) -> float:
        """Return when the light may be brought back again, s."""
        return self.limited_at + LIMIT_INTERVAL
