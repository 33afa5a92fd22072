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

"""A light in the benchmark's own process, which sends when it is told to."""

from __future__ import annotations

import contextlib
import socket
import time
from typing import Any

from illuminator_ros.mavlink.frame import Decoder, encode_frame
from illuminator_ros.mavlink.messages import (
    Address,
    CommandAck,
    CommandLong,
    encode_payload,
    heartbeat,
    IlluminatorStatus,
    LAYOUTS,
    MavResult,
    MavType,
)

SOURCE = Address(1, 243)


class Sender:
    """
    Sends statuses and heartbeats to a UDP port of loopback, and denies whatever it is asked.

    :ivar sent: CLOCK_MONOTONIC just before each status was sent, s, by its uptime (ms).
    """

    def __init__(self, port: int) -> None:
        self._socket = socket.socket(type=socket.SOCK_DGRAM)
        self._socket.connect(('127.0.0.1', port))
        self._socket.setblocking(False)
        self._decoder = Decoder()
        self._sequence = 0
        self._began = time.monotonic() - 100.0
        self._heartbeat_due = 0.0
        self.sent: dict[int, float] = {}

    def close(self) -> None:
        """Send no more."""
        self._socket.close()

    def status(self) -> None:
        """Send a status with a new uptime, and a heartbeat if it is due."""
        now = time.monotonic()
        uptime = int((now - self._began) * 1000)
        if now >= self._heartbeat_due:
            self._heartbeat_due = now + 1.0
            self._send(heartbeat(MavType.ILLUMINATOR))
            self._answer()
        frame = self._frame(IlluminatorStatus(
            uptime, 1, 3, 0, 1, 50.0, 0.0, 0.0, 25.0, 0.05, 10.0))
        self.sent[uptime] = time.monotonic()
        with contextlib.suppress(ConnectionError):
            self._socket.send(frame)

    def stream(self, seconds: float, interval: float) -> None:
        """Send statuses for a time."""
        began = due = time.monotonic()
        while due < began + seconds:
            self.status()
            due += interval
            time.sleep(max(due - time.monotonic(), 0.0))

    def _answer(self) -> None:
        """Deny: who is not answered asks again, and that would be measured too."""
        with contextlib.suppress(BlockingIOError, ConnectionError):
            while True:
                for frame in self._decoder.feed(self._socket.recv(65536)):
                    if frame.message_id == CommandLong.id:
                        command = frame.payload[28] | frame.payload[29] << 8
                        self._send(CommandAck(command, MavResult.UNSUPPORTED))

    def _frame(self, message: Any) -> bytes:
        self._sequence = (self._sequence + 1) & 0xFF
        return encode_frame(
            message.id, encode_payload(message), sequence=self._sequence, source=SOURCE,
            crc_extra=LAYOUTS[message.id].crc_extra)

    def _send(self, message: Any) -> None:
        with contextlib.suppress(ConnectionError):
            self._socket.send(self._frame(message))
