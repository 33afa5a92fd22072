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

"""A line: one connection URL with its transport, its state, and the endpoint that uses it."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import copy
import functools
import logging
import math
import selectors

from .component import Endpoint
from .connector import Connector
from .dialect import decode, line_of
from .fault_log import FaultLog
from .frame import MAX_ID_V1
from .frame_writer import FrameWriter
from .link_state import LinkInput, LinkSnapshot, LinkState, LinkStatus
from .messages import Address
from .receiver import ReceivedFrame, Receiver
from .sender import Sender
from .signing import Signing
from .transport import Channel, Peer
from .url import Url

# s; a channel that stays open for this time is proved without a frame.
PROOF_TIME = 1.0
# s without a frame from any peer until the endpoint announces itself again, longer than the
# interval of heartbeats; and s between these announcements. A router that has restarted forwards
# nothing to us until it has heard us.
SILENCE = 1.5
ANNOUNCE_INTERVAL = 0.25
# s until a thread that could not be started is tried again.
THREAD_RETRY_INTERVAL = 0.25

# Each frame in a line, at DEBUG, with the ``address`` of the other component.
_frame_log = logging.getLogger('illuminator_ros')


class Line:
    """
    Opens a connection URL again and again, and carries the messages of an endpoint.

    All methods but :meth:`stop` are for the thread that waits with the selector.

    :param label: its name while there is no transport.
    :param call: calls a function in that thread, given the time, s; callable from any thread.
    :param mavlink_version: 1 or 2, of the frames that are sent; both are received.
    :param wall_clock: s, Unix time, for the signing time stamps.
    :raises ValueError: if MAVLink 1 cannot carry a message of the endpoint, or must be signed.
    """

    def __init__(
        self, url: Url, endpoint: Endpoint, *, label: str, faults: FaultLog,
        selector: selectors.BaseSelector, call: Callable[[Callable[[float], None]], None],
        signing: Signing, mavlink_version: int, clock: Callable[[], float],
        wall_clock: Callable[[], float],
    ) -> None:
        classes = dict.fromkeys((*endpoint.messages, *endpoint.sends))
        if mavlink_version == 1 and (too_high := [c.msgname for c in classes if c.id > MAX_ID_V1]):
            raise ValueError(f'MAVLink 1 cannot carry {", ".join(too_high)}: it has no message '
                             f'ids above {MAX_ID_V1}; use MAVLink 2')
        self.status = LinkStatus(label, clock())
        self._endpoint = endpoint
        self._classes = {cls.id: cls for cls in endpoint.messages}
        self._faults = faults
        self._selector = selector
        self._clock = clock
        self._signing = signing
        writer = FrameWriter(signing, mavlink_version)
        self._receiver = Receiver(signing, self._classes, writer, wall_clock)
        self._sender = Sender(writer, endpoint.streams, self._receiver.routes,
                              self._receiver.traffic, faults, wall_clock)
        self._connector = Connector(
            url, lambda outcome: call(functools.partial(self._connector_reports, outcome)))
        # When to connect, s; infinity while the connector tries, and while there is a channel.
        self._connect_at = -math.inf
        self._channel: Channel | None = None
        # When the channel is proved without a frame, s.
        self._proven_at = math.inf
        self._announce_at = math.inf

    def stop(self) -> None:
        """Open nothing any more; callable from any thread."""
        self._connector.stop()

    def snapshot(self, now: float) -> LinkSnapshot:
        """Return the line at this moment."""
        status, receiver = self.status, self._receiver
        return LinkSnapshot(
            status.state, status.since, self._channel.name if self._channel else status.label,
            status.reason, status.openings, receiver.routes.peer_count(now),
            receiver.traffic.snapshot(now), copy.copy(receiver.counters),
            copy.copy(self._signing.counters))

    def peer_count_of(self, source: Address, now: float) -> int:
        """Return over how many peers a component is heard, which may be several senders."""
        return self._receiver.routes.peer_count_of(source, now)

    def reset_loss(self, source: Address) -> None:
        """Forget recent losses of a component: its sequence numbers have restarted."""
        if counter := self._receiver.traffic.sources.get(source):
            counter.reset_loss()

    def opened(self, channel: Channel, now: float) -> None:
        """Use a channel from now on."""
        self._channel = channel
        self._proven_at = now + PROOF_TIME
        self._announce_at = now + ANNOUNCE_INTERVAL
        try:
            channel.register(self._selector, self._serve)
        except (OSError, ValueError) as error:
            self._lost(OSError(f'cannot wait for {channel.name}: {error}'))
            return
        self._faults.call(self._endpoint.link_opened, now)
        self.flush()
        # Sending the first heartbeat may already have failed.
        if self._channel is channel:
            self.status.take(LinkInput.OPENED, now, channel.name)

    def flush(self) -> None:
        """Send the messages of the endpoint; without a channel they are dropped."""
        messages = list(self._endpoint.outgoing)
        self._endpoint.outgoing.clear()
        if self._channel is not None:
            try:
                self._sender.send(self._channel, messages, self._clock())
            except OSError as error:
                self._lost(error)

    def poll(self, now: float) -> None:
        """Do what is due."""
        if now >= self._connect_at:
            self._connect(now)
        channel = self._channel
        if channel is None:
            return
        if now >= self._proven_at:
            # The channel has lasted, so the next try after its loss is immediate.
            self._proven_at = math.inf
            self._connector.backoff.succeeded()
            self.status.take(LinkInput.PROVED, now, channel.name)
        for peer, frames in self._receiver.give_up(now):
            self._handle(channel, peer, frames, now)
        if now >= self._announce_at:
            self._announce_at = now + ANNOUNCE_INTERVAL
            self._faults.call(self._endpoint.link_opened, now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` or :meth:`flush` is due."""
        return min(
            self._connect_at, self._proven_at, self._announce_at, self.status.next_deadline(),
            self._receiver.next_deadline(),
            self._sender.next_deadline(self._channel) if self._channel else math.inf)

    def pause(self, now: float) -> float:
        """Return for how long to let foreign frames collect before the next read, s."""
        if self._channel is None or self._channel.more:
            return 0.0
        pause = self._receiver.pause(now)
        return pause if now >= self._sender.answer_expected_until else 0.0

    def close(self) -> None:
        """Close the channel."""
        channel, self._channel = self._channel, None
        if channel is None:
            return
        for key in list(self._selector.get_map().values()):
            if key.data == self._serve:
                self._selector.unregister(key.fileobj)
        with contextlib.suppress(OSError):
            channel.close()
        self._proven_at = self._announce_at = math.inf
        self._receiver.clear()
        self._sender.clear()

    def _connect(self, now: float) -> None:
        try:
            self._connector.start()
            self._connect_at = math.inf
        except RuntimeError as error:
            self.status.failed(str(error))
            self._connect_at = now + THREAD_RETRY_INTERVAL

    def _connector_reports(self, outcome: Channel | str | None, now: float) -> None:
        if isinstance(outcome, str):
            self.status.failed(outcome)
        elif outcome is None:
            self._connect_at = now + THREAD_RETRY_INTERVAL
        else:
            self.opened(outcome, now)

    def _lost(self, error: OSError) -> None:
        """Close the channel; the next poll opens it again."""
        if self._channel is None:
            return
        name, reason, now = self._channel.name, error.strerror or str(error), self._clock()
        self.close()
        self._connect_at = -math.inf
        self.status.take(LinkInput.CLOSED, now, name, reason)
        self._faults.call(self._endpoint.link_closed, now, reason)

    def _serve(self, handle: object, events: int) -> None:
        """Send or receive on a handle that is ready."""
        channel = self._channel
        # Another handle of the channel may just have shown its loss.
        if channel is None:
            return
        try:
            if events & selectors.EVENT_WRITE:
                channel.writable(handle)
            if events & selectors.EVENT_READ:
                for peer, data in channel.receive(handle):
                    now = self._clock()
                    frames = self._receiver.take(peer, data, now)
                    if frames is not None:
                        self._handle(channel, peer, frames, now)
        except OSError as error:
            self._lost(error)

    def _handle(
        self, channel: Channel, peer: Peer, frames: list[ReceivedFrame], now: float,
    ) -> None:
        """Take accepted frames of a peer, of which all may be of messages that are not handled."""
        if self.status.state is not LinkState.OPEN:
            self._connector.backoff.answered()
            self.status.take(LinkInput.PROVED, now, channel.name)
        self._announce_at = now + SILENCE
        if channel.heard(peer, now):
            if _frame_log.isEnabledFor(logging.DEBUG):
                _frame_log.debug('new peer %s on %s', peer, channel.name)
            self._faults.call(self._endpoint.link_opened, now)
        for frame, sender in frames:
            cls = self._classes.get(frame.message_id)
            if cls is None:
                continue
            if self._endpoint.inspect is not None:
                self._faults.call(self._endpoint.inspect, frame, cls)
            message = decode(cls, frame.payload, sender)
            if _frame_log.isEnabledFor(logging.DEBUG):
                _frame_log.debug('received from %s: %s', frame.source, line_of(message),
                                 extra={'address': frame.source})
            self._faults.call(self._endpoint.receive, frame.source, message, now)
