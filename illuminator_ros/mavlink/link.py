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

"""The link: the one thread that owns a transport and the endpoint that uses it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
import contextlib
import copy
import functools
import logging
import math
import select
import selectors
import socket
import struct
import threading
import time

from .component import Endpoint
from .conflating_queue import ConflatingQueue
from .connector import Connector
from .frame import Frame, MAX_ID_V1
from .frame_reader import FrameReader
from .frame_writer import FrameWriter
from .link_state import LinkEvent, LinkInput, LinkSnapshot, LinkStatus
from .messages import Address, Message, target_of
from .routing_table import RoutingTable
from .signing import Signing
from .signing_files import TimestampStore
from .statistics import Traffic
from .transport import Channel, Peer
from .url import Url

# s; the longest wait of the thread, not longer than the wait for an acknowledgement. So a caller's
# turn that sends a command need not wake the thread, which would take a processor from the
# component that answers.
MAX_WAIT = 0.2
# To wake the loop costs as much as ten foreign frames. Where more than BATCH_THRESHOLD come per
# second, the loop pauses for BATCH_TIME s, or until BATCH_SIZE are expected; a UDP socket has room
# for 250. A call ends the pause. No pause begins within ANSWER_TIME s of a message that may be
# answered.
BATCH_THRESHOLD = 1000.0
BATCH_TIME = 0.02
BATCH_SIZE = 128
ANSWER_TIME = 1.0
# s between stores of the signing time stamp; the specification asks for once a minute.
STORE_INTERVAL = 30.0
# s; the longest wait of a caller for the answer to its messages.
CALLER_WAIT = 0.002
# The most bytes that a caller decodes. The worst take a microsecond each.
CALLER_BYTES = 4096
# s; a channel that stays open for this time is proved without a frame.
PROOF_TIME = 1.0
# s for which the line may still be busy when the next group of a stream is written, so that it has
# no gaps. The most urgent group may wait behind one more in the line.
WRITE_AHEAD = 0.002
URGENT_WRITE_AHEAD = 0.02
# s without a frame from any peer until the endpoint announces itself again, longer than the
# interval of heartbeats; and s between these announcements. A router that has restarted forwards
# nothing to us until it has heard us.
SILENCE = 1.5
ANNOUNCE_INTERVAL = 0.25
# s until a thread that could not be started is tried again.
THREAD_RETRY_INTERVAL = 0.25
# s; the pause of the loop after an exception, and the shortest time between log lines on
# exceptions.
FAULT_PAUSE = 0.1
FAULT_LOG_INTERVAL = 1.0

_log = logging.getLogger(__name__)
# Each frame in a line, at DEBUG, with the ``address`` of the other component.
_frame_log = logging.getLogger('illuminator_ros')


class LinkThreadError(RuntimeError):
    """The thread of a link cannot be started; the message names the link and says why."""


class Link:
    """
    Runs an endpoint over a connection URL in a thread of its own, and reopens lost transports.

    All methods of the endpoint are called in turns of the link, one after the other. The link's
    thread takes the turns; while it waits, :meth:`run_turn` takes one in the thread of its caller.

    :param on_event: called in a turn when the link is opened, lost, or cannot be
        opened at first; at a limited rate.
    :param store: keeps the time stamps of signing for the next run; None keeps them nowhere.
    :param mavlink_version: 1 or 2, of the frames that are sent; both are received.
    :param clock: s, monotonic.
    :param wall_clock: s, Unix time, for the signing time stamps.
    :param selector: waits for the transport.
    :raises ValueError: if MAVLink 1 cannot carry a message of the endpoint, or must be signed.
    """

    def __init__(
        self, url: Url, endpoint: Endpoint, *, label: str,
        on_event: Callable[[LinkEvent], None] = lambda event: None,
        signing: Signing | None = None,
        store: TimestampStore | None = None,
        mavlink_version: int = 2,
        clock: Callable[[], float] = time.monotonic,
        wall_clock: Callable[[], float] = time.time,
        selector: selectors.BaseSelector | None = None,
    ) -> None:
        self.endpoint = endpoint
        self.clock = clock
        self._wall_clock = wall_clock
        self._on_event = on_event
        self._label = label
        self._signing = signing or Signing()
        self._writer = FrameWriter(self._signing, mavlink_version)
        self._classes = {cls.id: cls for cls in endpoint.messages}
        classes = dict.fromkeys((*endpoint.messages, *endpoint.sends))
        if mavlink_version == 1 and (too_high := [c.name for c in classes if c.id > MAX_ID_V1]):
            raise ValueError(f'MAVLink 1 cannot carry {", ".join(too_high)}: it has no message '
                             f'ids above {MAX_ID_V1}; use MAVLink 2')
        self._store = store
        self._connector = Connector(
            url, lambda outcome: self.call(functools.partial(self._connector_reports, outcome)))
        self._connecting = False
        self._connect_at = -math.inf
        self._channel: Channel | None = None
        self._reader = FrameReader(self._signing, self._classes)
        self._routes = RoutingTable()
        # The address and the peer that the last frame came from, and its time, s.
        self._heard_last: tuple[Address, Peer, float] | None = None
        self._traffic = Traffic()
        # Messages that wait for the line, and when the line will have sent all written bytes, s.
        self._streams = ConflatingQueue(endpoint.streams)
        self._line_free_at = -math.inf
        self._status = LinkStatus(label, clock())
        # When the channel is proved without a frame, and whether a frame was received over it.
        self._proven_at = math.inf
        self._frame_received = False
        self._announce_at = math.inf
        self._store_due = 0.0
        # When there is work next, s, and whether there may be work before.
        self._due = 0.0
        self._work_pending = False
        # Foreign frames received by the end of the last pass of the loop that had some, the time
        # of that pass, and the time until which an answer is expected, s.
        self._foreign_before = 0
        self._foreign_at = -math.inf
        self._answer_expected_until = -math.inf
        self._calls: deque[Callable[[float], None]] = deque()
        self._wake_out, self._wake_in = socket.socketpair()
        self._wake_out.setblocking(False)
        self._wake_in.setblocking(False)
        self._selector = selector or selectors.DefaultSelector()
        self._selector.register(self._wake_out, selectors.EVENT_READ)
        self._calls_only = select.poll()
        self._calls_only.register(self._wake_out, select.POLLIN)
        self._stopping = threading.Event()
        self._starting = threading.Lock()
        # The shortest next wait of the loop, s, after an exception.
        self._pause = 0.0
        self._fault_log_due = -math.inf
        # Held during each turn. The link thread holds the lock, except while it waits.
        self._turn = threading.Lock()
        self._turn.acquire()
        # The time until which the link thread waits, s, unless it is woken before.
        self._waits_until = -math.inf
        # The thread of the caller that has taken the turn.
        self._taker: int | None = None
        # Whether a caller has received meanwhile, so that ready handles may not be ready any more.
        self._received_by_caller = False
        self._thread = threading.Thread(target=self._run, name='mavlink-link', daemon=True)

    # From any thread

    def start(self) -> None:
        """
        Start the thread.

        :raises LinkThreadError: if that fails; it may be tried again.
        """
        with self._starting:
            if not self._stopping.is_set():
                try:
                    self._thread.start()
                except RuntimeError as error:
                    raise LinkThreadError(f'{self._label}: {error} for the link') from None

    def stop(self, timeout: float = 1.0) -> None:
        """
        Close the transport and end the thread; it cannot be started again.

        :param timeout: how long to wait for the thread, s.
        """
        self._connector.stop()
        with self._starting:
            self._stopping.set()
            if self._thread.ident is None:
                self._release()
        self._wake()
        # The thread of this turn cannot wait for the end of the turn.
        if (self._thread.is_alive()
                and threading.get_ident() not in (self._thread.ident, self._taker)):
            self._thread.join(timeout)

    def is_running(self) -> bool:
        """Return whether the thread runs."""
        return self._thread.is_alive()

    def call(self, function: Callable[[float], None]) -> None:
        """Have ``function(now)`` called in the link's thread, unless the thread has ended."""
        self._calls.append(function)
        self._wake()

    def run_turn(
        self, function: Callable[[float], None], is_done: Callable[[], bool] | None = None,
    ) -> None:
        """
        Call ``function(now)`` in a turn here if the link's thread waits, else as :meth:`call`.

        The function and the sending of its messages take less time than a change of threads. The
        caller must not hold a lock that is taken in a turn.

        :param is_done: if it is given, the caller receives frames in this turn until it returns
            True, for :data:`CALLER_WAIT` at most.
        """
        if self._calls or not self._turn.acquire(blocking=False):
            self.call(function)
            return
        wakes, self._taker = True, threading.get_ident()
        try:
            self._safe_call(function, self.clock())
            self._flush()
            if is_done is not None and not is_done():
                self._receive_until(is_done)
            # Wake the thread only if it is needed: the component that answers may wait for this
            # processor. Where nothing was received, the other deadlines have not changed.
            is_complete = self._received_by_caller or self._channel is None
            self._due = self._next_deadline() if is_complete else min(
                self._due, self.endpoint.next_deadline(), self._stream_due())
            wakes = self._due < self._waits_until
        except Exception:
            self._log_fault()
        finally:
            if wakes:
                self._waits_until = -math.inf
            self._taker = None
            self._turn.release()
        if wakes:
            self._wake()

    def _receive_until(self, is_done: Callable[[], bool]) -> None:
        """Receive in the turn of a caller, which need not wait for a change of threads."""
        until = min(self.clock() + CALLER_WAIT, self._due)
        while (self._channel is not None and not self._calls
               and (wait := until - self.clock()) > 0):
            # Both this thread and the link's may wait for the selector.
            ready = self._selector.select(wait)
            if not ready or ready[0][0].fileobj is self._wake_out:
                break
            self._received_by_caller = True
            # One after the other: the first may close the others.
            self._serve(ready[0][0].fileobj, ready[0][1], by_caller=True)
            if is_done():
                break
            until = min(until, self.endpoint.next_deadline())

    def _wake(self) -> None:
        # A full buffer has woken the thread already; a closed one has no thread to wake.
        with contextlib.suppress(OSError):
            self._wake_in.send(b'\0')

    # In a turn

    def snapshot(self, now: float) -> LinkSnapshot:
        """Return the link at this moment."""
        channel, status = self._channel, self._status
        return LinkSnapshot(
            status.state, status.since, channel.name if channel else self._label, status.reason,
            status.openings, self._routes.peer_count(now), self._traffic.snapshot(now),
            copy.copy(self._reader.counters), copy.copy(self._signing.counters))

    def peer_count_of(self, source: Address, now: float) -> int:
        """Return over how many peers a component is heard, which may be several senders."""
        return self._routes.peer_count_of(source, now)

    def reset_loss(self, source: Address) -> None:
        """Forget recent losses of a component: its sequence numbers have restarted."""
        if counter := self._traffic.sources.get(source):
            counter.reset_loss()

    def _run(self) -> None:
        while not self._stopping.is_set():
            try:
                self._run_once()
            except Exception:
                self._log_fault()
                self._stopping.wait(FAULT_PAUSE)
        # No channel is handed over any more, and one that just was is among the calls.
        self._connector.stop()
        self._run_calls()
        self._store_timestamp(last=True)
        self._close()
        self._status.take(LinkInput.STOPPED, self.clock())
        self._release()

    def _release(self) -> None:
        self._selector.close()
        self._wake_out.close()
        self._wake_in.close()

    def _run_once(self) -> None:
        """Wait for the transport, a call or a deadline, and handle it."""
        due = min(self._due, self._reader.next_deadline())
        now = self.clock()
        wait = min(max(due - now, self._pause), MAX_WAIT)
        self._pause = 0.0
        self._waits_until = now + wait
        self._turn.release()
        try:
            ready = self._selector.select(wait)
        finally:
            self._turn.acquire()
        if not ready:
            # A stop of the process (SIGSTOP, docker pause) interrupts the wait, which then finds
            # nothing. Frames that came meanwhile precede the deadlines that have passed.
            ready = self._selector.select(0)
        for key, events in ready:
            if key.fileobj is self._wake_out:
                with contextlib.suppress(BlockingIOError):
                    self._wake_out.recv(4096)
            # A caller's turn may have lost the channel meanwhile, but only the thread opens one.
            elif self._channel is not None and not self._received_by_caller:
                self._serve(key.fileobj, events)
        self._received_by_caller = False
        now = self.clock()
        if self._work_pending or self._calls or now >= min(due, self._due):
            self._work()
        self._collect(now)

    def _collect(self, now: float) -> None:
        """Let foreign frames collect on a busy link."""
        foreign = self._reader.counters.foreign
        count, gap = foreign - self._foreign_before, now - self._foreign_at
        if not count or self._channel is None or self._channel.more:
            return
        self._foreign_before, self._foreign_at = foreign, now
        if now >= self._answer_expected_until and count > BATCH_THRESHOLD * gap > 0:
            seconds = min(BATCH_TIME, BATCH_SIZE * gap / count)
            # poll() cannot wait for less than 1 ms.
            if seconds < 0.001:
                time.sleep(seconds)
            else:
                self._calls_only.poll(1000 * seconds)

    def _work(self) -> None:
        """Run the calls of other threads, send, and do what is due."""
        self._work_pending = False
        self._run_calls()
        self._flush()
        self._due = self._next_deadline()
        if self.clock() >= self._due:
            self._poll()
            self._due = self._next_deadline()

    def _next_deadline(self) -> float:
        """Return when :meth:`_poll` is due."""
        return min(
            self.endpoint.next_deadline(), self._announce_at, self._proven_at, self._store_due,
            self._status.next_deadline(), self._stream_due(), self._reader.next_deadline(),
            math.inf if self._channel is not None or self._connecting else self._connect_at)

    def _poll(self) -> None:
        """Do what is due."""
        now = self.clock()
        if self._channel is not None:
            self._poll_channel(self._channel, now)
        elif not self._connecting and now >= self._connect_at:
            self._connect(now)
        self._safe_call(self.endpoint.poll, self.clock())
        self._flush()
        now = self.clock()
        if now >= self._store_due:
            self._store_due = now + STORE_INTERVAL
            self._store_timestamp(last=False)
        while event := self._status.event(now):
            self._safe_call(self._on_event, event)

    def _store_timestamp(self, *, last: bool) -> None:
        if self._store:
            self._safe_call(functools.partial(self._store.store, last=last),
                            self._signing.timestamp, self._wall_clock())

    def _serve(self, handle: object, events: int, *, by_caller: bool = False) -> None:
        """Send or receive on a handle that is ready; a caller leaves large data to the thread."""
        assert self._channel is not None
        try:
            if events & selectors.EVENT_WRITE:
                self._channel.writable(handle)
                self._work_pending |= bool(self._streams)
            if events & selectors.EVENT_READ:
                for peer, data in self._channel.receive(handle):
                    if by_caller and len(data) > CALLER_BYTES:
                        self.call(functools.partial(self._take_later, self._channel, peer, data))
                    else:
                        self._take(self._channel, peer, data)
                    if by_caller or self._channel is None:
                        return
        except OSError as error:
            self._lost(error)

    def _take_later(self, channel: Channel, peer: Peer, data: bytes, now: float) -> None:
        if self._channel is channel:
            self._take(channel, peer, data)

    def _take(self, channel: Channel, peer: Peer, data: bytes) -> None:
        now = self.clock()
        frames = self._reader.take(peer, data, now, self._wall_clock())
        if frames:
            for frame in frames:
                if isinstance(frame, Frame):
                    self._accept(channel, peer, frame, now)
                elif frame.source not in self._writer.sequences:
                    # Frames from our own address have returned, or show an address conflict.
                    self._traffic.count_run(frame.source, frame.sequences)
                    self._heard(channel, peer, frame.source, now)
            self._flush()
        self._traffic.bytes_received += len(data)

    def _accept(self, channel: Channel, peer: Peer, frame: Frame, now: float) -> None:
        if frame.source in self._writer.sequences and self._writer.is_loopback(frame, now):
            return
        sender = self._traffic.count(frame)
        self._heard(channel, peer, frame.source, now)
        cls = self._classes.get(frame.message_id)
        if cls is not None:
            self._work_pending = True
            if self.endpoint.inspect is not None:
                self._safe_call(self.endpoint.inspect, frame, cls)
            message = cls.decode(frame.payload, sender)
            if _frame_log.isEnabledFor(logging.DEBUG):
                _frame_log.debug('received from %s: %s', frame.source, message,
                                 extra={'address': frame.source})
            try:
                self.endpoint.receive(frame.source, message, now)
            except Exception:
                self._fault()

    def _heard(self, channel: Channel, peer: Peer, source: Address, now: float) -> None:
        """Note that frames from an address have come from a peer."""
        heard = source, peer, now
        if heard == self._heard_last:
            # The last frame was in the same datagram.
            return
        self._heard_last = heard
        if not self._frame_received:
            self._frame_received = self._work_pending = True
            self._connector.backoff.answered()
            self._status.take(LinkInput.PROVED, now, channel.name)
        self._announce_at = now + SILENCE
        if channel.heard(peer, now):
            self._work_pending = True
            if _frame_log.isEnabledFor(logging.DEBUG):
                _frame_log.debug('new peer %s on %s', peer, channel.name)
            self._safe_call(self.endpoint.link_opened, now)
        self._routes.heard(source, peer, now)

    def _poll_channel(self, channel: Channel, now: float) -> None:
        if now >= self._proven_at:
            # The channel has lasted, so the next try after its loss is immediate.
            self._proven_at = math.inf
            self._connector.backoff.succeeded()
            self._status.take(LinkInput.PROVED, now, channel.name)
        for peer, frame in self._reader.give_up(now, self._wall_clock()):
            self._accept(channel, peer, frame, now)
        if now >= self._announce_at:
            self._announce_at = now + ANNOUNCE_INTERVAL
            self._safe_call(self.endpoint.link_opened, now)

    def _flush(self) -> None:
        """Send the messages of the endpoint; without a channel they are dropped."""
        outgoing = self.endpoint.outgoing
        if self.endpoint.streams:
            self._flush_streams()
        elif outgoing:
            messages = list(outgoing)
            outgoing.clear()
            self._send_messages(messages, self.clock())
        if self._channel is None:
            outgoing.clear()
            self._streams.clear()

    def _flush_streams(self) -> None:
        outgoing, streams = self.endpoint.outgoing, self._streams
        dropped = streams.dropped
        if outgoing:
            now = self.clock()
            urgent = [one for one in outgoing if not streams.hold(*one, now)]
            outgoing.clear()
            self._send_messages(urgent, now)
        while streams and self._stream_due() <= (now := self.clock()):
            self._send_messages(streams.take(now), now)
        self._traffic.frames_dropped += streams.dropped - dropped

    def _stream_due(self) -> float:
        """Return when messages of streams can be sent; infinity while the channel is full."""
        if (not self.endpoint.streams or self._channel is None or self._channel.is_waiting
                or not self._streams):
            return math.inf
        return self._line_free_at - (
            URGENT_WRITE_AHEAD if self._streams.is_urgent else WRITE_AHEAD)

    def _send_messages(self, messages: Sequence[tuple[Address, Message]], now: float) -> None:
        if self._channel is None:
            return
        all_peers = self._channel.peers(now)
        # Frames for the same peers are sent together: each receiver is then woken only once.
        frames: list[bytes] = []
        peers: Sequence[Peer] = ()
        for source, message in messages:
            if getattr(message, 'target_system', 0):
                self._answer_expected_until = now + ANSWER_TIME
            towards = (self._routes.towards(message, all_peers, now) if len(all_peers) > 1
                       else all_peers)
            if frames and towards != peers:
                self._send(frames, peers, now)
                frames = []
            peers = towards
            self._write(frames, source, message, now)
        if frames:
            self._send(frames, peers, now)

    def _write(self, frames: list[bytes], source: Address, message: Message, now: float) -> None:
        try:
            frames.append(self._writer.frame(source, message, now, self._wall_clock()))
        except (ValueError, OverflowError, struct.error):
            self._log_fault()
        else:
            if _frame_log.isEnabledFor(logging.DEBUG):
                _frame_log.debug('sent from %s: %s', source, message,
                                 extra={'address': target_of(message)})

    def _send(self, frames: Sequence[bytes], peers: Sequence[Peer], now: float) -> None:
        channel = self._channel
        if channel is None:
            return
        dropped, size = channel.dropped, sum(map(len, frames))
        try:
            channel.send(frames, peers)
        except OSError as error:
            self._lost(error)
            return
        self._line_free_at = max(now, self._line_free_at) + size / channel.rate
        self._traffic.frames_dropped += channel.dropped - dropped
        self._traffic.frames_sent += len(frames) * len(peers)
        self._traffic.bytes_sent += size * len(peers)

    def _connect(self, now: float) -> None:
        try:
            self._connector.start()
            self._connecting = True
        except RuntimeError as error:
            self._status.failed(str(error))
            self._connect_at = now + THREAD_RETRY_INTERVAL

    def _connector_reports(self, outcome: Channel | str | None, now: float) -> None:
        if isinstance(outcome, str):
            self._status.failed(outcome)
            return
        self._connecting = False
        if outcome is None:
            self._connect_at = now + THREAD_RETRY_INTERVAL
        else:
            self._opened(outcome, now)

    def _opened(self, channel: Channel, now: float) -> None:
        if self._stopping.is_set():
            channel.close()
            return
        self._channel = channel
        self._line_free_at = -math.inf
        self._proven_at = now + PROOF_TIME
        self._frame_received = False
        self._announce_at = now + ANNOUNCE_INTERVAL
        try:
            channel.register(self._selector)
        except (OSError, ValueError) as error:
            self._lost(OSError(f'cannot wait for {channel.name}: {error}'))
            return
        self._safe_call(self.endpoint.link_opened, now)
        self._flush()
        # Sending the first heartbeat may already have failed.
        if self._channel is channel:
            self._status.take(LinkInput.OPENED, now, channel.name)

    def _lost(self, error: OSError) -> None:
        """Close the channel; the next poll opens it again."""
        if self._channel is None:
            return
        self._work_pending = True
        self._connect_at = -math.inf
        name, now = self._channel.name, self.clock()
        self._close()
        reason = error.strerror or str(error)
        self._status.take(LinkInput.CLOSED, now, name, reason)
        self._traffic.restart()
        self._safe_call(self.endpoint.link_closed, now, reason)

    def _close(self) -> None:
        if self._channel is None:
            return
        for key in list(self._selector.get_map().values()):
            if key.fileobj is not self._wake_out:
                self._selector.unregister(key.fileobj)
        channel, self._channel = self._channel, None
        with contextlib.suppress(OSError):
            channel.close()
        self._proven_at = self._announce_at = math.inf
        self._reader.clear()
        self._routes.clear()
        self._heard_last = None

    def _safe_call(self, function: Callable[..., None], *arguments: object) -> None:
        """Call a function; its exception must not end the thread."""
        try:
            function(*arguments)
        except Exception:
            self._fault()

    def _fault(self) -> None:
        """Log the exception that is handled, and have the loop pause before it may occur again."""
        self._pause = FAULT_PAUSE
        self._log_fault()

    def _log_fault(self) -> None:
        """Log the exception that is handled, at a limited rate."""
        if self.clock() >= self._fault_log_due:
            self._fault_log_due = self.clock() + FAULT_LOG_INTERVAL
            _log.exception('internal error in the link')

    def _run_calls(self) -> None:
        for _ in range(len(self._calls)):
            self._safe_call(self._calls.popleft(), self.clock())
