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

"""The way out of a simulated light, on which messages may be lost, doubled, late or corrupted."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
import copy
import heapq
import itertools
import math
import random
from typing import Any

from .behaviour import Behaviour
from ..mavlink.messages import Address


class Outlet:
    """
    Sends what a light says, as its behaviour has it. No I/O; time is passed in.

    :param outgoing: where messages go in the end, with the address they are sent from.
    :param chance: draws what befalls each message, so that a seed gives the same run again.
    """

    def __init__(
        self, source: Address, outgoing: deque[tuple[Address, Any]], chance: random.Random,
    ) -> None:
        self._source = source
        self._outgoing = outgoing
        self._chance = chance
        self._late: list[tuple[float, int, Any]] = []
        self._order = itertools.count()

    def send(self, message: Any, behaviour: Behaviour, now: float) -> None:
        """Take a message."""
        if self._befalls(behaviour.drop):
            return
        if self._befalls(behaviour.corrupt):
            message = copy.copy(message)
            # Nobody can tell which byte of a frame with a wrong checksum was the wrong one.
            message.crc_extra = type(message).crc_extra ^ 0xFF
        for _ in range(2 if self._befalls(behaviour.duplicate) else 1):
            if behaviour.delay:
                due = now + self._chance.uniform(0.0, behaviour.delay)
                heapq.heappush(self._late, (due, next(self._order), message))
            else:
                self._outgoing.append((self._source, message))

    def poll(self, now: float) -> None:
        """Send what has been kept back for long enough."""
        while self._late and self._late[0][0] <= now:
            self._outgoing.append((self._source, heapq.heappop(self._late)[2]))

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do, infinity if never."""
        return self._late[0][0] if self._late else math.inf

    def clear(self) -> None:
        """Lose what has not been sent yet."""
        self._late.clear()

    def _befalls(self, share: float) -> bool:
        return share > 0 and self._chance.random() < share


class Schedule:
    """What a light will do later."""

    def __init__(self) -> None:
        self._entries: list[tuple[float, int, Callable[[float], None]]] = []
        self._order = itertools.count()

    def add(self, due: float, action: Callable[[float], None]) -> None:
        """Have ``action(now)`` called at ``due``."""
        heapq.heappush(self._entries, (due, next(self._order), action))

    def poll(self, now: float) -> None:
        """Do what is due."""
        while self._entries and self._entries[0][0] <= now:
            heapq.heappop(self._entries)[2](now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do, infinity if never."""
        return self._entries[0][0] if self._entries else math.inf

    def clear(self) -> None:
        """Forget it all."""
        self._entries.clear()
