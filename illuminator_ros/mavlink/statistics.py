# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Counts of the bytes and frames that a link carries and loses."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from .frame import Frame
from .messages import Address

# Sources that are counted separately; frames of further ones are counted in the totals only.
MAX_SOURCES = 256
# How far back a late or repeated frame is still recognised. Two identical numbers further apart
# are two frames: the number has 8 bits.
WINDOW = 64
_ALL_SEEN = (1 << WINDOW) - 1
# Consecutive numbers, more than most reads bring.
_CONSECUTIVE = bytes(range(256)) * 8
# s
RECENT = 10.0


class Window:
    """The growth of some counters in the last :data:`RECENT` to twice that, s."""

    def __init__(self) -> None:
        # At most two of time (s) and totals, the older first, RECENT apart.
        self._samples: tuple[tuple[float, tuple[int, ...]], ...] = ()

    def growth(self, now: float, *totals: int) -> tuple[float, ...]:
        """Return for how long the counters are known, s, and by how much each has grown."""
        if not self._samples or now - self._samples[-1][0] >= RECENT:
            self._samples = (*self._samples[-1:], (now, totals))
        since, before = self._samples[0]
        return now - since, *(new - old for new, old in zip(totals, before, strict=True))


class SourceCounts(NamedTuple):
    """
    Frames of one source; see :class:`SequenceCounter`.

    :param lost: None where it is unknown, and ``recent_loss``.
    :param recent_loss: share of frames lost recently, %.
    """

    received: int
    lost: int | None
    duplicate: int
    reordered: int
    recent_loss: float | None


@dataclass(slots=True)
class SequenceCounter:
    """
    Frames of one source by their sequence numbers (0..255, wrapping).

    A frame that comes twice is a duplicate and one that comes late is reordered; neither is a
    loss. A missing number is a loss only where each frame of the source should have come.

    A jump farther than :data:`WINDOW` counts no loss: the sender has restarted, another one has
    this address, or the component has a second counter.

    :ivar is_complete: whether each frame should have come, so that a missing one is lost.
    """

    received: int = 0
    lost: int = 0
    duplicate: int = 0
    reordered: int = 0
    is_complete: bool = True
    _newest: int = -1
    # The number that follows, -1 while that is not known.
    _next: int = -1
    # Bit i is set where number newest - i has come.
    _seen: int = 0
    _recent: Window = field(default_factory=Window, compare=False)

    def add(self, sequence: int) -> None:
        """Take the number of a frame that has come."""
        self.received += 1
        if sequence == self._next:
            self._newest, self._next = sequence, (sequence + 1) & 0xFF
            self._seen = (self._seen << 1 | 1) & _ALL_SEEN
        else:
            self._add_irregular(sequence)
            self._next = (self._newest + 1) & 0xFF

    def add_run(self, sequences: bytes | bytearray) -> None:
        """Take the numbers of frames, in order; consecutive ones, which most are, in one step."""
        count, first = len(sequences), self._next
        if sequences == _CONSECUTIVE[first:first + count]:
            self.received += count
            self._newest, self._next = sequences[-1], (sequences[-1] + 1) & 0xFF
            self._seen = ((self._seen + 1 << count) - 1) & _ALL_SEEN
        else:
            for sequence in sequences:
                self.add(sequence)

    def _add_irregular(self, sequence: int) -> None:
        back = (self._newest - sequence) & 0xFF
        if self._newest < 0 or WINDOW <= back < 256 - WINDOW:
            # The frames before the first one are not known, so they do not count as lost.
            self._newest, self._seen = sequence, _ALL_SEEN
        elif back < WINDOW and self._seen >> back & 1:
            self.duplicate += 1
        elif back < WINDOW:
            self._seen |= 1 << back
            self.reordered += 1
            self.lost -= 1
        else:
            ahead = 256 - back
            self.lost += ahead - 1
            self._seen = (self._seen << ahead | 1) & _ALL_SEEN
            self._newest = sequence

    def restart(self) -> None:
        """Forget the numbers but not the counts: the next frame has no predecessor."""
        self._newest = self._next = -1

    def reset_loss(self) -> None:
        """Forget recent losses: the sequence numbers of the sender have restarted."""
        self._recent = Window()

    def snapshot(self, now: float) -> SourceCounts:
        """Update the recent loss and return the counts."""
        if not self.is_complete:
            self.lost = 0
            self.reset_loss()
            return SourceCounts(self.received, None, self.duplicate, self.reordered, None)
        _, lost, received = self._recent.growth(now, self.lost, self.received - self.duplicate)
        return SourceCounts(
            self.received, max(self.lost, 0), self.duplicate, self.reordered,
            100.0 * max(lost, 0) / (lost + received) if lost + received > 0 else 0.0)


class TrafficSnapshot(NamedTuple):
    """
    The traffic of a link at one moment.

    :param bytes_received: all bytes, valid or not.
    :param frames_received: frames with a right checksum.
    :param frames_dropped: frames that were dropped before they were sent.
    :param received_rate: bytes per second recently, and ``sent_rate``.
    """

    bytes_received: int
    bytes_sent: int
    frames_received: int
    frames_sent: int
    frames_dropped: int
    received_rate: float
    sent_rate: float
    sources: dict[Address, SourceCounts]


@dataclass(slots=True)
class Traffic:
    """
    The traffic of a line since it was made; see :class:`TrafficSnapshot`.

    :param sources: the counters of all sources; several lines may share them.
    """

    bytes_received: int = 0
    frames_received: int = 0
    bytes_sent: int = 0
    frames_sent: int = 0
    frames_dropped: int = 0
    sources: dict[Address, SequenceCounter] = field(default_factory=dict)
    _recent: Window = field(default_factory=Window)

    def snapshot(self, now: float) -> TrafficSnapshot:
        """Update the recent values and return all."""
        elapsed, *grown = self._recent.growth(now, self.bytes_received, self.bytes_sent)
        received_rate, sent_rate = (bytes_ / elapsed if elapsed else 0.0 for bytes_ in grown)
        return TrafficSnapshot(
            self.bytes_received, self.bytes_sent,
            self.frames_received, self.frames_sent, self.frames_dropped, received_rate, sent_rate,
            {source: counter.snapshot(now) for source, counter in self.sources.items()})

    def count(self, frame: Frame) -> None:
        """Count a frame."""
        self.frames_received += 1
        counter = self.sources.get(frame.source) or self._new_counter(frame.source)
        if counter is not None:
            counter.add(frame.sequence)

    def count_run(self, source: Address, sequences: bytes | bytearray) -> None:
        """
        Count consecutive frames of one source.

        :param sequences: their sequence numbers, at least one.
        """
        self.frames_received += len(sequences)
        counter = self.sources.get(source) or self._new_counter(source)
        if counter is not None:
            counter.add_run(sequences)

    def _new_counter(self, source: Address) -> SequenceCounter | None:
        """Return the counter of a new source, None if there are too many sources."""
        if len(self.sources) >= MAX_SOURCES:
            return None
        counter = self.sources[source] = SequenceCounter()
        return counter
