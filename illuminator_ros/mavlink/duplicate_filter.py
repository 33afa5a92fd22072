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

"""Copies of frames that return in a loop, or that come over two lines; no I/O, no clock."""

from __future__ import annotations

from collections import deque

from .frame import Frame
from .messages import Address

# s for which a frame is remembered.
MEMORY = 0.5
# Frames that are remembered: 0.5 s of 16,000 a second.
MAX_FRAMES = 8192
MAX_SOURCES = 256
# Sequence numbers wrap after 256 frames. A fast sender may then send an equal frame.
WRAP = 128


class DuplicateFilter:
    """
    Remembers the frames that were accepted lately, and the line of each.

    :ivar copies: how many copies have come and when the last came, s, by the indexes of
        the lines of the original and of the copy.
    """

    def __init__(self) -> None:
        self.copies: dict[tuple[int, int], tuple[int, float]] = {}
        # By the hash: when it came (s), how many of its source had come by then, and its line.
        self._frames: dict[int, tuple[float, int, int]] = {}
        self._order: deque[tuple[int, tuple[float, int, int]]] = deque()
        self._counts: dict[Address, int] = {}

    def __len__(self) -> int:
        return len(self._frames)

    def has(self, frame: Frame, now: float) -> bool:
        """Return whether a frame is a copy of an accepted frame."""
        found = self._frames.get(hash(frame.data))
        return (found is not None and now - found[0] < MEMORY
                and self._counts.get(frame.source, 0) - found[1] < WRAP)

    def is_copy(self, frame: Frame, line: int, now: float) -> bool:
        """Count a frame if it is a copy, and remember it otherwise; return whether it is one."""
        key = hash(frame.data)
        if key in self._frames and self.has(frame, now):
            pair = self._frames[key][2], line
            count, _ = self.copies.get(pair, (0, 0.0))
            self.copies[pair] = count + 1, now
            return True
        order, frames, counts = self._order, self._frames, self._counts
        while order and (now - order[0][1][0] >= MEMORY or len(order) >= MAX_FRAMES):
            old, entry = order.popleft()
            if frames.get(old) is entry:
                del frames[old]
        count = counts.pop(frame.source, 0) + 1
        # The source that was silent for longest is forgotten.
        if len(counts) >= MAX_SOURCES:
            del counts[next(iter(counts))]
        counts[frame.source] = count
        entry = now, count, line
        frames[key] = entry
        order.append((key, entry))
        return False
