# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The lines of a link: one endpoint uses them all, and frames are forwarded between them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
import copy
import logging
import math
import selectors

from .component import Endpoint
from .dialect import decode, line_of
from .errors import InvalidValue
from .forwarding.duplicate_filter import DuplicateFilter
from .forwarding.forwarded_commands import ForwardedCommands
from .forwarding.routing_table import grouped, Router
from .frame import Frame, MAX_ID_V1
from .frame_writer import FrameWriter
from .line import ANNOUNCE_INTERVAL, Line, LineUser, SILENCE
from .link_state import LinkSnapshot
from .link_thread import FaultLog
from .messages import Address
from .receiver import Receiver
from .search.serial_search import SerialSearch
from .sender import Sender
from .signing import Signing
from .statistics import RECENT, SequenceCounter
from .transport import Peer
from .url import AutoUrl, Url

# Each frame in a line, at DEBUG, with the ``address`` of the other component.
_frame_log = logging.getLogger('illuminator_ros')


class Lines(LineUser):
    """
    Carries the messages of an endpoint over all lines, and frames of others between them.

    All lines are equal. With one line nothing is forwarded, between its peers neither.

    :param urls: of each line, by its label.
    :param call: calls a function in the thread of the link, given the time, s.
    :param defer: if no more messages must be taken in this turn of the thread, has a function
        called in the next turn before others that wait; returns whether it does.
    :param mavlink_version: 1 or 2, of the frames that are sent; both are received.
    :param wall_clock: s, Unix time, for the signing time stamps.
    :ivar forwarded_commands: the commands of others that were forwarded lately.
    :raises InvalidValue: if MAVLink 1 cannot carry a message of the endpoint, or must be signed.
    """

    def __init__(
        self, urls: Sequence[tuple[str, Url]], endpoint: Endpoint, *, faults: FaultLog,
        selector: selectors.BaseSelector, call: Callable[[Callable[[float], None]], None],
        defer: Callable[[Callable[[float], None]], bool],
        signing: Signing, mavlink_version: int, clock: Callable[[], float],
        wall_clock: Callable[[], float],
    ) -> None:
        classes = dict.fromkeys((*endpoint.messages, *endpoint.sends))
        if mavlink_version == 1 and (too_high := [c.msgname for c in classes if c.id > MAX_ID_V1]):
            raise InvalidValue(f'MAVLink 1 cannot carry {", ".join(too_high)}: it has no message '
                               f'ids above {MAX_ID_V1}; use MAVLink 2')
        self._endpoint = endpoint
        self._classes = {cls.id: cls for cls in endpoint.messages}
        self._faults = faults
        self._defer = defer
        # Frames of messages that were received, and their lines.
        self._received: deque[tuple[Line, Frame]] = deque()
        self._version = mavlink_version
        self._duplicates = DuplicateFilter() if len(urls) > 1 else None
        self.forwarded_commands = ForwardedCommands()
        self._heard_at = -math.inf
        # When the endpoint announced itself on all lines because none was heard.
        self._announced_at = -math.inf
        writer = FrameWriter(signing, mavlink_version, self._duplicates)
        sources: dict[Address, SequenceCounter] = {}
        self._lines = [
            Line(url, self, endpoint.schedule,
                 Receiver(signing, self._classes, writer, wall_clock, sources, self._duplicates,
                          index),
                 label=label, faults=faults, selector=selector, call=call, clock=clock,
                 opener=SerialSearch(
                     url, FrameWriter(copy.copy(signing), mavlink_version), endpoint.address).open
                 if isinstance(url, AutoUrl) else None)
            for index, (label, url) in enumerate(urls)]
        self._sources = sources
        self._router = Router([line.receiver.routes for line in self._lines], writer.sequences)
        self._sender = Sender(writer, endpoint.streams, self._lines, self._router, faults, clock,
                              wall_clock, endpoint.sent)

    def __iter__(self) -> Iterator[Line]:
        return iter(self._lines)

    def snapshots(self, now: float) -> tuple[LinkSnapshot, ...]:
        """Return each line at this moment."""
        complete = self._router.sole_sources(now)
        for source, counter in self._sources.items():
            counter.is_complete = source in complete
        return tuple(line.snapshot(now) for line in self._lines)

    def copies(self, now: float) -> Mapping[tuple[int, int], int]:
        """
        Return how many copies of frames have come, where some came lately.

        They come in a loop, or over several paths from one component.

        :return: by the indexes of the lines of the original and of the copy; that of our own
            frames is -1.
        """
        if self._duplicates is None:
            return {}
        return {lines: count for lines, (count, last) in self._duplicates.copies.items()
                if now - last < RECENT}

    def peer_count_of(self, source: Address, now: float) -> int:
        """
        Return over how many peers of one line a component is heard, which may be several senders.

        A component may be heard over several lines, too.
        """
        return max(line.receiver.routes.peer_count_of(source, now) for line in self._lines)

    def reset_loss(self, source: Address) -> None:
        """Forget recent losses of a component: its sequence numbers have restarted."""
        if counter := self._sources.get(source):
            counter.reset_loss()

    def flush(self, now: float) -> None:
        """Send the messages of the endpoint; without a channel they are dropped."""
        if not self._endpoint.outgoing and not self._sender.is_holding:
            return
        messages = list(self._endpoint.outgoing)
        self._endpoint.outgoing.clear()
        if any(line.is_open for line in self._lines):
            self._sender.send(messages, now)
            self._endpoint.schedule.at(
                self.flush, self._sender.due if self._sender.is_holding else math.inf)

    def pause(self, now: float) -> float:
        """Return for how long to let foreign frames collect before the next read, s."""
        if len(self._lines) > 1 or now < self._sender.answer_expected_until:
            return 0.0
        return self._lines[0].pause(now)

    # The calls of a line

    def opened(self, now: float) -> None:
        """See :meth:`LineUser.opened`."""
        self._faults.call(self._endpoint.link_opened, now)
        self.flush(now)

    def lost(self, heard: Sequence[Address], reason: str, now: float) -> None:
        """See :meth:`LineUser.lost`."""
        self._received = deque(one for one in self._received if one[0].is_open)
        if not any(line.is_open for line in self._lines):
            self._heard_at = -math.inf
            self._sender.clear()
            self._restart(self._sources)
            self._faults.call(self._endpoint.link_closed, now, reason)
            return
        lost = [source for source in heard if not self._router.is_reachable(source, now)]
        self._restart(lost)
        self._faults.call(self._endpoint.components_lost, lost, now, reason)

    def _restart(self, lost: Collection[Address]) -> None:
        """Forget the sequence numbers of components: their line was interrupted."""
        for source in lost:
            if counter := self._sources.get(source):
                counter.restart()

    def silent(self, line: Line, now: float) -> None:
        """See :meth:`LineUser.silent`."""
        if now >= self._heard_at + SILENCE:
            # Each silent line calls this, and one call announces the endpoint on all of them.
            if now >= self._announced_at + ANNOUNCE_INTERVAL:
                self._announced_at = now
                self._faults.call(self._endpoint.link_opened, now)
        else:
            # A router on this line forwards nothing to us until it has heard us.
            line.write([*self._sender.heartbeats.values()], line.peers(now), now)

    def behind(self, line: Line, peer: Peer, now: float) -> None:
        """
        See :meth:`LineUser.behind`.

        Its clock follows newer time stamps, so it gets one; and nothing else, since any sender can
        repeat an old frame.
        """
        line.write([*self._sender.heartbeats.values()], [peer], now)

    def receive(
        self, line: Line, peer: Peer, frames: Sequence[Frame], now: float,
    ) -> None:
        """See :meth:`LineUser.receive`."""
        self._heard_at = now
        if self._duplicates is not None:
            self._faults.call(self._forward, line, peer, frames, now)
        was_behind = self.is_behind
        self._received += [(line, one) for one in frames if one.message_id in self._classes]
        if not was_behind:
            self._receive_waiting(now)

    @property
    def is_behind(self) -> bool:
        """See :meth:`LineUser.is_behind`."""
        return bool(self._received)

    def _receive_waiting(self, now: float) -> None:
        """Take received messages while the turn of the thread lasts, others in its next turn."""
        while self._received:
            if self._defer(self._receive_waiting):
                return
            self._receive_frame(self._received.popleft()[1], now)

    def _receive_frame(self, frame: Frame, now: float) -> None:
        cls = self._classes[frame.message_id]
        if self._endpoint.inspect is not None:
            self._faults.call(self._endpoint.inspect, frame, cls)
        message = decode(cls, frame.payload)
        if _frame_log.isEnabledFor(logging.DEBUG):
            _frame_log.debug('received from %s: %s', frame.source, line_of(message),
                             extra={'address': frame.source})
        self._faults.call(self._endpoint.receive, frame.source, message, now)

    def _forward(
        self, line: Line, peer: Peer, frames: Sequence[Frame], now: float,
    ) -> None:
        # A neighbour that sends from another port than it listens on is one neighbour.
        peers = [other.others(peer, now) if other is line else other.peers(now)
                 for other in self._lines]
        if not any(peers):
            return
        known = (frame for frame in frames if frame.version <= self._version)
        for towards, some in grouped(
                (self._router.targets(frame, peers, now), frame) for frame in known):
            for other, receivers in zip(self._lines, towards, strict=False):
                if receivers:
                    other.forward(some, receivers, now)
            if any(towards):
                for frame in some:
                    self.forwarded_commands.add(frame, now)
