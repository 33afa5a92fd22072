# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""TCP, as a client and as a server."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
import errno
import math
import selectors
import socket

from .base import (
    cannot_listen,
    Channel,
    FORWARD_SIZE,
    MAX_QUEUED,
    Peer,
    resolve,
    Serve,
    StreamChannel,
)
from ..errors import ChannelLost
from ..frame import Frame
from ..url import HostPort, TcpUrl

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


class _Connection(StreamChannel):

    def __init__(self, name: str, connection: socket.socket) -> None:
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        # The kernel would queue megabytes: minutes of commands that have timed out.
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, MAX_QUEUED)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        # Detect a vanished peer in seconds, not in hours. Hold forwarded frames here and not in
        # the kernel, where our own messages would wait behind them.
        for option, value in (('TCP_KEEPIDLE', 2), ('TCP_KEEPINTVL', 1), ('TCP_KEEPCNT', 3),
                              ('TCP_USER_TIMEOUT', USER_TIMEOUT),
                              ('TCP_NOTSENT_LOWAT', FORWARD_SIZE)):
            if hasattr(socket, option):
                connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), value)
        super().__init__(name, connection, 'the other side closed the connection')
        self._connection = connection

    def drop(self) -> None:
        self._selector.unregister(self._connection)
        self.close()

    def close(self) -> None:
        self._connection.close()


def open_tcp(url: TcpUrl) -> Channel:
    """
    Connect to a server, or listen.

    :raises OSError: if that fails.
    """
    if url.listen:
        return TcpServer(url.address)
    return _Connection(f'tcp to {url.address}', _connect(url.address))


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

    has_clients = True

    def __init__(self, address: HostPort) -> None:
        super().__init__()
        family, sockaddr = resolve(address, socket.SOCK_STREAM)[0]
        self._listener = socket.socket(family, socket.SOCK_STREAM)
        try:
            self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._listener.bind(sockaddr)
            self._listener.listen()
            self._listener.setblocking(False)
        except OSError as error:
            self._listener.close()
            raise cannot_listen(address, error) from None
        self._clients: dict[Peer, _Connection] = {}
        # When each last sent a valid frame, s.
        self._heard: dict[Peer, float] = {}
        self._now = -math.inf
        self.name = f'tcp server {HostPort(*self._listener.getsockname()[:2])}'

    def register(self, selector: selectors.BaseSelector, serve: Serve) -> None:
        """See :meth:`Channel.register`."""
        self._selector, self._serve = selector, serve
        selector.register(self._listener, selectors.EVENT_READ, serve)

    def receive(self, handle: object) -> Iterator[tuple[Peer, bytes]]:
        """See :meth:`Channel.receive`."""
        if handle is self._listener:
            self._accept()
        elif client := self._clients.get(handle):
            try:
                for _, data in client.receive(handle):
                    self.more = client.more
                    yield handle, data
            except ChannelLost:
                self._drop(handle)

    def _accept(self) -> None:
        try:
            connection, _ = self._listener.accept()
        except OSError as error:
            if error.errno in NO_ROOM:
                raise ChannelLost(error.errno, error.strerror) from None
            # The client has gone, or the fault is the connection's and not the listener's.
            return
        if len(self._clients) >= MAX_CLIENTS:
            silent = min(self._heard, key=self._heard.__getitem__)
            if self._now - self._heard[silent] <= EXPIRY:
                connection.close()
                return
            self._drop(silent)
        try:
            client = _Connection('', connection)
        except OSError:
            connection.close()
            return
        client.register(self._selector, self._serve)
        self._clients[connection], self._heard[connection] = client, -math.inf

    def _drop(self, peer: Peer) -> None:
        self._clients.pop(peer).drop()
        del self._heard[peer]

    def heard(self, peer: Peer, now: float) -> bool:
        """See :meth:`Channel.heard`."""
        self._now = now
        if peer not in self._clients:
            return False
        before, self._heard[peer] = self._heard[peer], now
        return before == -math.inf

    def peers(self, now: float) -> Sequence[Peer]:
        """See :meth:`Channel.peers`."""
        self._now = now
        return tuple(self._clients)

    def send(self, frames: Sequence[bytes], peers: Sequence[Peer]) -> None:
        """See :meth:`Channel.send`."""
        self._each(peers, lambda client: client.send(frames, ()))

    def forward(self, frames: Sequence[Frame], peers: Sequence[Peer], now: float) -> None:
        """See :meth:`Channel.forward`."""
        self._each(peers, lambda client: client.forward(frames, (), now))

    def forward_more(self, now: float) -> None:
        """See :meth:`Channel.forward_more`."""
        self._each(tuple(self._clients), lambda client: client.forward_more(now))

    @property
    def forward_due(self) -> float:
        """See :attr:`Channel.forward_due`."""
        return min((client.forward_due for client in self._clients.values()), default=math.inf)

    def _each(self, peers: Sequence[Peer], call: Callable[[_Connection], None]) -> None:
        for peer in peers:
            if client := self._clients.get(peer):
                before = client.dropped
                try:
                    call(client)
                except ChannelLost:
                    self._drop(peer)
                self.dropped += client.dropped - before
                self.not_forwarded.update(client.not_forwarded)
                client.not_forwarded.clear()

    def writable(self, handle: object) -> None:
        """See :meth:`Channel.writable`."""
        self.send((), (handle,))

    def close(self) -> None:
        """See :meth:`Channel.close`."""
        for client in self._clients.values():
            client.close()
        self._clients.clear()
        self._listener.close()
