# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The dead man's switch: how long nothing has been requested of a light."""

from __future__ import annotations

from dataclasses import dataclass
import math


@dataclass
class Silence:
    """
    The time without a request. Times are s.

    :param limit: after which a light that is on is switched off; 0 for never.
    :param requested_at: the last request that counts, or the ON of another sender.
    :param calling_since: when the first of the calls under way was made; -inf if there is none.
        Calls that overlap, of which none succeeds, do not hold it off for ever.
    """

    limit: float
    requested_at: float = -math.inf
    calling_since: float = -math.inf

    @property
    def ends_at(self) -> float:
        """Return when it is over, infinity for never."""
        if not self.limit:
            return math.inf
        return self.limit + max(self.requested_at, self.calling_since)
