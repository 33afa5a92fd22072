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

from collections import deque
from collections.abc import Callable
import contextlib
from dataclasses import dataclass
import logging
import selectors
import socket
import threading
import time
from typing import Any

from .dialect import decode_payload, encode_payload, HANDLED, LAYOUTS, Source
from .endpoint import Endpoint
from .framing import Decoder, DecoderCounters, encode_frame, Frame
from .opener import Opener
from .routes import Routes
from .signing import Signing, SigningCounters
from .signing_files import TimestampStore
from .statistics import Traffic
from .transport import Channel, ChannelLost, Peer
from .url import Url

# s; the loop looks around this often even where nothing is due.
IDLE = 1.0
# s between stores of the signing time stamp; the specification asks for once a minute.
STORE_INTERVAL = 30.0
# Senders whose incomplete frames are kept apart.
MAX_DECODERS = 64

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class LinkEvent:
    """
    The link was opened or lost, or cannot be opened.

    :param name: the transport, or the URL where there is none.
    :param reason: why it is not open.
    """

    is_open: bool
    name: str
    reason: str = ''


@dataclass
class LinkState:
    """
    A link's condition, to be read from any thread.

    :param since: when it was opened or lost, on the link's clock, s.
    :param openings: how often it was opened.
    """

    is_open: bool
    since: float
    name: str
    reason: str
    openings: int
    peers: int
    traffic: Traffic
    decoding: DecoderCounters
    signing: SigningCounters


