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

"""TCP, as a client and as a server."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import contextlib
import errno
import math
import selectors
import socket
from typing import Any

from .base import Channel, ChannelLost, FrameQueue, MAX_QUEUED, Peer
from .resolve import resolve
from ..url import HostPort

# s for all addresses of a name together; the link must return within 1 s of the other side.
CONNECT_TIMEOUT = 0.8
# ms without an acknowledgement until a connection is lost. TCP itself resends at growing
# intervals, so a cable that is plugged in again would go unnoticed for seconds.
USER_TIMEOUT = 2000
MAX_CLIENTS = 16
# s without a valid frame until a new client may replace an old one.
EXPIRY = 10.0
# Our process or the system lacks descriptors or memory for another connection.
NO_ROOM = {errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM}
# Bytes read before other work gets its turn.
READ_SIZE = 16 * 1024


class _Stream:
    """One connected, non-blocking socket with its queue of frames."""

    def __init__(self, connection: socket.socket) -> None:
        self.socket = connection
        self.queue = FrameQueue()
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        # The kernel would queue megabytes: minutes of commands that have timed out.
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, MAX_QUEUED)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        # Detect a vanished peer in seconds, not in hours.
        for option, value in (('TCP_KEEPIDLE', 2), ('TCP_KEEPINTVL', 1), ('TCP_KEEPCNT', 3),
                              ('TCP_USER_TIMEOUT', USER_TIMEOUT)):
            if hasattr(socket, option):
                connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), value)

    def receive(self) -> bytes | None:
        """Return available bytes, None if there are none yet, b'' at the end."""
        try:
            return self.socket.recv(READ_SIZE)
        except BlockingIOError:
            return None

    def send(self, frames: Sequence[bytes]) -> int:
        """Queue and write; return how many frames were dropped."""
        dropped = sum(self.queue.put(frame) for frame in frames)
        self.flush()
        return dropped

    def flush(self) -> None:
        with contextlib.suppress(BlockingIOError):
            while self.queue:
                self.queue.written(self.socket.send(self.queue.head()))

    def watch(self, selector: selectors.BaseSelector) -> None:
        events = selectors.EVENT_READ | (selectors.EVENT_WRITE if self.queue else 0)
        if selector.get_key(self.socket).events != events:
            selector.modify(self.socket, events)


class TcpClient(Channel):
    """A connection to a server."""

    def __init__(self, address: HostPort) -> None:
        self._stream = _Stream(_connect(address))
        self.name = f'tcp to {address}'

    def register(self, selector: selectors.BaseSelector) -> None:
        """See :meth:`Channel.register`."""
        self._selector = selector
        selector.register(self._stream.socket, selectors.EVENT_READ)

    def receive(self, handle: object) -> Iterator[tuple[Peer, bytes]]:
        """See :meth:`Channel.receive`."""
        try:
            data = self._stream.receive()
        except OSError as error:
            raise ChannelLost(error.errno, error.strerror) from None
        if data == b'':
            raise ChannelLost('the other side closed the connection')
        if data:
            self.more = len(data) == READ_SIZE
            yield None, data

    def peers(self, now: float) -> Sequence[Peer]:
        """See :meth:`Channel.peers`."""
        return (None,)

    def send(self, frames: Sequence[bytes], peers: Sequence[Peer]) -> None:
        """See :meth:`Channel.send`."""
        try:
            self.dropped += self._stream.send(frames)
        except OSError as error:
            raise ChannelLost(error.errno, error.strerror) from None
        self._stream.watch(self._selector)

    def writable(self, handle: object) -> None:
        """See :meth:`Channel.writable`."""
        try:
            self._stream.flush()
        except OSError as error:
            raise ChannelLost(error.errno, error.strerror) from None
        self._stream.watch(self._selector)

    def close(self) -> None:
        """See :meth:`Channel.close`."""
        self._stream.socket.close()


def _connect(address: HostPort) -> socket.socket:
    """Return a connection to the first of a name's addresses that answers."""
    found = resolve(address, socket.SOCK_STREAM)
    reason = OSError(f'cannot connect to {address}')
    for family, sockaddr in found:
        connection = socket.socket(family, socket.SOCK_STREAM)
        try:
            connection.settimeout(CONNECT_TIMEOUT / len(found))
            connection.connect(sockaddr)
            if connection.getsockname() != connection.getpeername():
                return connection
            # A connection to a free local port may be made with itself (RFC 793, 3.4).
            reason = OSError(f'cannot connect to {address}: no program listens there')
        except TimeoutError:
            reason = OSError(f'no answer from {address}')
        except OSError as error:
            reason = OSError(error.errno, f'cannot connect to {address}: {error.strerror}')
        connection.close()
    raise reason


