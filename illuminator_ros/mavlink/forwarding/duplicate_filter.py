# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Copies of frames that return in a loop, or that come over several paths; no I/O, no clock."""

from __future__ import annotations

from collections import OrderedDict
from typing import NamedTuple

from ..transport import Peer

# s for which a frame is remembered: a loop through a radio is slow.
MEMORY = 5.0
# Frames that are remembered: 5 s of 6,500 a second. Each takes up to 300 bytes.
MAX_FRAMES = 32768


class Path(NamedTuple):
    """The index of a line, and the neighbour on it; see :meth:`~.transport.Channel.leads_to`."""

    line: int
    neighbour: Peer


# The path of the frames that we send.
OWN = Path(-1, None)


class _Arrival(NamedTuple):
    """
    The last arrival of a frame.

    :param other: the last one over another path, None if there was none.
    """

    at: float
    path: Path
    other: _Arrival | None = None

    def copied_from(self, path: Path, now: float) -> Path | None:
        """Return the other path over which the frame came lately, None if it came over none."""
        other = self if path != self.path else self.other
        return other.path if other is not None and now - other.at < MEMORY else None


class DuplicateFilter:
    """
    Remembers the frames that were accepted lately, and over which paths they came.

    A frame is a copy if it came over another path lately, byte for byte. Equal frames over one
    path are several frames: some devices send each frame with the same sequence number.

    :ivar copies: how many copies have come and when the last came, s, by the indexes of
        the lines of the original and of the copy.
    """

    def __init__(self) -> None:
        self.copies: dict[tuple[int, int], tuple[int, float]] = {}
        # By the hash of the frame, in the order of arrival; the front of a dict is slow to remove.
        self._arrivals: OrderedDict[int, _Arrival] = OrderedDict()

    def is_copy(self, frame: bytes, path: Path, now: float) -> bool:
        """Return whether a frame is a copy of an accepted or sent frame, and count it if so."""
        key = hash(frame)
        last = self._arrivals.get(key)
        original = last.copied_from(path, now) if last else None
        if original is None:
            return False
        self._add(key, path, now)
        pair = original.line, path.line
        count, _ = self.copies.get(pair, (0, 0.0))
        self.copies[pair] = count + 1, now
        return True

    def add(self, frame: bytes, path: Path, now: float) -> None:
        """Remember a frame that is accepted or sent."""
        self._add(hash(frame), path, now)
        arrivals = self._arrivals
        while len(arrivals) > MAX_FRAMES or now - next(iter(arrivals.values())).at >= MEMORY:
            arrivals.popitem(last=False)

    def _add(self, key: int, path: Path, now: float) -> None:
        last = self._arrivals.pop(key, None)
        if last is not None:
            other = last if path != last.path else last.other
            last = other and other._replace(other=None)
        self._arrivals[key] = _Arrival(now, path, last)
