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

"""Round-trip times of one target, and the time-out that follows from them."""

from __future__ import annotations

from collections import deque

# A time-out below this is unsafe on a 57,600 baud line, where another frame may be on the wire
# for 49 ms before ours and another before the answer.
FLOOR = 0.2
WINDOW = 64
# Before this many samples the given time-out holds.
ENOUGH = 4


class RttEstimator:
    """The last :data:`WINDOW` round-trip times, s."""

    def __init__(self) -> None:
        self._samples: deque[float] = deque(maxlen=WINDOW)

    def add(self, seconds: float) -> None:
        """Take a sample, s."""
        self._samples.append(seconds)

    def quantile(self, share: float) -> float | None:
        """Return the round-trip time that this share (0..1) does not exceed, None if unknown."""
        if not self._samples:
            return None
        ordered = sorted(self._samples)
        return ordered[min(int(share * len(ordered)), len(ordered) - 1)]

    def timeout(self, longest: float) -> float:
        """
        Return the wait for an acknowledgement, s: four times the 95th percentile, bounded.

        :param longest: s; what it is while less than :data:`ENOUGH` samples are known.
        """
        slow = self.quantile(0.95)
        if slow is None or len(self._samples) < ENOUGH:
            return longest
        return min(max(4 * slow, FLOOR), longest)