class TcpServer(Channel):
    """
    A listening socket and its clients, each a peer. The link survives the loss of a client.

    Beyond :data:`MAX_CLIENTS`, a new client replaces the client with the longest silence; it is
    rejected if each has sent a valid frame within :data:`EXPIRY`.
    """

    def __init__(self, address: HostPort) -> None:
        family, sockaddr = resolve(address, socket.SOCK_STREAM)[0]
        self._listener = socket.socket(family, socket.SOCK_STREAM)
        try:
            self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._listener.bind(sockaddr)
            self._listener.listen()
            self._listener.setblocking(False)
        except OSError as error:
            self._listener.close()
            raise OSError(error.errno, f'cannot listen on {address}: {error.strerror}') from None
        self._clients: dict[socket.socket, _Stream] = {}
        # Time of the last valid frame, s.
        self._heard: dict[socket.socket, float] = {}
        self._now = -math.inf
        self.name = f'tcp server {HostPort(*self._listener.getsockname()[:2])}'

    def register(self, selector: selectors.BaseSelector) -> None:
        """See :meth:`Channel.register`."""
        self._selector = selector
        selector.register(self._listener, selectors.EVENT_READ)

    def receive(self, handle: Any) -> Iterator[tuple[Peer, bytes]]:
        """See :meth:`Channel.receive`."""
        if handle is self._listener:
            self._accept()
            return
        stream = self._clients.get(handle)
        if stream is None:
            return
        try:
            data = stream.receive()
        except OSError:
            data = b''
        if data == b'':
            self._drop(handle)
        elif data:
            self.more = len(data) == READ_SIZE
            yield handle, data

    def _accept(self) -> None:
        try:
            connection, _ = self._listener.accept()
        except OSError as error:
            if error.errno in NO_ROOM:
                raise ChannelLost(error.errno, error.strerror) from None
            # The client has gone, or the fault is the connection's and not the listener's.
            return
        if len(self._clients) >= MAX_CLIENTS:
            silent = min(self._clients, key=lambda c: self._heard.get(c, -math.inf))
            if self._now - self._heard.get(silent, -math.inf) <= EXPIRY:
                connection.close()
                return
            self._drop(silent)
        try:
            self._clients[connection] = _Stream(connection)
        except OSError:
            connection.close()
            return
        self._selector.register(connection, selectors.EVENT_READ)

    def _drop(self, connection: socket.socket) -> None:
        self._heard.pop(connection, None)
        if self._clients.pop(connection, None):
            self._selector.unregister(connection)
            connection.close()

    def heard(self, peer: object, now: float) -> bool:
        """See :meth:`Channel.heard`."""
        self._now = now
        new = peer in self._clients and peer not in self._heard
        if peer in self._clients:
            self._heard[peer] = now
        return new

    def peers(self, now: float) -> Sequence[Peer]:
        """See :meth:`Channel.peers`."""
        self._now = now
        return tuple(self._clients)

    def send(self, frames: Sequence[bytes], peers: Sequence[Peer]) -> None:
        """See :meth:`Channel.send`."""
        for peer in peers:
            self._write(peer, frames)

    def writable(self, handle: object) -> None:
        """See :meth:`Channel.writable`."""
        self._write(handle, ())

    def _write(self, peer: Any, frames: Sequence[bytes]) -> None:
        stream = self._clients.get(peer)
        if stream is None:
            return
        try:
            self.dropped += stream.send(frames)
        except OSError:
            self._drop(peer)
        else:
            stream.watch(self._selector)

    def close(self) -> None:
        """See :meth:`Channel.close`."""
        for client in list(self._clients):
            client.close()
        self._clients.clear()
        self._heard.clear()
        self._listener.close()
