# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The contract of an open transport, and the parts that transports share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Callable, Hashable, Iterator, Sequence
import contextlib
import errno
import math
import os
import selectors
import socket
from typing import cast

from ..errors import ChannelLost
from ..forwarding.forward_queue import ForwardQueue
from ..frame import Frame
from ..url import HostPort, SerialUrl

# The origin of received bytes, to which an answer can be sent.
Peer = Hashable
# Takes a registered handle that is ready, and its events.
Serve = Callable[[object, int], None]

# Bytes that wait for a slow line. Whole frames beyond that are dropped, the oldest first: a
# command that has waited longer than its time-out has been sent again.
MAX_QUEUED = 16 * 1024
# Bytes of one read from a stream. As many as a terminal of Linux holds: a full one stops a fast
# sender, such as a USB device, and must be read again at once.
READ_SIZE = 4095
# Reads in one pass of the link: 20 ms bring more than one takes at 5,000 frames a second.
MAX_READS = 2
# Bytes of frames of others that are written at once, and s for which the line may still be busy
# then: our own messages wait behind them.
FORWARD_SIZE = 2 * 1024
FORWARD_AHEAD = 0.002
# Share of the rate of a line that frames of others use at most. The clocks of serial ports differ
# by up to 2 % each; at the full rate the bytes that wait in a slower port become ever more.
FORWARD_SHARE = 0.95


def cannot_listen(
    address: HostPort, error: OSError, users: Callable[[], str] = str,
) -> OSError:
    """
    Return an error that says why a socket cannot listen, with the remedy if it is in use.

    :param users: returns the programs that use it, for people.
    """
    remedy = ''
    if error.errno == errno.EADDRINUSE:
        by = users()
        remedy = f'{by and " by "}{by} (doc/routers.md: several programs on one link)'
    return OSError(error.errno, f'cannot listen on {address}: {error.strerror}{remedy}')


class Channel(ABC):
    """
    An open transport, used from one thread and never blocking.

    :ivar name: its name in logs and errors.
    :ivar dropped: frames that were not sent because the line or the kernel was full.
    :ivar more: whether the last read may have left bytes.
    :ivar rate: of the line, bytes/s; infinity where it is not known.
    :ivar free_at: when the line will have sent all written bytes, s.
    :ivar serial: of a serial port, its URL.
    :ivar has_clients: whether its peers do not hear each other.
    :ivar not_forwarded: frames of others that were replaced or dropped, by message id.
    """

    name: str = ''
    dropped: int = 0
    more: bool = False
    rate: float = math.inf
    free_at: float = -math.inf
    serial: SerialUrl | None = None
    has_clients: bool = False

    def __init__(self) -> None:
        self.not_forwarded: Counter[int] = Counter()

    @property
    def is_waiting(self) -> bool:
        """Return whether frames wait until the channel is writable."""
        return False

    @abstractmethod
    def register(self, selector: selectors.BaseSelector, serve: Serve) -> None:
        """Register its descriptors with the selector, with ``serve`` as data."""

    @abstractmethod
    def receive(self, handle: object) -> Iterator[tuple[Peer, bytes]]:
        """
        Read from a registered handle; return bytes with their origin.

        No bytes are lost if only the first ones are taken from the iterator.

        :raises ChannelLost: if the channel is closed.
        """

    @abstractmethod
    def peers(self, now: float) -> Sequence[Peer]:
        """Return all peers, the receivers of a broadcast."""

    def heard(self, peer: Peer, now: float) -> bool:
        """
        Note that a checked frame came from a peer.

        Return whether the peer is new. Only checked frames may be reported, since the channel then
        sends to the peer.
        """
        return False

    def leads_to(self, peer: Peer) -> Peer:
        """Return the peer to which messages for the components behind a sender are sent."""
        return peer

    @abstractmethod
    def send(self, frames: Sequence[bytes], peers: Sequence[Peer]) -> None:
        """
        Send frames to some of the peers; drop those that do not fit.

        Frames of one call share a datagram where the transport has datagrams.

        :raises ChannelLost: if the channel is closed.
        """

    def writable(self, handle: object) -> None:  # noqa: B027 - only queues have something to do
        """Continue sending on a registered handle that is writable."""

    def forward(self, frames: Sequence[Frame], peers: Sequence[Peer], now: float) -> None:
        """
        Send frames of others to some of the peers, after our own.

        :raises ChannelLost: if the channel is closed.
        """
        dropped = self.dropped
        self.send([frame.data for frame in frames], peers)
        if self.dropped > dropped:
            self.not_forwarded.update(frame.message_id for frame in frames)

    def forward_more(self, now: float) -> None:  # noqa: B027 - only queues have something to do
        """
        Send frames of others that have waited, if the line has room for them.

        :raises ChannelLost: if the channel is closed.
        """

    @property
    def forward_due(self) -> float:
        """Return when :meth:`forward_more` is due, infinity if never."""
        return math.inf

    def change_rate(self, baud: int) -> None:
        """
        Change the rate of a serial port.

        :raises OSError: if the port does not have this rate, or the channel no rate.
        """
        raise OSError(f'{self.name} has no baud rate')

    @abstractmethod
    def close(self) -> None:
        """Close it; a second call has no effect."""


