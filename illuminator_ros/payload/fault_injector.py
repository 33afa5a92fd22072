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

"""Faults of a link, injected into the messages that one simulated component sends."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
import copy
from functools import partial
import heapq
import itertools
import math
import random
from typing import Any

from .faults import Behaviour
from ..mavlink.messages import Address


class Schedule:
    """Actions that are due later, in the order of their times."""

    def __init__(self) -> None:
        self._entries: list[tuple[float, int, Callable[[float], None]]] = []
        self._order = itertools.count()

    def add(self, due: float, action: Callable[[float], None]) -> None:
        """Call ``action(now)`` when it is due."""
        heapq.heappush(self._entries, (due, next(self._order), action))

    def poll(self, now: float) -> None:
        """Do everything that is due."""
        while self._entries and self._entries[0][0] <= now:
            heapq.heappop(self._entries)[2](now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` is due, infinity if never."""
        return self._entries[0][0] if self._entries else math.inf

    def clear(self) -> None:
        """Drop all actions."""
        self._entries.clear()


class FaultInjector:
    """
    Drops, corrupts, duplicates and delays messages. No I/O; time is passed in.

    :param outgoing: takes the messages that are sent, each with the address that sends it.
    :param schedule: sends the delayed ones.
    :param seed: the same seed gives the same faults again.
    """

    def __init__(
        self, address: Address, outgoing: deque[tuple[Address, Any]], schedule: Schedule,
        seed: int = 0,
    ) -> None:
        self._address = address
        self._outgoing = outgoing
        self._schedule = schedule
        self._random = random.Random(f'{seed} {address}')

    def send(self, message: Any, behaviour: Behaviour, now: float) -> None:
        """Send a message with the faults of a behaviour."""
        if not behaviour.link_faults:
            self._transmit(message, now)
            return
        if self._occurs(behaviour.drop):
            return
        if self._occurs(behaviour.corrupt):
            message = copy.copy(message)
            # A receiver cannot tell which byte of a frame with a wrong checksum was changed.
            message.crc_extra = type(message).crc_extra ^ 0xFF
        for _ in range(2 if self._occurs(behaviour.duplicate) else 1):
            if behaviour.delay:
                self._schedule.add(now + self._random.uniform(0.0, behaviour.delay),
                                   partial(self._transmit, message))
            else:
                self._transmit(message, now)

    def _transmit(self, message: Any, now: float) -> None:
        self._outgoing.append((self._address, message))

    def _occurs(self, share: float) -> bool:
        return share > 0 and self._random.random() < share
