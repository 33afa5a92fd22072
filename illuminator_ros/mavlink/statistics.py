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

"""Counting what a link carries, and what it loses."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from .messages import Address

# Sources that are told apart; frames of further ones are counted in the totals only.
MAX_SOURCES = 256
# How far back a late or repeated frame is still recognised. Two identical numbers further apart
# are two frames: the number has 8 bits.
WINDOW = 64
_ALL_SEEN = (1 << WINDOW) - 1
# s
RECENT = 10.0


class WindowedCounter(NamedTuple):
    """
    A growing counter, and its growth in the last :data:`RECENT` to twice that, s.

    :param samples: at most two of time (s) and count, the older first.
    """

    total: int = 0
    time: float = 0.0
    samples: tuple[tuple[float, int], ...] = ()

    def sample(self, total: int, now: float) -> WindowedCounter:
        """Return the counter with its new total."""
        samples = self.samples
        if not samples or now - samples[-1][0] >= RECENT:
            samples = (*samples[-1:], (now, total))
        return WindowedCounter(total, now, samples)

    @property
    def growth(self) -> int:
        """Return the growth within the window."""
        return self.total - self.samples[0][1] if self.samples else 0

    @property
    def rate(self) -> float:
        """Return the growth per second."""
        elapsed = self.time - self.samples[0][0] if self.samples else 0.0
        return self.growth / elapsed if elapsed > 0 else 0.0


@dataclass(slots=True)
class SequenceCounter:
    """
    Frames of one source by their sequence numbers (0..255, wrapping).

    A frame that comes twice is a duplicate and one that comes late is reordered; neither is a
    loss. Behind a router that leaves out messages, what it leaves out looks lost.
    """

    received: int = 0
    lost: int = 0
    duplicate: int = 0
    reordered: int = 0
    _newest: int = -1
    # The number that follows, -1 while that is not known.
    _next: int = -1
    # Bit i is set where number newest - i has come.
    _seen: int = 0
    _recently_lost: WindowedCounter = WindowedCounter()
    _recently_received: WindowedCounter = WindowedCounter()

    def add(self, sequence: int) -> None:
        """Take the number of a frame that has come."""
        self.received += 1
        if sequence == self._next:
            self._newest, self._next = sequence, (sequence + 1) & 0xFF
            self._seen = (self._seen << 1 | 1) & _ALL_SEEN
            return
        self._add_irregular(sequence)
        self._next = (self._newest + 1) & 0xFF

    def _add_irregular(self, sequence: int) -> None:
        if self._newest < 0:
            # Nothing is known of what went before, so nothing of it is missing.
            self._newest, self._seen = sequence, _ALL_SEEN
            return
        ahead = (sequence - self._newest) & 0xFF
        back = 256 - ahead
        if 0 < ahead <= 128 or back > WINDOW - 1 and ahead:
            self.lost += ahead - 1 if ahead <= 128 else 0
            seen = self._seen << ahead | 1 if ahead <= 128 else _ALL_SEEN
            self._seen = seen & (_ALL_SEEN)
            self._newest = sequence
        elif not ahead or self._seen >> back & 1:
            self.duplicate += 1
        else:
            self._seen |= 1 << back
            self.reordered += 1
            self.lost -= 1

    def restart(self) -> None:
        """Forget the numbers but not the counts: what comes next follows on nothing."""
        self._newest = self._next = -1

    def reset_loss(self) -> None:
        """Forget recent losses: the sequence numbers of the sender have restarted."""
        self._recently_lost = self._recently_received = WindowedCounter()

    def sample(self, now: float) -> None:
        """Update the recent loss."""
        self._recently_lost = self._recently_lost.sample(self.lost, now)
        self._recently_received = self._recently_received.sample(
            self.received - self.duplicate, now)

    @property
    def recent_loss(self) -> float:
        """Return the share of frames lost recently, %, as of the last sample."""
        lost, received = self._recently_lost.growth, self._recently_received.growth
        return 100.0 * max(lost, 0) / (lost + received) if lost + received > 0 else 0.0


@dataclass(slots=True)
class Traffic:
    """
    The traffic of a link since it was made.

    :param bytes_received: all, good or not.
    :param frames_dropped: those that found no room to go out.
    """

    bytes_received: int = 0
    bytes_sent: int = 0
    frames_sent: int = 0
    frames_dropped: int = 0
    sources: dict[Address, SequenceCounter] = field(default_factory=dict)
    _frames_of_others: int = 0
    _in: WindowedCounter = WindowedCounter()
    _out: WindowedCounter = WindowedCounter()

    @property
    def frames_received(self) -> int:
        """Those that came with the right checksum."""
        return self._frames_of_others + sum(
            counter.received for counter in self.sources.values())

    @property
    def received_rate(self) -> float:
        """Return the bytes received per second recently, as of the last sample."""
        return self._in.rate

    @property
    def sent_rate(self) -> float:
        """Return the bytes sent per second recently, as of the last sample."""
        return self._out.rate

    def snapshot(self, now: float) -> Traffic:
        """Update the recent values and return a copy."""
        self._in = self._in.sample(self.bytes_received, now)
        self._out = self._out.sample(self.bytes_sent, now)
        for counter in self.sources.values():
            counter.sample(now)
        return replace(self, sources={
            source: copy(counter) for source, counter in self.sources.items()})

    def count(self, source: Address, sequences: bytes | bytearray) -> None:
        """Count frames with the right checksum by their sequence numbers."""
        counter = self.sources.get(source)
        if counter is None:
            if len(self.sources) >= MAX_SOURCES:
                self._frames_of_others += len(sequences)
                return
            counter = self.sources[source] = SequenceCounter()
        for sequence in sequences:
            counter.add(sequence)

    def restart(self) -> None:
        """Forget the sequence numbers but not the counts: the link was interrupted."""
        for counter in self.sources.values():
            counter.restart()
