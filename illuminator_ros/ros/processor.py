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

"""Giving the processor to the thread that a message wakes."""

from __future__ import annotations

from collections.abc import Callable
import math
import os
import time

# s for which a thread that was given the processor may keep it, and for which it is then not
# given any more: on a busy machine each yield would take as long as that.
SHORT = 0.001
PAUSE = 1.0


class Processor:
    """
    Yields the processor of a thread, which the kernel gives to the threads that it has woken.

    Otherwise these wait until the thread that has woken them waits, too.
    """

    def __init__(
        self, clock: Callable[[], float] = time.monotonic,
        sched_yield: Callable[[], object] = os.sched_yield,
    ) -> None:
        self._clock = clock
        self._sched_yield = sched_yield
        self._due = -math.inf

    def give_way(self) -> None:
        """Yield; on a machine where other threads keep the processor, seldom."""
        now = self._clock()
        if now >= self._due:
            self._sched_yield()
            if self._clock() > now + SHORT:
                self._due = now + PAUSE


processor = Processor()
