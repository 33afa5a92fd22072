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
"""A limit on repeated changes by another sender."""

from __future__ import annotations

import math

# s without a change that end a row of changes.
ROW_TIME = 30.0


class RepeatLimit:
    """
    Limits how often a change by another sender is undone.

    Two programs that both repeat their command would otherwise make a light flash.

    :param times: how often in a row; a row ends after :data:`ROW_TIME`, s, without a change.
    :param interval: s between two of a row.
    """

    def __init__(self, times: int, interval: float) -> None:
        self._times = times
        self._interval = interval
        self._last = -math.inf
        self._count = 0

    def take(self, now: float) -> float | None:
        """Return when a change may be undone, s; None if it must be left as it is."""
        if now >= self._last + ROW_TIME:
            self._count = 0
        if self._count >= self._times:
            self._last = now
            return None
        self._count += 1
        self._last = max(now, self._last + self._interval)
        return self._last
