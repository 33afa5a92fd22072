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

"""The receiving side of a line: accepted frames, the routes that they show, and statistics."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
import math

from .duplicate_filter import DuplicateFilter
from .frame import DecoderCounters, ForeignFrames, Frame
from .frame_reader import FrameReader
from .frame_writer import FrameWriter
from .messages import Address
from .routing_table import RoutingTable
from .signing import Signing
from .statistics import SequenceCounter, Traffic
from .transport import Peer

# To wake the loop costs as much as ten foreign frames. Where more than BATCH_THRESHOLD come per
# second, the loop pauses for BATCH_TIME s, or until BATCH_SIZE are expected; a UDP socket has room
# for 250.
BATCH_THRESHOLD = 1000.0
BATCH_TIME = 0.02
BATCH_SIZE = 128

# A frame and its sender, see :class:`~.statistics.SequenceCounter`.
ReceivedFrame = tuple[Frame, int]


class Receiver:
    """
    Accepts frames of other components, except those of ours that have returned.

    :param handled: see :class:`~.frame_reader.FrameReader`.
    :param writer: has written our frames.
    :param sources: see :class:`~.statistics.Traffic`.
    :param duplicates: the frames that any of several lines has accepted, None if there is one
        line. A copy of one of these shows a route, but is not returned.
    :param line: the index of the line.
    :ivar traffic: of the line; the sending side counts here, too.
    :ivar routes: the peers over which components were heard.
    :ivar waits: see :class:`~.frame_reader.FrameReader`.
    :ivar leads_to: see :meth:`~.transport.base.Channel.leads_to`.
    """

    def __init__(
        self, signing: Signing, handled: Collection[int], writer: FrameWriter,
        wall_clock: Callable[[], float], sources: dict[Address, SequenceCounter],
        duplicates: DuplicateFilter | None = None, line: int = 0,
    ) -> None:
        self.traffic = Traffic(sources=sources)
        self.routes = RoutingTable()
        self.leads_to: Callable[[Peer], Peer] = lambda peer: peer
        self._reader = FrameReader(signing, handled, duplicates)
        self.waits = self._reader.waits
        self._writer = writer
        self._duplicates = duplicates
        self._line = line
        self._wall_clock = wall_clock
        # Foreign frames at the last pause, and the time of that.
        self._foreign = 0
        self._foreign_at = -math.inf

    @property
    def counters(self) -> DecoderCounters:
        """See :class:`~.frame_reader.FrameReader`."""
        return self._reader.counters

    def take(self, peer: Peer, data: bytes, now: float) -> list[ReceivedFrame] | None:
        """
        Return the frames to handle that bytes of a peer complete.

        :return: None if no frame was accepted, foreign frames included.
        """
        self.traffic.bytes_received += len(data)
        return self._accept(peer, self._reader.take(peer, data, now, self._wall_clock()), now)

    def give_up(self, now: float) -> list[tuple[Peer, list[ReceivedFrame]]]:
        """Return the frames behind beginnings of frames that are too old, by peer."""
        return [(peer, accepted) for peer, frame in self._reader.give_up(now, self._wall_clock())
                if (accepted := self._accept(peer, [frame], now)) is not None]

    def next_deadline(self) -> float:
        """Return when :meth:`give_up` has something to do, infinity if never."""
        return self._reader.next_deadline()

    def pause(self, now: float) -> float:
        """Return for how long to let foreign frames collect before the next read, s."""
        count, gap = self.counters.foreign - self._foreign, now - self._foreign_at
        if not count:
            return 0.0
        self._foreign, self._foreign_at = self.counters.foreign, now
        return min(BATCH_TIME, BATCH_SIZE * gap / count) if count > BATCH_THRESHOLD * gap else 0.0

    def clear(self) -> None:
        """Forget the peers: the channel is closed."""
        self._reader.clear()
        self.routes.clear()

    def _accept(
        self, peer: Peer, frames: Iterable[Frame | ForeignFrames], now: float,
    ) -> list[ReceivedFrame] | None:
        accepted: list[ReceivedFrame] = []
        heard = set()
        duplicates = self._duplicates
        for frame in frames:
            if isinstance(frame, ForeignFrames):
                # Frames from our own address have returned, or show an address conflict.
                if frame.source in self._writer.sequences:
                    continue
                self.traffic.count_run(frame.source, frame.sequences)
            elif frame.source in self._writer.sequences and self._writer.is_loopback(frame, now):
                continue
            else:
                if duplicates is not None and duplicates.is_copy(frame, self._line, now):
                    # Its sequence number, if late, would look like that of another sender.
                    self.traffic.frames_received += 1
                else:
                    accepted.append((frame, self.traffic.count(frame)))
            heard.add(frame.source)
        neighbour = self.leads_to(peer)
        for source in heard:
            self.routes.heard(source, neighbour, now)
        return accepted if heard else None
