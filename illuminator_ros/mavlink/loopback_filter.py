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

"""Our own frames that come back: over a broadcast, a loop of routers, a hub."""

from __future__ import annotations

from collections import deque

from .frame import Frame
from .messages import Address

# s; a frame that comes back does so soon. Each second that is remembered is one more sequence
# number of which the heartbeat of somebody else with our address would pass for ours.
MEMORY = 1.0
# Frames; what one light needs in a second, many times over.
MAX_FRAMES = 64

_Key = tuple[Address, int, int, bytes]


class LoopbackFilter:
    """Remembers what was sent lately, to tell it from what somebody else sends as us."""

    def __init__(self) -> None:
        self._sent: deque[tuple[float, _Key]] = deque(maxlen=MAX_FRAMES)

    def sent(
        self, source: Address, sequence: int, message_id: int, payload: bytes, now: float,
    ) -> None:
        """Note a frame that goes out."""
        self._sent.append((now, (source, sequence, message_id, payload.rstrip(b'\0'))))

    def has(self, frame: Frame, now: float) -> bool:
        """Return whether a frame is one of ours."""
        key = (frame.source, frame.sequence, frame.message_id, frame.payload.rstrip(b'\0'))
        return any(now - at <= MEMORY and key == sent for at, sent in self._sent)
