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
import selectors
import socket
from typing import Any

from ..url import Address
from .base import Channel, ChannelLost, FrameQueue, Peer

# s; the link tries again soon enough, and must be back within 1 s of the other side.
CONNECT_TIMEOUT = 0.8
MAX_CLIENTS = 16
READ_SIZE = 65536


class _Stream:
    """One connected, non-blocking socket with its queue of frames."""

    def __init__(self, connection: socket.socket) -> None:
        self.socket = connection
        self.queue = FrameQueue()
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        # A peer that vanished without a word is noticed in seconds, not in hours.
        for option, value in (('TCP_KEEPIDLE', 2), ('TCP_KEEPINTVL', 1), ('TCP_KEEPCNT', 3),
                              ('TCP_USER_TIMEOUT', 5000)):
            if hasattr(socket, option):
                connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), value)

    def receive(self) -> bytes | None:
        """Return what is there, None if there is nothing yet, b'' at the end."""
        try:
            return self.socket.recv(READ_SIZE)
        except BlockingIOError:
            return None

    def send(self, frame: bytes) -> int:
        """Queue and write; return how many frames were dropped."""
        dropped = self.queue.put(frame)
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

    def __init__(self, address: Address) -> None:
        try:
            connection = socket.create_connection(address, CONNECT_TIMEOUT)
        except socket.gaierror as error:
            raise OSError(f'cannot resolve {address.host!r}: {error.strerror}') from None
        except TimeoutError:
            raise OSError(f'no answer from {address}') from None
        except OSError as error:
            raise OSError(error.errno, f'cannot connect to {address}: {error.strerror}') from None
        if connection.getsockname() == connection.getpeername():
            # A connection to a free local port may be made with itself (RFC 793, 3.4).
            connection.close()
            raise OSError(f'cannot connect to {address}: nobody listens')
        self._stream = _Stream(connection)
        self.name = f'tcp to {address}'

    def register(self, selector: selectors.BaseSelector) -> None:
        """See :meth:`Channel.register`."""
        self._selector = selector
        selector.register(self._stream.socket, selectors.EVENT_READ)

    def receive(self, handle: Any) -> Iterator[tuple[Peer, bytes]]:
        """See :meth:`Channel.receive`."""
        try:
            data = self._stream.receive()
        except OSError as error:
            raise ChannelLost(error.errno, error.strerror) from None
        if data == b'':
            raise ChannelLost('the other side closed the connection')
        if data:
            yield None, data

    def peers(self, now: float) -> Sequence[Peer]:
        """See :meth:`Channel.peers`."""
        return (None,)

    def send(self, frame: bytes, peers: Sequence[Peer]) -> None:
        """See :meth:`Channel.send`."""
        try:
            self.dropped += self._stream.send(frame)
        except OSError as error:
            raise ChannelLost(error.errno, error.strerror) from None
        self._stream.watch(self._selector)

    def writable(self, handle: Any) -> None:
        """See :meth:`Channel.writable`."""
        try:
            self._stream.flush()
        except OSError as error:
            raise ChannelLost(error.errno, error.strerror) from None
        self._stream.watch(self._selector)

    def close(self) -> None:
        """See :meth:`Channel.close`."""
        self._stream.socket.close()


class TcpServer(Channel):
    """A listening socket and its clients, each a peer. A client that goes is no loss."""

    def __init__(self, address: Address) -> None:
        family = socket.AF_INET6 if ':' in address.host else socket.AF_INET
        self._listener = socket.socket(family, socket.SOCK_STREAM)
        try:
            self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._listener.bind(tuple(address))
            self._listener.listen()
            self._listener.setblocking(False)
        except OSError as error:
            self._listener.close()
            raise OSError(error.errno, f'cannot listen on {address}: {error.strerror}') from None
        self._clients: dict[socket.socket, _Stream] = {}
        self.name = f'tcp server {Address(*self._listener.getsockname()[:2])}'

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
            yield handle, data

    def _accept(self) -> None:
        try:
            connection, _ = self._listener.accept()
        except BlockingIOError:
            return
        except OSError as error:
            raise ChannelLost(error.errno, error.strerror) from None
        if len(self._clients) >= MAX_CLIENTS:
            connection.close()
            return
        self._clients[connection] = _Stream(connection)
        self._selector.register(connection, selectors.EVENT_READ)

    def _drop(self, connection: socket.socket) -> None:
        if self._clients.pop(connection, None):
            self._selector.unregister(connection)
            connection.close()

    def peers(self, now: float) -> Sequence[Peer]:
        """See :meth:`Channel.peers`."""
        return tuple(self._clients)

    def send(self, frame: bytes, peers: Sequence[Peer]) -> None:
        """See :meth:`Channel.send`."""
        for peer in peers:
            self._write(peer, frame)

    def writable(self, handle: Any) -> None:
        """See :meth:`Channel.writable`."""
        self._write(handle, None)

    def _write(self, peer: Any, frame: bytes | None) -> None:
        stream = self._clients.get(peer)
        if stream is None:
            return
        try:
            if frame is None:
                stream.flush()
            else:
                self.dropped += stream.send(frame)
        except OSError:
            self._drop(peer)
        else:
            stream.watch(self._selector)

    def close(self) -> None:
        """See :meth:`Channel.close`."""
        for client in list(self._clients):
            client.close()
        self._clients.clear()
        self._listener.close()
