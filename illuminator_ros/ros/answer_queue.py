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

"""Pauses between the answers of a service with many clients; no I/O, and time is passed in."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
import math
import threading

# Each client of a service receives the answers to all clients, and by default keeps the last 10
# only. A service with more than MAX_UNSPACED clients or open requests pauses after each answer,
# PAUSE_PER_CLIENT s for each of them, or less, so that the answers to requests that came together
# are sent within MAX_SPREAD s.
MAX_UNSPACED = 8
PAUSE_PER_CLIENT = 0.0006
MAX_SPREAD = 2.0
# s between two counts of the clients of a service.
CLIENT_COUNT_INTERVAL = 0.1
# Answers that wait; more would fill the memory and come too late.
MAX_WAITING = 250


class AnswerQueue:
    """
    The answers of one service.

    Methods are for the thread that takes the requests, unless they are callable in any thread.

    :param spread: s, the limit in place of :data:`MAX_SPREAD`.
    """

    def __init__(self, spread: float = MAX_SPREAD) -> None:
        self._spread = spread
        self._lock = threading.Lock()
        self._waiting: deque[Callable[[], None]] = deque()
        self._requests = self._answers = 0
        self._clients = 0
        self._count_due = -math.inf
        self._pause_ends = -math.inf

    def __len__(self) -> int:
        """Return how many answers wait."""
        return len(self._waiting)

    def note_request(self) -> None:
        """Note a request, which one answer will follow."""
        self._requests += 1

    def send_or_queue(self, answer: Callable[[], None], now: float) -> bool:
        """
        Send an answer, or have it wait for the end of the pause; callable in any thread.

        :param answer: sends it.
        :return: whether it was sent.
        """
        with self._lock:
            if self._waiting or now < self._pause_ends:
                self._waiting.append(answer)
                return False
            self._begin_pause(now)
        answer()
        return True

    def _begin_pause(self, now: float) -> None:
        count = max(self._requests - self._answers, self._clients)
        self._answers += 1
        if count > MAX_UNSPACED:
            self._pause_ends = now + min(count * PAUSE_PER_CLIENT, self._spread / count)

    def count_clients(self, count: Callable[[], int | None], now: float) -> None:
        """Count the clients if that is due; callable in any thread. None leaves the last count."""
        if now >= self._count_due:
            self._count_due = now + CLIENT_COUNT_INTERVAL
            clients = count()
            if clients is not None:
                self._clients = clients

    def poll(self, now: float) -> None:
        """Send the answers that are due, and those above :data:`MAX_WAITING`."""
        while self._waiting and (now >= self._pause_ends or len(self._waiting) > MAX_WAITING):
            with self._lock:
                answer = self._waiting.popleft()
                self._begin_pause(now)
            answer()

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do, infinity if never."""
        return self._pause_ends if self._waiting else math.inf
