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

"""The link: the one thread that owns a transport and the endpoint that speaks over it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import contextlib
import functools
import math
import selectors
import time
from typing import Any

from .component import Endpoint
from .connector import Connector
from .frame import Frame
from .frame_writer import FrameWriter
from .link_state import LinkEvent, LinkState
from .messages import decode_payload
from .receiver import Receiver
from .router import Router
from .signing import Signing
from .signing_files import TimestampKeeper, TimestampStore
from .standing import Standing
from .statistics import Traffic
from .transport import Channel, Peer
from .url import Url
from .worker import Worker

# s; the loop looks around this often even where nothing is due.
IDLE = 1.0
# A busy link rests for REST s after a turn with more frames than this, so that one turn reads
# many of them: each turn costs as much as several frames. A call waits no longer than that.
MAX_FRAMES_BEFORE_REST = 16
REST = 0.0005
# s between stores of the signing time stamp; the specification asks for once a minute.
STORE_INTERVAL = 30.0
# s that a channel stays open, or a frame over it, until it counts as one that leads somewhere.
PROBATION = 1.0
# s without anything good from anybody, longer than between heartbeats; and then between
# greetings. A router that has restarted passes nothing on to us until it has heard us.
SILENCE = 1.5
KNOCK_INTERVAL = 0.25


class Link(Worker):
    """
    Runs an endpoint over a connection URL in a thread of its own, and reopens what is lost.

    All of the endpoint is called from that thread and no other; :meth:`call` brings work to it.

    :param on_event: called in the link's thread when the link is opened, lost, or cannot be
        opened at first. A channel that is lost again before it has proved to lead anywhere
        counts as not opened.
    :param store: where the time stamps of signing outlive us; None keeps them nowhere.
    :param wall_clock: s, Unix time, for the signing time stamps.
    """

    def __init__(
        self, url: Url, endpoint: Endpoint, *, label: str,
        on_event: Callable[[LinkEvent], None] = lambda event: None,
        signing: Signing | None = None,
        store: TimestampStore | None = None,
        clock: Callable[[], float] = time.monotonic,
        wall_clock: Callable[[], float] = time.time,
    ) -> None:
        super().__init__('mavlink-link', clock)
        self.endpoint = endpoint
        self._classes = {cls.id: cls for cls in endpoint.messages}
        self._signing = signing or Signing()
        self._timestamps = TimestampKeeper(self._signing, store)
        self._store_due = 0.0
        self._wall_clock = wall_clock
        self._opener = Connector(url, self._opened_elsewhere, self._failed_elsewhere)
        self._channel: Channel | None = None
        self._departure = FrameWriter(self._signing)
        self._reception = Receiver(self._signing)
        self._routes = Router()
        self._traffic = Traffic()
        self._standing = Standing(label, functools.partial(self._guarded, on_event), clock())
        # When the channel counts as one that leads somewhere, infinity once it does; and
        # whether the one before never did.
        self._proven_at = math.inf
        self._doubtful = False
        # Whether a frame has come over the channel.
        self._spoken = False
        self._knock_at = math.inf
        # When there is something to do next, s, and whether there may be before that.
        self._due = 0.0
        self._stirred = False
        # Good frames received before this turn.
        self._frames_seen = 0

    # From any thread

    def stop(self, timeout: float = 1.0) -> None:
        """See :meth:`Worker.stop`; the transport is closed."""
        self._opener.stop()
        super().stop(timeout)

    def state(self) -> LinkState:
        """Return the link's condition."""
        channel, standing = self._channel, self._standing
        reason = standing.reason
        return LinkState(
            not reason, standing.since, channel.name if channel else standing.label, reason,
            standing.openings, self._routes.peer_count(self.clock()), self._traffic,
            self._reception.counters, self._signing.counters)

    def _opened_elsewhere(self, channel: Channel) -> None:
        self.call(lambda now: self._opened(channel, now))

    def _failed_elsewhere(self, reason: str) -> None:
        self.call(lambda now: self._standing.failed(reason))

    # In the link's thread

    def _begin(self) -> None:
        self._opener.start()

    def _end(self) -> None:
        # No channel is handed over any more, and one that just was is among the calls.
        self._opener.stop()
        self._run_calls()
        self._guarded(self._timestamps.keep, True)
        self._close()
        self._standing.stopped(self.clock())

    def _turn(self) -> None:
        due = min(self._due, self._reception.next_deadline())
        now = self.clock()
        wait = min(max(due - now, self._pause), IDLE)
        self._pause = 0.0
        for handle, events in self._ready(wait):
            if self._channel is not None:
                self._serve(handle, events)
        now = self.clock()
        frames = self._reception.counters.frames
        if frames > self._frames_seen + MAX_FRAMES_BEFORE_REST:
            time.sleep(REST)
        self._frames_seen = frames
        if self._stirred or self._calls or now >= due:
            self._work()

    def _work(self) -> None:
        """Do what others asked for, and what is due."""
        self._stirred = False
        self._run_calls()
        if self._channel is not None:
            self._look_after(self._channel, self.clock())
        self._guarded(self.endpoint.poll, self.clock())
        self._flush()
        if self.clock() >= self._store_due:
            self._store_due = self.clock() + STORE_INTERVAL
            self._guarded(self._timestamps.keep)
        self._due = min(self.endpoint.next_deadline(), self._knock_at, self._proven_at,
                        self._store_due)

    def _serve(self, handle: Any, events: int) -> None:
        assert self._channel is not None
        try:
            if events & selectors.EVENT_WRITE:
                self._channel.writable(handle)
            if events & selectors.EVENT_READ:
                for peer, data in self._channel.receive(handle):
                    self._take(self._channel, peer, data)
                    if self._channel is None:
                        return
        except OSError as error:
            self._lost(error)

    def _take(self, channel: Channel, peer: Peer, data: bytes) -> None:
        self._traffic.bytes_received += len(data)
        now = self.clock()
        frames = self._reception.take(peer, data, now, self._wall_clock())
        if frames:
            for frame in frames:
                self._accept(channel, peer, frame, now)
            self._flush()

    def _accept(self, channel: Channel, peer: Peer, frame: Frame, now: float) -> None:
        if self._departure.is_echo(frame, now):
            return
        if not self._spoken:
            self._spoken = self._stirred = True
            self._opener.answered()
            self._believe(channel, now)
        self._knock_at = now + SILENCE
        self._traffic.count(frame.source, frame.sequence)
        if channel.heard(peer, now):
            self._stirred = True
            self._guarded(self.endpoint.link_opened, now)
        self._routes.heard(frame.source, peer, now)
        cls = self._classes.get(frame.message_id)
        if cls is not None:
            self._stirred = True
            self._guarded(self.endpoint.receive, frame.source,
                          decode_payload(cls, frame.payload), now)

    def _look_after(self, channel: Channel, now: float) -> None:
        if now >= self._proven_at:
            # It has lasted, so its loss will be answered at once.
            self._proven_at = math.inf
            self._opener.succeeded()
            self._believe(channel, now)
        for peer, frame in self._reception.give_up(now, self._wall_clock()):
            self._accept(channel, peer, frame, now)
        if now >= self._knock_at:
            self._knock_at = now + KNOCK_INTERVAL
            self._guarded(self.endpoint.link_opened, now)

    def _flush(self) -> None:
        """Send what the endpoint has to say; without a channel it is said to nobody."""
        outgoing = self.endpoint.outgoing
        while outgoing and self._channel is not None:
            channel, now = self._channel, self.clock()
            all_peers = channel.peers(now)
            peers = self._routes.towards(outgoing[0][1], all_peers, now)
            # What goes the same way goes together: its receiver is then woken only once.
            frames = []
            while outgoing and self._routes.towards(outgoing[0][1], all_peers, now) == peers:
                source, message = outgoing.popleft()
                frames.append(self._departure.frame(source, message, now, self._wall_clock()))
            try:
                self._send(channel, frames, peers)
            except OSError as error:
                self._lost(error)
        outgoing.clear()

    def _send(self, channel: Channel, frames: list[bytes], peers: Sequence[Peer]) -> None:
        dropped = channel.dropped
        channel.send(frames, peers)
        self._traffic.frames_dropped += channel.dropped - dropped
        self._traffic.frames_sent += len(frames) * len(peers)
        self._traffic.bytes_sent += sum(map(len, frames)) * len(peers)

    def _opened(self, channel: Channel, now: float) -> None:
        if self._stopping.is_set():
            channel.close()
            return
        self._channel = channel
        self._proven_at = now + PROBATION
        self._spoken = False
        self._knock_at = now + KNOCK_INTERVAL
        channel.register(self._selector)
        self._guarded(self.endpoint.link_opened, now)
        self._flush()
        # Sending the first heartbeat may already have shown that it leads nowhere.
        if not self._doubtful:
            self._standing.opened(channel.name, now)

    def _believe(self, channel: Channel, now: float) -> None:
        """Have a channel count as open that was doubted until now."""
        if self._standing.reason:
            self._standing.opened(channel.name, now)

    def _lost(self, error: OSError) -> None:
        if self._channel is None:
            return
        self._stirred = True
        name = self._channel.name
        self._doubtful = self._proven_at < math.inf and not self._spoken
        self._close()
        self._opener.start()
        now = self.clock()
        reason = error.strerror or str(error)
        self._standing.lost(name, reason, now)
        self._guarded(self.endpoint.link_closed, now, reason)
        self._traffic.restart()

    def _close(self) -> None:
        if self._channel is None:
            return
        self._unregister_all()
        channel, self._channel = self._channel, None
        with contextlib.suppress(OSError):
            channel.close()
        self._proven_at = self._knock_at = math.inf
        self._reception.clear()
        self._routes.clear()
