# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The receiving side of a line: frames of many peers, authenticated, routed and counted."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
import math
from typing import NamedTuple

from .dialect import CRC_EXTRA
from .forwarding.duplicate_filter import DuplicateFilter, Path
from .forwarding.routing_table import RoutingTable
from .frame import Decoder, DecoderCounters, ForeignFrames, Frame
from .frame_writer import FrameWriter
from .messages import Address
from .signing import Signing, Verdict
from .statistics import SequenceCounter, Traffic
from .transport import Peer

# Peers whose incomplete frames are kept apart.
MAX_DECODERS = 64
# s; the longest frame takes 0.3 s at 9600 baud. An older beginning of a frame is noise, which
# delays the valid frames after it.
STALL = 0.5
# To wake the loop costs as much as ten foreign frames. Where more than BATCH_THRESHOLD come per
# second, the loop pauses for BATCH_TIME s, or until BATCH_SIZE are expected; a UDP socket has room
# for 250.
BATCH_THRESHOLD = 1000.0
BATCH_TIME = 0.02
BATCH_SIZE = 128


class _Wait(NamedTuple):
    """The wait for the rest of a frame: its position, the bytes taken by then, the time (s)."""

    start: int
    taken: int
    since: float


class _Stream:
    """The bytes of one peer, and the path over which they come."""

    def __init__(self, path: Path, counters: DecoderCounters) -> None:
        self.path = path
        self.decoder = Decoder(counters=counters)
        # Whether a frame of another component was ever accepted.
        self.good = False


