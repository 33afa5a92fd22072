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

"""When the answers of a service with many clients may be sent; no I/O, and time is passed in."""

from __future__ import annotations

import math
import threading

# Each client of a service receives the answers to all clients, and by default keeps the last 10
# only. A service with more than MAX_UNSPACED clients or open requests pauses after each answer,
# PAUSE_PER_CLIENT s for each of them, or less, so that the answers to requests that came together
# are sent within MAX_SPREAD s.
MAX_UNSPACED = 8
PAUSE_PER_CLIENT = 0.0006
MAX_SPREAD = 2.0


class AnswerSpacing:
    """
    The times of the answers of one service; callable from any thread.

    :param spread: s, the limit in place of :data:`MAX_SPREAD`.
    :ivar clients: how many the service has.
    """

    def __init__(self, spread: float = MAX_SPREAD) -> None:
        self.clients = 0
        self._spread = spread
        self._lock = threading.Lock()
        self._open = 0
        self._pause_ends = -math.inf

    def note_request(self) -> None:
        """Note a request, which one answer will follow."""
        with self._lock:
            self._open += 1

    def time_of_answer(self, now: float) -> float:
        """Return when the next answer may be sent, which is ``now`` or later."""
        with self._lock:
            count, due = max(self._open, self.clients), max(self._pause_ends, now)
            if count > MAX_UNSPACED:
                rest = max(now + self._spread - due, 0.0)
                self._pause_ends = due + min(
                    count * PAUSE_PER_CLIENT, self._spread / count, rest / max(self._open, 1))
            self._open -= 1
            return due
