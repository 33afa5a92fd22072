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

"""A minimal light over UDP: it applies ON_OFF, acknowledges it and sends statuses."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import select
import socket
import struct
import threading
import time

from illuminator_ros.illuminator.messages import IlluminatorStatus
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.frame import Decoder
from support.frames import frame_of

LIGHT = mav.Address(1, 243)
COMMAND_LONG = struct.Struct('<7fHBBB')


class MinimalLight:
    """
    Sends to a UDP port of the loopback interface.

    :ivar silent: the commands that it does not acknowledge.
    :ivar asked: set when such a command has arrived.
    :ivar received: bytes.
    :ivar sent: CLOCK_MONOTONIC just before each status was sent, s, by its uptime, ms.
    """

    def __init__(self, port: int, address: mav.Address = LIGHT) -> None:
        self.silent: set[int] = set()
        self.asked = threading.Event()
        self.received = 0
        self.sent: dict[int, float] = {}
        self._address = address
        self._socket = socket.socket(type=socket.SOCK_DGRAM)
        self._socket.connect(('127.0.0.1', port))
        self._socket.setblocking(False)
        self._decoder = Decoder()
        self._sequence = 0
        self._began = time.monotonic() - 100.0
        self._heartbeat_due = 0.0
        self._on = 0

    def close(self) -> None:
        """Stop sending."""
        self._socket.close()

    def status(self) -> None:
        """Send a status, with an uptime of its own, and a heartbeat if one is due."""
        now = time.monotonic()
        uptime = int((now - self._began) * 1000)
        if now >= self._heartbeat_due:
            self._heartbeat_due = now + 1.0
            self._send(mav.heartbeat(mavlink.MAV_TYPE_ILLUMINATOR))
            self._answer()
        frame = self._frame(IlluminatorStatus(
            uptime, self._on, 3, 0, 1, 50.0, 0.0, 0.0, 25.0, 0.05, 10.0))
        self.sent[uptime] = time.monotonic()
        with contextlib.suppress(ConnectionError):
            self._socket.send(frame)

    def stream(self, seconds: float, interval: float) -> None:
        """Send statuses for some time."""
        began = due = time.monotonic()
        while due < began + seconds:
            self.status()
            due += interval
            time.sleep(max(due - time.monotonic(), 0.0))

    def serve(self, ended: threading.Event) -> None:
        """Answer each command at once, and send a status once a second."""
        while not ended.is_set():
            if select.select([self._socket], [], [], 0.2)[0]:
                self._answer()
            if time.monotonic() >= self._heartbeat_due:
                self.status()

    def _answer(self) -> None:
        with contextlib.suppress(BlockingIOError, ConnectionError):
            while True:
                data = self._socket.recv(65536)
                self.received += len(data)
                for frame in self._decoder.feed(data):
                    if frame.message_id == mav.CommandLong.id:
                        self._command(bytes(frame.payload))

    def _command(self, payload: bytes) -> None:
        values = COMMAND_LONG.unpack(payload.ljust(COMMAND_LONG.size, b'\0'))
        command = int(values[7])
        if command in self.silent:
            self.asked.set()
            return
        if command == mavlink.MAV_CMD_ILLUMINATOR_ON_OFF:
            self._on = int(values[0])
        elif (command, values[0]) != (mavlink.MAV_CMD_REQUEST_MESSAGE, IlluminatorStatus.id):
            self._send(mav.CommandAck(command, mavlink.MAV_RESULT_UNSUPPORTED))
            return
        self._send(mav.CommandAck(command, mavlink.MAV_RESULT_ACCEPTED))
        self.status()

    def _send(self, message: mav.Message) -> None:
        with contextlib.suppress(ConnectionError):
            self._socket.send(self._frame(message))

    def _frame(self, message: mav.Message) -> bytes:
        self._sequence = (self._sequence + 1) & 0xFF
        return frame_of(message, self._sequence, self._address)


@contextlib.contextmanager
def serving(port: int, address: mav.Address = LIGHT) -> Iterator[MinimalLight]:
    """Serve a light in a thread of this process."""
    light, ended = MinimalLight(port, address), threading.Event()
    thread = threading.Thread(target=light.serve, args=(ended,))
    thread.start()
    try:
        yield light
    finally:
        ended.set()
        thread.join()
        light.close()
