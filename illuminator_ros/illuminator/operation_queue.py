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

"""Changes of one kind to one light: one is on its way, the others wait."""

from __future__ import annotations

from collections import deque
import math

from .operation import Operation

# Changes that may wait.
MAX_WAITING = 32


class OperationQueue:
    """The changes on their way and waiting, in the order in which they were asked for."""

    def __init__(self) -> None:
        self._operations: deque[Operation] = deque()

    @property
    def current(self) -> Operation | None:
        """Return the change that is on its way."""
        return self._operations[0] if self._operations else None

    def submit(self, operation: Operation, now: float) -> None:
        """Start a change, or put it behind the others."""
        if len(self._operations) >= MAX_WAITING:
            operation.fail(f'{MAX_WAITING} requests are waiting for light '
                           f'{operation.light.address} already', now)
            return
        self._operations.append(operation)
        if len(self._operations) == 1:
            operation.start(now)
            self.poll(now)

    def cancel(self, now: float) -> None:
        """End all changes, whether under way or waiting."""
        for operation in list(self._operations):
            operation.fail('cancelled', now)
        self._operations.clear()

    def poll(self, now: float) -> None:
        """Do what is due, and start what has waited."""
        for waiting in list(self._operations)[1:]:
            if now >= waiting.limit:
                waiting.fail('not sent: earlier requests took too long', now)
        if self._operations:
            self._operations[0].poll(now)
        while self._operations and self._operations[0].finished:
            self._operations.popleft()
            while self._operations and self._operations[0].finished:
                self._operations.popleft()
            if self._operations:
                self._operations[0].start(now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""
        if not self._operations:
            return math.inf
        first = self._operations[0]
        waiting = min((op.limit for op in list(self._operations)[1:]), default=math.inf)
        return -math.inf if first.finished else min(first.next_deadline(), waiting)
