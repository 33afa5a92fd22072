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

"""Yielding the processor to the threads that a message wakes."""

from __future__ import annotations

from collections.abc import Callable
import math
import os
import time

# s that a yield may take. After a longer one none follows for YIELD_PAUSE s: on a busy machine
# each takes as long as the other threads keep the processor.
MAX_YIELD = 0.001
YIELD_PAUSE = 1.0


class LimitedYield:
    """
    Yields the processor to the threads that the calling thread has woken.

    The kernel puts those on the same processor, where they otherwise wait until the calling thread
    waits.
    """

    def __init__(
        self, clock: Callable[[], float] = time.monotonic,
        sched_yield: Callable[[], object] = os.sched_yield,
    ) -> None:
        self._clock = clock
        self._sched_yield = sched_yield
        self._due = -math.inf

    def __call__(self) -> None:
        """Yield, at most once in :data:`YIELD_PAUSE` where other threads keep the processor."""
        now = self._clock()
        if now >= self._due:
            self._sched_yield()
            if self._clock() > now + MAX_YIELD:
                self._due = now + YIELD_PAUSE


yield_processor = LimitedYield()
