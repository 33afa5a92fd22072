# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Requests of ROS callbacks to the link, and their answers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable
import threading
from typing import TypeVar

from .throttled_log import NodeLog
from ..mavlink.link import Link

T = TypeVar('T')

# Why a request is not executed at the end of the process.
ENDING = 'the bridge is ending'
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
        # How many of each kind wait.
        self._waiting: Counter[Hashable] = Counter()
        self._lock = threading.Lock()

    def ask(
        self, request: LinkRequest[T], answer: Callable[[T], None], refusal: Callable[[str], T],
        kind: Hashable = None,
    ) -> None:
        """
        Start a request.

        :param answer: called once with the answer, in the link's thread, or at once.
        :param refusal: returns the answer for a reason why the request cannot be executed.
        :param kind: an OFF is of another kind than an ON, so that no number of these refuses it.
        """
        if not self._link.is_running():
            answer(refusal(ENDING))
            return
        with self._lock:
            is_busy = self._waiting[kind] >= self._limit
            self._waiting[kind] += not is_busy
        if is_busy:
            answer(refusal(f'busy: {self._limit} requests wait for an answer already'))
            return
        is_waiting = True

        def end(value: T) -> None:
            nonlocal is_waiting
            if is_waiting:
                is_waiting = False
                with self._lock:
                    self._waiting[kind] -= 1
                answer(value)

        def run(now: float) -> None:
            try:
                request(now, end)
            except Exception as error:
                reason = f'internal error: {error!r}'
                self._log.error(reason, 'request')
                end(refusal(reason))

        self._link.call(run)
