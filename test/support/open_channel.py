# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A channel without a link around it, and sockets for its other side."""

from __future__ import annotations

from collections.abc import Callable
import selectors
import socket
import time
from typing import Any

from illuminator_ros.mavlink.transport import Channel
from illuminator_ros.mavlink.url import Url
from support.ports import free_port
from support.waiting import PATIENCE


class OpenChannel:
    """A channel with its selector."""

    def __init__(self, channel: Channel) -> None:
        self.channel = channel
        self.selector = selectors.DefaultSelector()
        channel.register(self.selector, self._ready)

    def receive(self, count: int = 1) -> list[tuple[Any, bytes]]:
        """Wait for pieces of data and return them with their origins."""
        found: list[tuple[Any, bytes]] = []
        until = time.monotonic() + PATIENCE
        while len(found) < count:
            assert time.monotonic() < until, f'only {found} came'
            found += self.turn(PATIENCE)
        return found

    def turn(self, patience: float = 0.0) -> list[tuple[Any, bytes]]:
        """Do the due work, waiting for ``patience`` s at most; return the received data."""
        found: list[tuple[Any, bytes]] = []
        for key, events in self.selector.select(patience):
            if events & selectors.EVENT_WRITE:
                self.channel.writable(key.fileobj)
            if events & selectors.EVENT_READ:
                found += self.channel.receive(key.fileobj)
        return found

    def _ready(self, handle: object, events: int) -> None:
        raise AssertionError('the channel calls nothing itself')

    def receive_bytes(self, size: int) -> bytes:
        """Wait for ``size`` bytes from any peer, and return them."""
        data = b''
        while len(data) < size:
            data += b''.join(piece for _, piece in self.receive())
        return data

    def broadcast(self, *frames: bytes, now: float = 0.0) -> None:
        """Send frames to all peers."""
        self.channel.send(frames, self.channel.peers(now))

    def close(self) -> None:
        """Close it."""
        self.channel.close()
        self.selector.close()


Open = Callable[[str | Url], OpenChannel]


def bound_socket(
    host: str = '127.0.0.1', kind: socket.SocketKind = socket.SOCK_DGRAM, port: int = 0,
) -> socket.socket:
    """
    Return a socket whose calls block for a limited time.

    :param port: 0 for a port that is reserved for these tests: peers of an earlier test may still
        send to a port of the system's choice.
    """
    host = host.strip('[]')
    one = socket.socket(socket.AF_INET6 if ':' in host else socket.AF_INET, kind)
    one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, int(kind == socket.SOCK_STREAM))
    one.settimeout(PATIENCE)
    one.bind((host, port or free_port(kind, host)))
    return one


def listening_socket(host: str = '127.0.0.1', port: int = 0) -> socket.socket:
    """Return a TCP socket that listens; the parameters are those of :func:`bound_socket`."""
    one = bound_socket(host, socket.SOCK_STREAM, port)
    one.listen()
    return one


def has_nothing(one: socket.socket) -> bool:
    """Return whether nothing has arrived at a socket by now."""
    one.setblocking(False)
    try:
        one.recv(65536)
    except BlockingIOError:
        return True
    finally:
        one.settimeout(PATIENCE)
    return False
