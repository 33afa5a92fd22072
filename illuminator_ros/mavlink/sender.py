# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The sending side of a link: messages to frames for the peers that lead to their targets."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
import logging
import math
import struct

from .conflating_queue import ConflatingQueue, StreamGroup
from .dialect import line_of
from .forwarding.routing_table import grouped, Peers, Router
from .frame_writer import FrameWriter
from .line import Line
from .link_thread import FaultLog
from .messages import Address, Heartbeat, Message, target_of

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
    Sends messages over the lines that lead to their targets.

    A frame is the same on each line, so that a receiver behind two of them recognises the copy.

    :param streams: messages that newer ones replace while the line is busy.
    :param sent: called with each message of a stream that is sent.
    :ivar answer_expected_until: s.
    :ivar is_holding: whether messages of streams are held.
    :ivar heartbeats: the last heartbeat frame of each of our addresses.
    """

    def __init__(
        self, writer: FrameWriter, streams: Sequence[StreamGroup], lines: Sequence[Line],
        router: Router, faults: FaultLog, clock: Callable[[], float],
        wall_clock: Callable[[], float], sent: Callable[[Message, float], None],
    ) -> None:
        self.answer_expected_until = -math.inf
        self.is_holding = False
        self.heartbeats: dict[Address, bytes] = {}
        self._writer = writer
        self._has_streams = bool(streams)
        self._streams = ConflatingQueue(streams)
        self._lines = lines
        self._router = router
        self._faults = faults
        self._clock = clock
        self._wall_clock = wall_clock
        self._sent = sent

    def send(self, messages: Sequence[tuple[Address, Message]], now: float) -> None:
        """Send messages, and those of streams for which the line has room."""
        if not self._has_streams:
            self._send_now(messages, now)
            return
        dropped = self._streams.dropped
        at_once: list[tuple[Address, Message]] = []
        for source, message in messages:
            if not self._streams.hold(source, message, now):
                # Messages to one target keep their order.
                at_once += [*self._streams.pop_for(target_of(message)), (source, message)]
        self._send_now(at_once, now)
        self.is_holding = bool(self._streams)
        while self.is_holding and self.due <= now:
            taken = self._streams.pop(now)
            self._send_now(taken, now)
            for _, message in taken:
                self._faults.call(self._sent, message, now)
            self.is_holding = bool(self._streams)
        self._lines[0].receiver.traffic.frames_dropped += self._streams.dropped - dropped

    @property
    def due(self) -> float:
        """Return when held messages of streams can be sent; infinity while each line is full."""
        now = self._clock()
        target = target_of(self._streams.first)
        towards = self._router.towards(target, [line.peers(now) for line in self._lines], now)
        free = [line.free_at for line, peers in zip(self._lines, towards, strict=True) if peers]
        if not free:
            return now
        return max((at for at in free if at < math.inf), default=math.inf) - (
            URGENT_WRITE_AHEAD if self._streams.is_urgent else WRITE_AHEAD)

    def clear(self) -> None:
        """Drop all messages of streams: the lines are closed."""
        self._streams.clear()
        self.is_holding = False

    def _send_now(self, messages: Sequence[tuple[Address, Message]], now: float) -> None:
        everywhere = [tuple(line.peers(now)) for line in self._lines]
        for towards, frames in grouped(self._frames(messages, everywhere, now)):
            for line, peers in zip(self._lines, towards, strict=True):
                if peers:
                    line.write(frames, peers, now)

    def _frames(
        self, messages: Iterable[tuple[Address, Message]], everywhere: Peers, now: float,
    ) -> Iterator[tuple[Peers, bytes]]:
        """Return the frames of messages, with the peers that lead to their targets."""
        for source, message in messages:
            target = target_of(message)
            if target.system:
                self.answer_expected_until = now + ANSWER_TIME
            try:
                frame = self._writer.frame(source, message, now, self._wall_clock())
            except (ValueError, OverflowError, struct.error):
                self._faults.log()
                continue
            if isinstance(message, Heartbeat):
                self.heartbeats[source] = frame
            if _frame_log.isEnabledFor(logging.DEBUG):
                _frame_log.debug('sent from %s: %s', source, line_of(message),
                                 extra={'address': target})
            yield self._router.towards(target, everywhere, now), frame
