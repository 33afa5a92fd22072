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

"""The earliest of many deadlines, found without a search through all of them."""

from __future__ import annotations

from collections.abc import Hashable
import heapq
import itertools
import math
from typing import Generic, TypeVar

K = TypeVar('K', bound=Hashable)

# Entries of the heap that may be obsolete, beside one for each key.
SPARE = 8


class DeadlineQueue(Generic[K]):
    """
    The next deadline of each of many keys.

    Postponing, which every heartbeat does, takes little time: the entry in the heap stays and is
    checked when its old time comes.

    :ivar changed: must be called with a key to which something has happened; the key is due until
        its deadline is set.
    """

    def __init__(self) -> None:
        # In the order of the changes.
        self._changed: dict[K, None] = {}
        self._deadlines: dict[K, float] = {}
        self._heap: list[tuple[float, int, K]] = []
        # The earliest entry of each key in the heap.
        self._entered: dict[K, float] = {}
        self._order = itertools.count()

    def __len__(self) -> int:
        """Return how many keys have a deadline."""
        return len(self._deadlines)

    def changed(self, key: K) -> None:
        """Note that something has happened to a key: it is due until its deadline is set."""
        self._changed[key] = None

    def set(self, key: K, deadline: float) -> None:  # noqa: A003
        """Set the deadline of a key, infinity for none."""
        self._changed.pop(key, None)
        if deadline == math.inf:
            self._deadlines.pop(key, None)
            return
        self._deadlines[key] = deadline
        if deadline < self._entered.get(key, math.inf):
            self._enter(key, deadline)

    def _enter(self, key: K, deadline: float) -> None:
        self._entered[key] = deadline
        heapq.heappush(self._heap, (deadline, next(self._order), key))
        if len(self._heap) > 2 * len(self._deadlines) + SPARE:
            # Most entries are of keys without a deadline, or were replaced.
            self._entered = dict(self._deadlines)
            self._heap = [(at, next(self._order), one) for one, at in self._deadlines.items()]
            heapq.heapify(self._heap)

    def next_deadline(self) -> float:
        """Return the earliest deadline, infinity if there is none."""
        return -math.inf if self._changed else self._earliest()

    def _earliest(self) -> float:
        while self._heap:
            entered, _, key = self._heap[0]
            deadline = self._deadlines.get(key, math.inf)
            # An entry that an earlier one has replaced stays; it may have the deadline, too.
            is_current = entered == self._entered.get(key)
            if is_current and entered == deadline:
                return deadline
            heapq.heappop(self._heap)
            if is_current:
                # The deadline was postponed, so the key is only now entered at its new time.
                del self._entered[key]
                if deadline < math.inf:
                    self._enter(key, deadline)
        return math.inf

    def due(self, now: float) -> list[K]:
        """Return the keys that are due; each stays due until its deadline is set."""
        keys = []
        while self._earliest() <= now:
            _, _, key = heapq.heappop(self._heap)
            self._entered.pop(key, None)
            keys.append(key)
        for key in keys:
            self._enter(key, self._deadlines[key])
        return list(dict.fromkeys((*self._changed, *keys)))