class FrameQueue:
    """Whole frames that wait until a stream is writable, at most :data:`MAX_QUEUED` bytes."""

    def __init__(self) -> None:
        self._frames: deque[bytes] = deque()
        self._size = 0
        self._begun = False

    def __bool__(self) -> bool:
        return bool(self._frames)

    def put(self, frame: bytes) -> int:
        """Append a frame and return how many older ones were dropped."""
        self._frames.append(frame)
        self._size += len(frame)
        dropped = 0
        # The first frame may be half on the wire; the rest of it must follow.
        first = 1 if self._begun else 0
        while self._size > MAX_QUEUED and len(self._frames) > first + 1:
            self._size -= len(self._frames[first])
            del self._frames[first]
            dropped += 1
        return dropped

    def unwritten(self) -> bytes:
        """Return the bytes to write next."""
        return b''.join(self._frames)

    def written(self, count: int) -> None:
        """Note that the first ``count`` bytes were written."""
        self._size -= count
        while count:
            frame = self._frames.popleft()
            self._begun = count < len(frame)
            if self._begun:
                self._frames.appendleft(frame[count:])
            count -= min(count, len(frame))


class StreamChannel(Channel):
    """
    A connected socket or a serial port that does not block, with its queue of frames.

    :param at_end: why the channel is lost when the stream ends.
    """

    def __init__(
        self, name: str, file: socket.socket | int, at_end: str, rate: float = math.inf,
    ) -> None:
        super().__init__()
        self.name = name
        self.rate = rate
        self._file = file
        self._descriptor = file if isinstance(file, int) else file.fileno()
        self._at_end = at_end
        self._queue = FrameQueue()
        self._forwarded = ForwardQueue(self.not_forwarded, rate)

    @property
    def is_waiting(self) -> bool:
        """See :attr:`Channel.is_waiting`."""
        return bool(self._queue)

    def register(self, selector: selectors.BaseSelector, serve: Serve) -> None:
        """See :meth:`Channel.register`."""
        self._selector = selector
        selector.register(self._file, selectors.EVENT_READ, serve)

    def receive(self, handle: object) -> Iterator[tuple[Peer, bytes]]:
        """See :meth:`Channel.receive`."""
        data = b''
        try:
            for _ in range(MAX_READS):
                part = os.read(self._descriptor, READ_SIZE)
                data += part
                self.more = len(part) == READ_SIZE
                if not self.more:
                    break
        except BlockingIOError:
            self.more = False
        except OSError as error:
            # The next call raises the same error.
            if not data:
                raise ChannelLost(error.errno, error.strerror) from None
        else:
            if not data:
                raise ChannelLost(self._at_end)
        if data:
            yield None, data

    def peers(self, now: float) -> Sequence[Peer]:
        """See :meth:`Channel.peers`."""
        return (None,)

    def send(self, frames: Sequence[bytes], peers: Sequence[Peer]) -> None:
        """See :meth:`Channel.send`."""
        self.dropped += sum(map(self._queue.put, frames))
        try:
            with contextlib.suppress(BlockingIOError):
                while self._queue:
                    # Write in one call: each call takes longer than making the frames.
                    self._queue.written(os.write(self._descriptor, self._queue.unwritten()))
        except OSError as error:
            raise ChannelLost(error.errno, error.strerror) from None
        events = selectors.EVENT_READ | (selectors.EVENT_WRITE if self._queue else 0)
        key = self._selector.get_key(self._file)
        if key.events != events:
            self._selector.modify(self._file, events, key.data)

    def writable(self, handle: object) -> None:
        """See :meth:`Channel.writable`."""
        self.send((), ())

    def forward(self, frames: Sequence[Frame], peers: Sequence[Peer], now: float) -> None:
        """See :meth:`Channel.forward`."""
        for frame in frames:
            self._forwarded.put(frame, now)
        self.forward_more(now)

    def forward_more(self, now: float) -> None:
        """See :meth:`Channel.forward_more`."""
        while not self._queue and self.forward_due <= now:
            frames: list[bytes] = []
            size = 0
            while (size < FORWARD_SIZE and self.free_at <= now + FORWARD_AHEAD
                    and (frame := self._forwarded.pop(now))):
                frames.append(frame)
                size += len(frame)
                self.free_at = max(now, self.free_at) + len(frame) / (FORWARD_SHARE * self.rate)
            self.send(frames, ())

    @property
    def forward_due(self) -> float:
        """See :attr:`Channel.forward_due`."""
        return self.free_at - FORWARD_AHEAD if self._forwarded and not self._queue else math.inf


# An address as sockets of IPv4 and IPv6 have it.
SocketName = tuple[str, int] | tuple[str, int, int, int]


def resolve(address: HostPort, kind: socket.SocketKind) -> list[tuple[int, SocketName]]:
    """
    Return families and socket addresses; IPv4 first, since most MAVLink programs use only that.

    :param address: an empty host means all IPv4 interfaces.
    :raises OSError: if the name cannot be resolved.
    """
    try:
        found = socket.getaddrinfo(address.host or '0.0.0.0', address.port, type=kind)
    except (socket.gaierror, UnicodeError) as error:
        reason = getattr(error, 'strerror', None) or 'not a host name'
        raise OSError(f'cannot resolve {address.host!r}: {reason}') from None
    found.sort(key=lambda entry: entry[0] != socket.AF_INET)
    return [(family, cast(SocketName, sockaddr)) for family, _, _, _, sockaddr in found]
