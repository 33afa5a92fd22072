# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Frames of others that wait for a slow line; no I/O, no clock."""

from __future__ import annotations

from collections import Counter, deque
import itertools
import math
from typing import NamedTuple

from ..frame import Frame
from ..message_traits import Priority, traits_of

# Bytes that may wait, and s: a slow line gets less, so that its delay is bounded.
MAX_QUEUED = 16 * 1024
MIN_QUEUED = 2 * 1024
MAX_DELAY = 0.5
# s for which a frame is worth sending, by its priority: a command has been sent again by then.
MAX_AGES = {Priority.URGENT: 1.0, Priority.KEPT: 1.0, Priority.NEWEST: MAX_DELAY}


class _Held(NamedTuple):
    data: bytes
    message_id: int
    since: float


class ForwardQueue:
    """
    Frames that wait until a line has room, the urgent ones first.

    A frame that a newer one of its message and sender makes useless is replaced in its place.
    When the queue is full, frames of the last priority are dropped first, the oldest of each
    first.

    :param dropped: counts replaced and dropped frames, by message id.
    :param rate: of the line, bytes/s.
    """

    def __init__(self, dropped: Counter[int], rate: float = math.inf) -> None:
        self._dropped = dropped
        self._capacity = max(min(MAX_DELAY * rate, MAX_QUEUED), MIN_QUEUED)
        self._held: dict[Priority, dict[object, _Held]] = {one: {} for one in Priority}
        self._size = 0
        self._numbers = itertools.count()
        # The priorities that follow the urgent one, taken in turn.
        self._turns = deque((Priority.KEPT, Priority.NEWEST))

    def __bool__(self) -> bool:
        return self._size > 0

    @property
    def size(self) -> int:
        """Return the bytes that wait."""
        return self._size

    def put(self, frame: Frame, now: float) -> None:
        """Append a frame, or replace an older one."""
        traits = traits_of(frame.message_id)
        held = self._held[traits.priority]
        key: object = next(self._numbers)
        if traits.replaced:
            key = frame.message_id, frame.source, frame.payload[traits.instance]
            if old := held.get(key):
                self._size -= len(old.data)
                self._dropped[frame.message_id] += 1
        held[key] = _Held(frame.data, frame.message_id, now)
        self._size += len(frame.data)
        for priority in reversed(Priority):
            while self._size > self._capacity and self._held[priority]:
                self._dropped[self._remove(priority).message_id] += 1

    def pop(self, now: float) -> bytes:
        """Return the next frame that is still worth sending, b'' if there is none."""
        while self:
            urgent = self._held[Priority.URGENT]
            if not urgent:
                self._turns.rotate()
            priority = next(one for one in (Priority.URGENT, *self._turns) if self._held[one])
            held = self._remove(priority)
            if now - held.since < MAX_AGES[priority]:
                return held.data
            self._dropped[held.message_id] += 1
        return b''

    def _remove(self, priority: Priority) -> _Held:
        held = self._held[priority]
        one = held.pop(next(iter(held)))
        self._size -= len(one.data)
        return one