class Receiver:
    """
    Accepts frames of other components, except those of ours that have returned.

    pymavlink has one parser for all peers of a port, so a piece of a frame from one peer spoils
    the frames of another, and no limit on the wait for the rest of a frame.

    :param handled: ids of the messages that are read; frames of others are only counted, unless
        their signatures matter.
    :param writer: has written our frames.
    :param wall_clock: s, Unix time, for the signing time stamps.
    :param sources: see :class:`~.statistics.Traffic`.
    :param duplicates: the frames that any of several lines has accepted or sent, None if there is
        one line. A copy of one of these shows a route, but is not returned. Frames of messages
        that are not handled are then returned, and not only counted.
    :param line: the index of the line.
    :ivar traffic: of the line; the sending side counts here, too.
    :ivar routes: the peers over which components were heard.
    :ivar counters: totals over all peers since it was made.
    :ivar waits: the waits for rests of frames, by peer.
    :ivar is_behind: whether the last bytes had a rightly signed frame with an old time stamp.
    :ivar leads_to: see :meth:`~.transport.base.Channel.leads_to`.
    """

    def __init__(
        self, signing: Signing, handled: Collection[int], writer: FrameWriter,
        wall_clock: Callable[[], float], sources: dict[Address, SequenceCounter],
        duplicates: DuplicateFilter | None = None, line: int = 0,
    ) -> None:
        self.traffic = Traffic(sources=sources)
        self.routes = RoutingTable()
        self.counters = DecoderCounters()
        self.waits: dict[Peer, _Wait] = {}
        self.is_behind = False
        self.leads_to: Callable[[Peer], Peer] = lambda peer: peer
        self.signing = signing
        self._signing_is_off = not signing.signs
        self._writer = writer
        self._duplicates = duplicates
        self._line = line
        self._wall_clock = wall_clock
        # Making a Frame of each foreign frame takes twice the time on a busy link.
        self._foreign = {} if not self._signing_is_off or duplicates is not None else {
            id_: bytes((crc_extra,)) for id_, crc_extra in CRC_EXTRA.items() if id_ not in handled}
        self._streams: dict[Peer, _Stream] = {}
        # The time of the last pause, s, and the foreign frames until then.
        self._paused = (-math.inf, 0)

    def feed(self, peer: Peer, data: bytes, now: float) -> list[Frame] | None:
        """
        Return the frames to handle that bytes of a peer complete.

        :return: None if no frame was accepted, foreign frames included.
        """
        self.traffic.bytes_received += len(data)
        stream = self._streams.get(peer)
        if stream is None:
            stream = self._new_stream(peer)
        frames = stream.decoder.sort(data, self._foreign)
        if stream.decoder.rest or self.waits:
            self._watch(peer, stream.decoder, now)
        return self._accept(peer, stream, frames, now)

    def give_up(self, now: float) -> list[tuple[Peer, list[Frame]]]:
        """
        Return the frames behind beginnings of frames that are older than :data:`STALL`, by peer.

        Later bytes may be the beginning of a valid frame, and are kept.
        """
        if now < self.due:
            return []
        found = []
        for peer, wait in list(self.waits.items()):
            if now >= wait.since + STALL:
                stream = self._streams[peer]
                frames = stream.decoder.give_up(wait.taken)
                self._watch(peer, stream.decoder, now)
                accepted = self._accept(peer, stream, frames, now)
                if accepted is not None:
                    found.append((peer, accepted))
        return found

    @property
    def due(self) -> float:
        """Return when :meth:`give_up` has something to do, infinity if never."""
        if not self.waits:
            return math.inf
        return min(wait.since for wait in self.waits.values()) + STALL

    def pause(self, now: float) -> float:
        """Return for how long to let foreign frames collect before the next read, s."""
        at, before = self._paused
        count, gap = self.counters.foreign - before, now - at
        if not count:
            return 0.0
        self._paused = now, self.counters.foreign
        return min(BATCH_TIME, BATCH_SIZE * gap / count) if count > BATCH_THRESHOLD * gap else 0.0

    def clear(self) -> None:
        """Forget the peers and incomplete frames: the channel is closed."""
        self._streams.clear()
        self.waits.clear()
        self.routes.clear()

    def _new_stream(self, peer: Peer) -> _Stream:
        if len(self._streams) >= MAX_DECODERS:
            # Garbage from ever new ports must not displace peers that send valid frames.
            oldest = next((old for old, stream in self._streams.items() if not stream.good),
                          next(iter(self._streams)))
            del self._streams[oldest]
            self.waits.pop(oldest, None)
        self._streams[peer] = stream = _Stream(
            Path(self._line, self.leads_to(peer)), self.counters)
        return stream

    def _watch(self, peer: Peer, decoder: Decoder, now: float) -> None:
        start = decoder.incomplete
        if start is None:
            self.waits.pop(peer, None)
        elif peer not in self.waits or self.waits[peer].start != start:
            self.waits[peer] = _Wait(start, decoder.taken, now)

    def _accept(
        self, peer: Peer, stream: _Stream, frames: Iterable[Frame | ForeignFrames], now: float,
    ) -> list[Frame] | None:
        accepted: list[Frame] = []
        heard = set()
        own, duplicates = self._writer.sequences, self._duplicates
        # An unsigned frame is accepted where signing is off; this test saves a call.
        trusted = self._signing_is_off
        self.is_behind = False
        for frame in frames:
            if isinstance(frame, ForeignFrames):
                # Frames from our own address have returned, or show an address conflict.
                if frame.source in own:
                    continue
                self.traffic.count_run(frame.source, frame.sequences)
            elif frame.source in own and self._writer.is_loopback(frame, now):
                continue
            elif duplicates is not None and duplicates.is_copy(frame.data, stream.path, now):
                # Neither a replay nor a frame of another sender, though its number may be late.
                self.traffic.frames_received += 1
                if frame.source in own:
                    continue
            elif trusted and frame.signature is None or (verdict := self.signing.check(
                    frame, self._wall_clock())) is Verdict.ACCEPTED:
                accepted.append(frame)
                self.traffic.count(frame)
                if duplicates is not None:
                    duplicates.add(frame.data, stream.path, now)
            else:
                self.is_behind |= verdict is Verdict.OLD
                continue
            heard.add(frame.source)
        if not heard:
            return None
        stream.good = True
        for source in heard:
            self.routes.heard(source, stream.path.neighbour, now)
        return accepted
