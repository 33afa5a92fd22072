# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""An in-process link: each channel hears all others of the same name."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import selectors
import socket
import threading

from .base import Channel, Peer, Serve
from ..url import MemoryUrl

_hub: dict[str, list[_MemoryChannel]] = {}
_lock = threading.Lock()


def open_memory(url: MemoryUrl) -> Channel:
    """Join the in-process link of this name."""
    channel = _MemoryChannel(url.name)
    with _lock:
        _hub.setdefault(url.name, []).append(channel)
    return channel


class _MemoryChannel(Channel):

    def __init__(self, hub_name: str) -> None:
        super().__init__()
        self._hub_name = hub_name
        self._inbox, self._entrance = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._inbox.setblocking(False)
        self._entrance.setblocking(False)
        self.name = f'memory {hub_name}'

    def register(self, selector: selectors.BaseSelector, serve: Serve) -> None:
        selector.register(self._inbox, selectors.EVENT_READ, serve)

    def receive(self, handle: object) -> Iterator[tuple[Peer, bytes]]:
        try:
            while True:
                yield None, self._inbox.recv(65536)
        except BlockingIOError:
            return

    def peers(self, now: float) -> Sequence[Peer]:
        return (None,)

    def send(self, frames: Sequence[bytes], peers: Sequence[Peer]) -> None:
        with _lock:
            for other in _hub.get(self._hub_name, []):
                if other is not self:
                    try:
                        other._entrance.send(b''.join(frames))
                    except BlockingIOError:
                        self.dropped += len(frames)

    def close(self) -> None:
        with _lock:
            others = _hub.get(self._hub_name, [])
            if self in others:
                others.remove(self)
            if not others:
                _hub.pop(self._hub_name, None)
        self._inbox.close()
        self._entrance.close()
