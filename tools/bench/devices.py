# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Components behind a UDP socket, which sends and receives without a thread of its own."""

from __future__ import annotations

import contextlib
import socket
import time
from typing import Any, TypeVar

from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import decode, mavlink
from support.frames import Codec

S = TypeVar('S', bound='Side')


class Side:
    """
    A UDP socket with MAVLink messages of one or more components, to a port of loopback.

    :ivar received: bytes.
    """

    def __init__(self, port: int, mav_type: int, *addresses: mav.Address) -> None:
        self.socket = socket.socket(type=socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        self.socket.connect(('127.0.0.1', port))
        self.received = 0
        self._codec = Codec()
        self._mav_type, self._addresses = mav_type, addresses
        self._beat_due = 0.0

    def __enter__(self: S) -> S:
        return self

    def __exit__(self, *error: object) -> None:
        self.socket.close()

    def frame(self, message: mav.Message, source: mav.Address | None = None) -> bytes:
        """Return a message as a frame, by default of the first component."""
        return self._codec.frame(source or self._addresses[0], message)

    def send(self, message: mav.Message, source: mav.Address | None = None) -> float:
        """Send a message; return when that was, s."""
        frame, now = self.frame(message, source), time.monotonic()
        with contextlib.suppress(ConnectionError):
            self.socket.send(frame)
        return now

    def beat(self) -> bool:
        """Send the heartbeats if they are due; return whether they were."""
        if time.monotonic() < self._beat_due:
            return False
        self._beat_due = time.monotonic() + 0.5
        for address in self._addresses:
            self.send(mav.heartbeat(self._mav_type), address)
        return True

    def receive(self, timeout: float) -> list[Any]:
        """Return the messages of the next datagram, none after the time, s."""
        self.socket.settimeout(max(timeout, 1e-4))
        try:
            data = self.socket.recv(65536)
        except (TimeoutError, ConnectionError):
            return []
        self.received += len(data)
        return [decode(mavlink.mavlink_map[frame.message_id], frame.payload)
                for frame in self._codec.decoder.feed(data)
                if frame.message_id in mavlink.mavlink_map]

    def drain(self) -> None:
        """Drop the datagrams that have arrived."""
        while self.receive(0.0):
            pass
