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

from dataclasses import dataclass, field

from .messages import Address

# Sources that are told apart; frames of further ones are counted in the totals only.
MAX_SOURCES = 256
# How far back a late or repeated frame is still recognised. Two identical numbers further apart
# are two frames: the number has 8 bits.
WINDOW = 64
_ALL_SEEN = (1 << WINDOW) - 1
# s
LATELY = 10.0


@dataclass(slots=True)
class Lately:
    """By how much a counter has grown in the last :data:`LATELY` to twice that, s."""

    _marks: list[tuple[float, int]] = field(default_factory=list)

    def over(self, count: int, now: float) -> int:
        """Return the growth until now. To be asked now and then, with a growing counter."""
        return count - self._mark(count, now)[1]

    def rate(self, count: int, now: float) -> float:
        """Return the growth per second."""
        then, before = self._mark(count, now)
        return (count - before) / (now - then) if now > then else 0.0

    def _mark(self, count: int, now: float) -> tuple[float, int]:
        if not self._marks or now - self._marks[-1][0] >= LATELY:
            self._marks = [*self._marks[-1:], (now, count)]
        return self._marks[0]


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
    _lost_lately: Lately = field(default_factory=Lately)
    _received_lately: Lately = field(default_factory=Lately)

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

    def forgive(self) -> None:
        """Have nothing lost lately: the sender has begun to count anew, so numbers are missing."""
        self._lost_lately = Lately()
        self._received_lately = Lately()

    def recent_loss(self, now: float) -> float:
        """Return the share of frames lost lately, %."""
        lost = self._lost_lately.over(self.lost, now)
        received = self._received_lately.over(self.received - self.duplicate, now)
        return 100.0 * max(lost, 0) / (lost + received) if lost + received > 0 else 0.0


@dataclass(slots=True)
class Traffic:
    """
    What went over a link since it was made.

    :param bytes_received: all, good or not.
    :param frames_dropped: those that found no room to go out.
    """

    bytes_received: int = 0
    bytes_sent: int = 0
    frames_sent: int = 0
    frames_dropped: int = 0
    sources: dict[Address, SequenceCounter] = field(default_factory=dict)
    _frames_of_others: int = 0
    _in: Lately = field(default_factory=Lately)
    _out: Lately = field(default_factory=Lately)

    @property
    def frames_received(self) -> int:
        """Those that came with the right checksum; from any thread."""
        return self._frames_of_others + sum(
            counter.received for counter in list(self.sources.values()))

    def received_rate(self, now: float) -> float:
        """Return the bytes that came per second lately."""
        return self._in.rate(self.bytes_received, now)

    def sent_rate(self, now: float) -> float:
        """Return the bytes that went out per second lately."""
        return self._out.rate(self.bytes_sent, now)

    def count(self, source: Address, sequence: int) -> None:
        """Count a frame with the right checksum."""
        counter = self.sources.get(source)
        if counter is None:
            if len(self.sources) >= MAX_SOURCES:
                self._frames_of_others += 1
                return
            counter = self.sources[source] = SequenceCounter()
        counter.add(sequence)

    def restart(self) -> None:
        """Forget the sequence numbers but not the counts: the link was interrupted."""
        for counter in self.sources.values():
            counter.restart()
