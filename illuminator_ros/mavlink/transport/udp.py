# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""UDP: listen, a fixed remote, learnt peers, broadcast."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import contextlib
import errno
import ipaddress
import itertools
import selectors
import socket

from .base import cannot_listen, Channel, Peer, resolve, Serve, SocketName
from .ports import users_of
from ..errors import ChannelLost
from ..url import HostPort, UdpUrl

# Peers that a listening socket sends to. A new peer never replaces a live one.
MAX_PEERS = 32
# s without a checked frame until a peer is dropped; MAVSDK has 10 s too.
PEER_EXPIRY = 10.0
# Datagrams and bytes read before other work is done. The worst bytes take a microsecond each, so
# that unbounded garbage would delay everything else for seconds, and more bytes an OFF by ms.
BATCH = 128
BATCH_SIZE = 4 * 1024
# Bytes of frames in one datagram, so that Ethernet does not fragment it.
MAX_DATAGRAM = 1400
# Bytes; a burst of a flight controller must fit. The kernel may grant less.
RECEIVE_BUFFER = 4 * 1024 * 1024
# The buffers of the kernel or the network device are full.
NO_ROOM = {errno.ENOBUFS, errno.ENOMEM}
# Why a remote cannot be sent to, where the system's own text has no remedy.
REASONS = {
    errno.EACCES: 'Permission denied: a broadcast address needs udp-b://, udp-pb:// or udpbcast:',
}


class UdpChannel(Channel):
    """
    A UDP socket.

    With a remote it sends to that address only, and accepts frames from any port of that host: the
    reference emulator sends from another port than it listens on. Without a remote it sends to
    every peer from which it received a checked frame.
    """

    def __init__(self, url: UdpUrl) -> None:
        super().__init__()
        remote = resolve(url.remote, socket.SOCK_DGRAM)[0] if url.remote else None
        family = remote[0] if remote else socket.AF_INET
        if url.bind.host:
            family, bind = resolve(url.bind, socket.SOCK_DGRAM)[0]
        else:
            bind = ('::' if family == socket.AF_INET6 else '0.0.0.0', url.bind.port)
        if remote and remote[0] != family:
            raise OSError(f'{url.bind} and {url.remote} are of different IP versions')
        self._remote = remote[1] if remote else None
        self._broadcast = url.broadcast
        self._hears_all = remote is None or bool(url.broadcast)
        self.has_clients = self._hears_all and url.broadcast != 'always'
        self._peers: dict[Peer, float] = {}
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        try:
            self._socket.setblocking(False)
            with contextlib.suppress(OSError):
                self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
            if url.broadcast:
                self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
            self._socket.bind(bind)
        except OSError as error:
            self._socket.close()
            raise cannot_listen(url.bind, error, lambda: users_of(url)) from None
        self.name = 'udp ' + ' to '.join(filter(None, (
            str(HostPort(*self._socket.getsockname()[:2])), str(url.remote or ''))))

    def register(self, selector: selectors.BaseSelector, serve: Serve) -> None:
        """See :meth:`Channel.register`."""
        selector.register(self._socket, selectors.EVENT_READ, serve)

    def receive(self, handle: object) -> Iterator[tuple[Peer, bytes]]:
        """See :meth:`Channel.receive`."""
        # Read the first datagram without a generator: it is mostly the only one, and is urgent.
        try:
            datagram, peer = self._socket.recvfrom(65536)
        except (BlockingIOError, ConnectionError):
            return self._receive_more(None, False, 0)
        except OSError as error:
            raise ChannelLost(error.errno, error.strerror) from None
        is_heard = self._hears_all or self._is_heard(peer)
        more = self._receive_more(peer, is_heard, len(datagram))
        return itertools.chain([(peer, datagram)], more) if is_heard else more

    def _receive_more(
        self, sender: object, is_heard: bool, size: int,
    ) -> Iterator[tuple[Peer, bytes]]:
        """
        Read the datagrams that wait behind the first one of a sender.

        :param size: of the first datagram, bytes.
        """
        receive = self._socket.recvfrom
        # Datagrams of one peer, except the first, are decoded together, at a third of the cost.
        datagrams: list[bytes] = []
        lost = None
        self.more = True
        for _ in range(BATCH - 1):
            if size >= BATCH_SIZE:
                break
            try:
                datagram, peer = receive(65536)
            except BlockingIOError:
                self.more = False
                break
            except ConnectionError:
                continue
            except OSError as error:
                lost = ChannelLost(error.errno, error.strerror)
                break
            size += len(datagram)
            if peer != sender:
                if datagrams:
                    yield sender, b''.join(datagrams)
                    datagrams = []
                sender, is_heard = peer, self._hears_all or self._is_heard(peer)
                if is_heard:
                    yield peer, datagram
            elif is_heard:
                datagrams.append(datagram)
        if datagrams:
            yield sender, b''.join(datagrams)
        if lost:
            raise lost

    def _is_heard(self, peer: SocketName) -> bool:
        assert self._remote is not None
        host = peer[0]
        # Each loopback address, such as 127.0.0.2, is this machine.
        return host == self._remote[0] or all(
            ipaddress.ip_address(one.partition('%')[0]).is_loopback
            for one in (host, self._remote[0]))

    def peers(self, now: float) -> Sequence[Peer]:
        """See :meth:`Channel.peers`."""
        if not self.has_clients:
            return (self._remote,)
        for heard in self._peers.values():
            if now - heard > PEER_EXPIRY:
                self._peers = {peer: at for peer, at in self._peers.items()
                               if now - at <= PEER_EXPIRY}
                break
        if self._broadcast and not self._peers:
            return (self._remote,)
        return tuple(self._peers)

    def heard(self, peer: Peer, now: float) -> bool:
        """See :meth:`Channel.heard`."""
        if not self._hears_all:
            return False
        new = peer not in self._peers
        if new and len(self.peers(now)) >= MAX_PEERS:
            return False
        self._peers[peer] = now
        return new

    def leads_to(self, peer: Peer) -> Peer:
        """See :meth:`Channel.leads_to`."""
        return peer if self.has_clients else self._remote

    def send(self, frames: Sequence[bytes], peers: Sequence[Peer]) -> None:
        """See :meth:`Channel.send`."""
        datagram, count = b'', 0
        for frame in frames:
            if datagram and len(datagram) + len(frame) > MAX_DATAGRAM:
                self.dropped += count * self._failures(datagram, peers)
                datagram, count = b'', 0
            datagram += frame
            count += 1
        self.dropped += count * self._failures(datagram, peers)

    def _failures(self, datagram: bytes, peers: Sequence[Peer]) -> int:
        """Send to each peer; return how often the datagram was dropped."""
        failures = 0
        for peer in peers:
            assert isinstance(peer, tuple)
            try:
                self._socket.sendto(datagram, peer)
            except (BlockingIOError, ConnectionError):
                failures += 1
            except OSError as error:
                failures += 1
                if error.errno in NO_ROOM:
                    continue
                if peer == self._remote:
                    reason = REASONS.get(error.errno or 0, error.strerror)
                    raise ChannelLost(error.errno, reason) from None
                # The link survives the loss of a learnt peer.
                self._peers.pop(peer, None)
        return failures

    def close(self) -> None:
        """See :meth:`Channel.close`."""
        self._socket.close()
