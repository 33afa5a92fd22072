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

"""
Authenticated frames from the bytes of many peers; no I/O, and time is passed in.

pymavlink has one parser for all peers of a port, so a piece of a frame from one peer spoils the
frames of another, and no limit on the wait for the rest of a frame.
"""

from __future__ import annotations

from collections.abc import Collection
import math
from typing import NamedTuple

from .dialect import CRC_EXTRA
from .duplicate_filter import DuplicateFilter
from .frame import Decoder, DecoderCounters, ForeignFrames, Frame
from .signing import Signing
from .transport import Peer

# Peers whose incomplete frames are kept apart.
MAX_DECODERS = 64
# s; the longest frame takes 0.3 s at 9600 baud. An older beginning of a frame is noise, which
# delays the valid frames after it.
STALL = 0.5


class _Wait(NamedTuple):
    """The wait for the rest of a frame: its position, the bytes taken by then, the time (s)."""

    start: int
    taken: int
    since: float


class _Stream:
    """The bytes and frames of one peer."""

    def __init__(self, counters: DecoderCounters) -> None:
        self.decoder = Decoder(counters=counters)
        # Whether an authenticated frame has ever come.
        self.good = False


class FrameReader:
    """
    The receiving side of a link: framing and signing.

    :param handled: ids of the messages that are read; frames of others are only counted, unless
        their signatures matter.
    :param duplicates: the frames that any of several lines has accepted, None if there is one
        line. Frames of other messages are then forwarded, and not only counted.
    :ivar counters: totals over all peers since it was made.
    :ivar waits: the waits for rests of frames, by peer.
    """

    def __init__(
        self, signing: Signing, handled: Collection[int],
        duplicates: DuplicateFilter | None = None,
    ) -> None:
        self.counters = DecoderCounters()
        self._signing = signing
        self._signing_is_off = not signing.signs
        self._duplicates = duplicates
        # Making a Frame of each foreign frame takes twice the time on a busy link.
        self._foreign = {} if not self._signing_is_off or duplicates is not None else {
            id_: bytes((crc_extra,)) for id_, crc_extra in CRC_EXTRA.items() if id_ not in handled}
        self._streams: dict[Peer, _Stream] = {}
        self.waits: dict[Peer, _Wait] = {}

    def __len__(self) -> int:
        return len(self._streams)

    def take(
        self, peer: Peer, data: bytes, now: float, unix_time: float,
    ) -> list[Frame | ForeignFrames]:
        """Return the frames that bytes of a peer complete and whose signature is accepted."""
        stream = self._streams.get(peer)
        if stream is None:
            stream = self._new_stream(peer)
        decoder = stream.decoder
        frames = decoder.sort(data, self._foreign)
        if decoder.rest or self.waits:
            self._watch(peer, decoder, now)
        if frames:
            # An unsigned frame is accepted where signing is off; this test saves a call.
            frames = [one for one in frames if isinstance(one, ForeignFrames)
                      or self._signing_is_off and one.signature is None
                      or self._accepts(one, now, unix_time)]
            stream.good = stream.good or bool(frames)
        return frames

    def _accepts(self, frame: Frame, now: float, unix_time: float) -> bool:
        # A copy of an accepted frame is not a replay.
        return (self._duplicates is not None and self._duplicates.has(frame, now)
                or self._signing.accepts(frame, unix_time))

    def _new_stream(self, peer: Peer) -> _Stream:
        if len(self._streams) >= MAX_DECODERS:
            # Garbage from ever new ports must not displace peers that send valid frames.
            oldest = next((old for old, stream in self._streams.items() if not stream.good),
                          next(iter(self._streams)))
            del self._streams[oldest]
            self.waits.pop(oldest, None)
        self._streams[peer] = stream = _Stream(self.counters)
        return stream

    def _watch(self, peer: Peer, decoder: Decoder, now: float) -> None:
        start = decoder.incomplete
        if start is None:
            self.waits.pop(peer, None)
        elif peer not in self.waits or self.waits[peer].start != start:
            self.waits[peer] = _Wait(start, decoder.taken, now)

    def give_up(self, now: float, unix_time: float) -> list[tuple[Peer, Frame]]:
        """
        Return the valid frames behind beginnings of frames that are older than :data:`STALL`.

        Later bytes may be the beginning of a valid frame, and are kept.
        """
        if now < self.next_deadline():
            return []
        found = []
        for peer, wait in list(self.waits.items()):
            if now >= wait.since + STALL:
                decoder = self._streams[peer].decoder
                frames = decoder.give_up(wait.taken)
                self._watch(peer, decoder, now)
                found += [(peer, frame) for frame in frames
                          if self._accepts(frame, now, unix_time)]
        return found

    def next_deadline(self) -> float:
        """Return when :meth:`give_up` has something to do, infinity if never."""
        if not self.waits:
            return math.inf
        return min(wait.since for wait in self.waits.values()) + STALL

    def clear(self) -> None:
        """Forget all peers and incomplete frames: the link is closed."""
        self._streams.clear()
        self.waits.clear()