class Link:
    """
    Runs an endpoint over a connection URL in a thread of its own, and reopens what is lost.

    All of the endpoint is called from that thread and no other; :meth:`call` brings work to it.

    :param on_event: called in the link's thread when the link is opened, lost, or cannot be
        opened at first.
    :param store: where the time stamps of signing outlive us; None keeps them nowhere.
    :param clock: s, monotonic.
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
        self.endpoint = endpoint
        self._label = label
        self._on_event = on_event
        self._signing = signing or Signing()
        self._store = store
        self._store_due = 0.0
        self.clock = clock
        self._wall_clock = wall_clock
        self._opener = Opener(url, self._opened_elsewhere, self._failed_elsewhere)
        self._calls: deque[Callable[[float], None]] = deque()
        self._wake_out, self._wake_in = socket.socketpair()
        self._wake_out.setblocking(False)
        self._wake_in.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._wake_out, selectors.EVENT_READ)
        self._stopping = False
        self._channel: Channel | None = None
        self._sequences: dict[Source, int] = {}
        self._decoders: dict[Peer, Decoder] = {}
        self._routes = Routes()
        self._decoding = DecoderCounters()
        self._traffic = Traffic()
        self._dropped_before = 0
        self._since = clock()
        self._reason = 'not opened yet'
        self._openings = 0
        self._thread = threading.Thread(target=self._run, name='mavlink-link', daemon=True)

    # From any thread

    def start(self) -> None:
        """Start the thread; the first attempt to open follows at once."""
        self._thread.start()

    def stop(self, timeout: float = 1.0) -> None:
        """End the thread, s at most, and close the transport."""
        self._stopping = True
        self._wake()
        self._opener.stop()
        if self._thread.is_alive() and threading.current_thread() is not self._thread:
            self._thread.join(timeout)

    def call(self, function: Callable[[float], None]) -> None:
        """Have ``function(now)`` called in the link's thread."""
        self._calls.append(function)
        self._wake()

    def state(self) -> LinkState:
        """Return the link's condition."""
        channel = self._channel
        self._traffic.frames_dropped = self._dropped_before + (channel.dropped if channel else 0)
        return LinkState(
            channel is not None, self._since, channel.name if channel else self._label,
            self._reason, self._openings, self._routes.peer_count, self._traffic, self._decoding,
            self._signing.counters)

    def _wake(self) -> None:
        # A full buffer has woken the thread already; a closed one has no thread to wake.
        with contextlib.suppress(OSError):
            self._wake_in.send(b'\0')

    def _opened_elsewhere(self, channel: Channel) -> None:
        self.call(lambda now: self._opened(channel, now))

    def _failed_elsewhere(self, reason: str) -> None:
        self.call(lambda now: self._failed(reason))

    # In the link's thread

    def _run(self) -> None:
        self._opener.start()
        while not self._stopping:
            try:
                self._turn()
            except Exception:
                # A fault of ours must not end the link; it is shown, and the next turn comes.
                _log.exception('internal error in the link')
        self._store_timestamp()
        self._close()
        self._selector.close()
        self._wake_out.close()
        self._wake_in.close()

    def _turn(self) -> None:
        wait = min(self.endpoint.next_deadline() - self.clock(), IDLE)
        ready = self._selector.select(max(wait, 0.0))
        for key, events in ready:
            if key.fileobj is self._wake_out:
                with contextlib.suppress(BlockingIOError):
                    self._wake_out.recv(4096)
            elif self._channel is not None:
                self._serve(key.fileobj, events)
        for _ in range(len(self._calls)):
            self._calls.popleft()(self.clock())
        self.endpoint.poll(self.clock())
        self._flush()
        if self.clock() >= self._store_due:
            self._store_timestamp()

    def _store_timestamp(self) -> None:
        """Keep the time stamp for the next run ("Timestamp Handling")."""
        self._store_due = self.clock() + STORE_INTERVAL
        if self._store is not None:
            try:
                self._store.store(self._signing.timestamp)
            except OSError as error:
                self._store = None
                _log.error('cannot keep the signing time stamp, a restart may repeat some: %s',
                           error)

    def _serve(self, handle: Any, events: int) -> None:
        assert self._channel is not None
        try:
            if events & selectors.EVENT_WRITE:
                self._channel.writable(handle)
            if events & selectors.EVENT_READ:
                for peer, data in self._channel.receive(handle):
                    self._take(self._channel, peer, data)
                    self._flush()
                    if self._channel is None:
                        return
        except ChannelLost as error:
            self._lost(error)

    def _take(self, channel: Channel, peer: Peer, data: bytes) -> None:
        self._traffic.bytes_received += len(data)
        decoder = self._decoders.get(peer)
        if decoder is None:
            if len(self._decoders) >= MAX_DECODERS:
                del self._decoders[next(iter(self._decoders))]
            decoder = self._decoders[peer] = Decoder(counters=self._decoding)
        for frame in decoder.feed(data):
            if self._signing.accepts(frame, self._wall_clock()):
                self._accept(channel, peer, frame)

    def _accept(self, channel: Channel, peer: Peer, frame: Frame) -> None:
        now = self.clock()
        self._traffic.count(frame.source, frame.sequence)
        if channel.heard(peer, now):
            self.endpoint.link_opened(now)
        self._routes.heard(frame.source, peer, now)
        if frame.message_id in HANDLED:
            self.endpoint.receive(
                frame.source, decode_payload(frame.message_id, frame.payload), now)

    def _flush(self) -> None:
        """Send what the endpoint has to say; without a channel it is said to nobody."""
        outgoing = self.endpoint.outgoing
        while outgoing:
            source, message = outgoing.popleft()
            if self._channel is not None:
                try:
                    self._send(self._channel, source, message)
                except ChannelLost as error:
                    self._lost(error)

    def _send(self, channel: Channel, source: Source, message: Any) -> None:
        sequence = self._sequences.get(source, 0)
        self._sequences[source] = (sequence + 1) & 0xFF
        frame = encode_frame(
            message.id, encode_payload(message), sequence=sequence, source=source,
            crc_extra=LAYOUTS[message.id].crc_extra, signed=self._signing.signs)
        if self._signing.signs:
            frame = self._signing.sign(frame, self._wall_clock())
        peers = self._routes.towards(message, channel.peers(self.clock()), self.clock())
        channel.send(frame, peers)
        self._traffic.frames_sent += len(peers)
        self._traffic.bytes_sent += len(frame) * len(peers)

    def _opened(self, channel: Channel, now: float) -> None:
        if self._stopping:
            channel.close()
            return
        self._channel = channel
        channel.register(self._selector)
        self.endpoint.link_opened(now)
        self._flush()
        # Sending the first heartbeat may already have shown that it leads nowhere.
        if self._channel is channel:
            self._since, self._reason = now, ''
            self._openings += 1
            self._opener.succeeded()
            self._on_event(LinkEvent(True, channel.name))

    def _failed(self, reason: str) -> None:
        # Once it has been open, its loss was one line in the log and its return will be another.
        if reason != self._reason and not self._openings:
            self._on_event(LinkEvent(False, self._label, reason))
        self._reason = reason

    def _lost(self, error: OSError) -> None:
        if self._channel is None:
            return
        was_open = not self._reason
        name = self._channel.name
        self._close()
        reason = error.strerror or str(error)
        now = self.clock()
        if was_open:
            self._since, self._reason = now, reason
            self._on_event(LinkEvent(False, name, reason))
        else:
            self._failed(reason)
        self.endpoint.link_closed(now)
        self._traffic.restart()
        self._opener.start()

    def _close(self) -> None:
        if self._channel is None:
            return
        for key in list(self._selector.get_map().values()):
            if key.fileobj is not self._wake_out:
                self._selector.unregister(key.fileobj)
        self._dropped_before += self._channel.dropped
        self._channel.close()
        self._channel = None
        self._decoders.clear()
        self._routes.clear()
