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

"""Requests of ROS callbacks to the link, and their answers."""

from __future__ import annotations

from collections.abc import Callable, Hashable
import threading
from typing import Any, TypeVar

from .throttled_log import NodeLog
from ..mavlink.link import Link

T = TypeVar('T')

# Requests of one kind that may wait for their answers.
MAX_PENDING = 64

# Called in the link's thread with the time, s, and with the function that it must call once with
# its answer, then or later.
LinkRequest = Callable[[float, Callable[[T], None]], None]


class LinkCalls:
    """
    Requests for the link's thread.

    :param limit: how many of one kind may wait for their answers; one more is refused at once.
    """

    def __init__(self, link: Link, log: NodeLog, limit: int = MAX_PENDING) -> None:
        self._link = link
        self._log = log
        self._limit = limit
        # Kind and refusal of each request that waits, by the function that ends it. Untyped: the
        # answers of requests have different types.
        self._waiting: dict[Callable[[Any], None], tuple[Hashable, Callable[[str], Any]]] = {}
        self._lock = threading.Lock()

    def ask(
        self, request: LinkRequest[T], answer: Callable[[T], None], refusal: Callable[[str], T],
        kind: Hashable = None,
    ) -> None:
        """
        Start a request.

        :param answer: called once with the answer, in any thread.
        :param refusal: returns the answer for a reason why the request cannot be executed.
        :param kind: an OFF is of another kind than an ON, so that no number of these refuses it.
        """
        def end(value: T) -> None:
            with self._lock:
                if self._waiting.pop(end, None) is None:
                    return
            answer(value)

        def run(now: float) -> None:
            try:
                request(now, end)
            except Exception as error:
                reason = f'internal error: {error!r}'
                self._log.error(reason, 'request')
                end(refusal(reason))

        with self._lock:
            busy = sum(one == kind for one, _ in self._waiting.values()) >= self._limit
            if not busy:
                self._waiting[end] = kind, refusal
        if busy:
            answer(refusal(f'busy: {self._limit} requests wait for an answer already'))
            return
        self._link.call(run)

    def refuse_waiting(self, reason: str) -> None:
        """Answer the requests that wait with a refusal; callable in any thread."""
        with self._lock:
            waiting = tuple(self._waiting.items())
        for end, (_, refusal) in waiting:
            end(refusal(reason))
