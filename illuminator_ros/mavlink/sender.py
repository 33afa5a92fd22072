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

"""The sending side of a line: messages to frames for the peers that lead to their targets."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
import logging
import math
import struct

from .conflating_queue import ConflatingQueue, StreamGroup
from .dialect import line_of
from .fault_log import FaultLog
from .frame_writer import FrameWriter
from .messages import Address, Message, target_of
from .routing_table import RoutingTable
from .statistics import Traffic
from .transport import Channel, Peer

# s for which the line may still be busy when the next group of a stream is written, so that it has
# no gaps. The most urgent group may wait behind one more in the line.
WRITE_AHEAD = 0.002
URGENT_WRITE_AHEAD = 0.02
# s after a message with a target in which an answer is expected.
ANSWER_TIME = 1.0

# Each frame in a line, at DEBUG, with the ``address`` of the other component.
_frame_log = logging.getLogger('illuminator_ros')


class Sender:
    """
    Sends messages over the channel of a line; an OSError of that is the caller's to handle.

    :param streams: messages that newer ones replace while the line is busy.
    :param routes: of the receiving side.
    :ivar answer_expected_until: s.
    """

    def __init__(
        self, writer: FrameWriter, streams: Sequence[StreamGroup], routes: RoutingTable,
        traffic: Traffic, faults: FaultLog, wall_clock: Callable[[], float],
    ) -> None:
        self.answer_expected_until = -math.inf
        self._writer = writer
        self._streams = ConflatingQueue(streams)
        self._routes = routes
        self._traffic = traffic
        self._faults = faults
        self._wall_clock = wall_clock
        # When the line will have sent all written bytes, s.
        self._line_free_at = -math.inf

    def send(
        self, channel: Channel, messages: Iterable[tuple[Address, Message]], now: float,
    ) -> None:
        """Send messages, and those of streams for which the line has room."""
        dropped = self._streams.dropped
        self._send_now(
            channel, [one for one in messages if not self._streams.hold(*one, now)], now)
        while self.next_deadline(channel) <= now:
            self._send_now(channel, self._streams.take(now), now)
        self._traffic.frames_dropped += self._streams.dropped - dropped

    def next_deadline(self, channel: Channel) -> float:
        """Return when messages of streams can be sent; infinity while the channel is full."""
        if not self._streams or channel.is_waiting:
            return math.inf
        return self._line_free_at - (
            URGENT_WRITE_AHEAD if self._streams.is_urgent else WRITE_AHEAD)

    def clear(self) -> None:
        """Drop all messages of streams: the channel is closed."""
        self._streams.clear()
        self._line_free_at = -math.inf

    def _send_now(
        self, channel: Channel, messages: Sequence[tuple[Address, Message]], now: float,
    ) -> None:
        all_peers = channel.peers(now)
        # Frames for the same peers are sent together: each receiver is then woken only once.
        frames: list[bytes] = []
        peers: Sequence[Peer] = ()
        for source, message in messages:
            if getattr(message, 'target_system', 0):
                self.answer_expected_until = now + ANSWER_TIME
            towards = tuple(self._routes.towards(message, all_peers, now))
            if frames and towards != peers:
                self._write(channel, frames, peers, now)
                frames = []
            peers = towards
            try:
                frames.append(self._writer.frame(source, message, now, self._wall_clock()))
            except (ValueError, OverflowError, struct.error):
                self._faults.log()
                continue
            if _frame_log.isEnabledFor(logging.DEBUG):
                _frame_log.debug('sent from %s: %s', source, line_of(message),
                                 extra={'address': target_of(message)})
        if frames:
            self._write(channel, frames, peers, now)

    def _write(
        self, channel: Channel, frames: Sequence[bytes], peers: Sequence[Peer], now: float,
    ) -> None:
        dropped, size = channel.dropped, sum(map(len, frames))
        channel.send(frames, peers)
        self._line_free_at = max(now, self._line_free_at) + size / channel.rate
        self._traffic.frames_dropped += channel.dropped - dropped
        self._traffic.frames_sent += len(frames) * len(peers)
        self._traffic.bytes_sent += size * len(peers)
