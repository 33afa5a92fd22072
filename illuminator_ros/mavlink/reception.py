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

"""Believed frames from the bytes of many peers; no I/O, and time is passed in."""

from __future__ import annotations

import math

from .framing import Decoder, DecoderCounters, Frame
from .signing import Signing
from .transport import Peer

# Peers whose incomplete frames are kept apart.
MAX_DECODERS = 64
# s; the longest frame takes 0.3 s at 9600 baud. What has not come by then is no frame but noise
# that looks like the beginning of one, and good frames are held back behind it.
STALL = 0.5


class Reception:
    """
    The way in of a link: framing and signing.

    :ivar counters: what was met, over all peers and since it was made.
    """

    def __init__(self, signing: Signing) -> None:
        self.counters = DecoderCounters()
        self._signing = signing
        self._decoders: dict[Peer, Decoder] = {}
        # Where the frame begins that a peer has not completed, and since when it is awaited.
        self._stalled: dict[Peer, tuple[int, float]] = {}

    def __len__(self) -> int:
        return len(self._decoders)

    def take(self, peer: Peer, data: bytes, now: float, unix_time: float) -> list[Frame]:
        """Return the frames that bytes of a peer complete and that are to be believed."""
        decoder = self._decoders.get(peer)
        if decoder is None:
            if len(self._decoders) >= MAX_DECODERS:
                oldest = next(iter(self._decoders))
                del self._decoders[oldest]
                self._stalled.pop(oldest, None)
            decoder = self._decoders[peer] = Decoder(counters=self.counters)
        frames = decoder.feed(data)
        start = decoder.incomplete
        if start is None:
            self._stalled.pop(peer, None)
        elif peer not in self._stalled or self._stalled[peer][0] != start:
            self._stalled[peer] = start, now
        return self._believed(frames, unix_time)

    def give_up(self, now: float, unix_time: float) -> list[tuple[Peer, Frame]]:
        """Return the frames behind what looked like the beginning of one for too long."""
        if now < self.next_deadline():
            return []
        found = []
        for peer, (_, since) in list(self._stalled.items()):
            if now >= since + STALL:
                del self._stalled[peer]
                frames = self._decoders[peer].give_up()
                found += [(peer, frame) for frame in self._believed(frames, unix_time)]
        return found

    def next_deadline(self) -> float:
        """Return when :meth:`give_up` has something to do, infinity if never."""
        if not self._stalled:
            return math.inf
        return min(since for _, since in self._stalled.values()) + STALL

    def clear(self) -> None:
        """Forget what is incomplete: the link is closed."""
        self._decoders.clear()
        self._stalled.clear()

    def _believed(self, frames: list[Frame], unix_time: float) -> list[Frame]:
        return [frame for frame in frames if self._signing.accepts(frame, unix_time)]
