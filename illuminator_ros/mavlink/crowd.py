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

"""A link that is busy with frames for others; no I/O, and time is passed in."""

from __future__ import annotations

import math

# s for which frames collect on a busy link. Waking up for one costs more than looking at ten.
COLLECTION = 0.02
# s for which every frame is taken at once after something was sent that may be answered.
HURRY = 1.0
# Frames that may collect: a UDP socket has room for twice as many wherever Linux is left as it is.
ROOM = 128
# s for which nothing collects after there was no room for all that had.
FLOOD = 10.0


class Crowd:
    """
    Decides whether it is worth waiting for several frames at once.

    It is where frames for others come more often than every two :data:`COLLECTION`, no flood of
    them, and nothing is expected. A light's status may then be late by one of them; an answer
    only where it takes longer than :data:`HURRY`.
    """

    def __init__(self) -> None:
        self._passed_at = -math.inf
        self._frames = 0
        self._hurry_until = -math.inf
        self._dense = False

    def passed(self, frames: int, now: float, *, more: bool = False) -> None:
        """
        Note that so many frames for others have come.

        :param more: whether that may not have been all, so that the next look belongs to this.
        """
        self._frames += frames
        if more:
            return
        gap, self._passed_at = now - self._passed_at, now
        self._dense = gap < 2 * COLLECTION and self._frames * COLLECTION < ROOM * gap
        if self._frames >= 2 * ROOM:
            self._hurry_until = max(self._hurry_until, now + FLOOD)
        self._frames = 0

    def asked(self, now: float) -> None:
        """Note that something was sent that may be answered."""
        self._hurry_until = max(self._hurry_until, now + HURRY)

    def collects(self, now: float) -> bool:
        """Return whether to wait before the next look; asked once before each."""
        dense, self._dense = self._dense, False
        return dense and now >= self._hurry_until
