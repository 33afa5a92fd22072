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

"""A line that loses, repeats, delays and corrupts the same frames in each run."""

from __future__ import annotations

from dataclasses import dataclass
import heapq
import math
import random

# s; later frames within this time overtake a reordered frame.
OVERTAKEN_WITHIN = 0.05


@dataclass(frozen=True)
class Faults:
    """
    The faults of a line: shares (0..1) of the frames, each drawn independently.

    :param latency: s, for every frame.
    :param longest_delay: s; a delayed frame takes up to this much longer.
    """

    drop: float = 0.0
    duplicate: float = 0.0
    reorder: float = 0.0
    delay: float = 0.0
    corrupt: float = 0.0
    latency: float = 0.002
    longest_delay: float = 1.0


class FaultyWire:
    """
    One direction of a line; the caller passes the time.

    :ivar is_open: whether sent frames are delivered.
    """

    def __init__(self, faults: Faults, seed: int | str) -> None:
        self.faults = faults
        self.is_open = True
        self._random = random.Random(seed)
        self._travelling: list[tuple[float, int, bytes]] = []
        self._count = 0

    def send(self, frame: bytes, now: float) -> None:
        """Take a frame."""
        faults = self.faults
        if not self.is_open or self._happens(faults.drop):
            return
        for _ in range(2 if self._happens(faults.duplicate) else 1):
            arrival = now + faults.latency
            if self._happens(faults.reorder):
                arrival += self._random.uniform(0, OVERTAKEN_WITHIN)
            if self._happens(faults.delay):
                arrival += self._random.uniform(0, faults.longest_delay)
            data = self._corrupted(frame) if self._happens(faults.corrupt) else frame
            self._count += 1
            heapq.heappush(self._travelling, (arrival, self._count, data))

    def receive(self, now: float) -> list[bytes]:
        """Return the frames that have arrived, in the order of arrival."""
        arrived = []
        while self._travelling and self._travelling[0][0] <= now:
            arrived.append(heapq.heappop(self._travelling)[2])
        return arrived

    def next_arrival(self) -> float:
        """Return when the next frame arrives, infinity if the line is empty."""
        return self._travelling[0][0] if self._travelling else math.inf

    def switch(self, *, is_open: bool) -> None:
        """Open or cut the line; frames on it are lost."""
        self.is_open = is_open
        self._travelling.clear()

    def _happens(self, share: float) -> bool:
        # Do not draw for a share of 0: new kinds of faults then do not change old runs.
        return share > 0 and self._random.random() < share

    def _corrupted(self, frame: bytes) -> bytes:
        # Change one byte: a 16-bit CRC always detects a burst of 8 bits.
        at = self._random.randrange(len(frame))
        return frame[:at] + bytes([frame[at] ^ self._random.randrange(1, 256)]) + frame[at + 1:]
