# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Devices and players on a UDP port, a minimal light, and the end of a serial line."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
import contextlib
import os
import select
import socket
import sys
import threading
import time
import tty
from typing import Any, TypeVar

from illuminator_ros.illuminator.messages import IlluminatorStatus
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import decode, mavlink
from support.frames import Codec

LIGHT = mav.Address(1, 243)
# The component id of the first of more lights than there are ids from that one on.
FIRST_OF_MANY = 201
S = TypeVar('S', bound='Side')
E = TypeVar('E', bound='SerialEnd')


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


class MinimalLight(Side):
    """
    A light that applies ON_OFF, acknowledges it and sends statuses.

    :ivar silent: the commands that it does not acknowledge.
    :ivar asked: set when such a command has arrived.
    """

    def __init__(self, port: int, address: mav.Address = LIGHT) -> None:
        super().__init__(port, mavlink.MAV_TYPE_ILLUMINATOR, address)
        self.silent: set[int] = set()
        self.asked = threading.Event()
        self._began = time.monotonic() - 100.0
        self._on = 0

    def status(self) -> float:
        """Send a status; return when that was, s."""
        return self.send(IlluminatorStatus(
            int((time.monotonic() - self._began) * 1000), self._on, 3, 0, 1, 50.0, 0.0, 0.0, 25.0,
            0.05, 10.0))

    def serve(self, ended: threading.Event) -> None:
        """Answer each command at once, and send a status at each other heartbeat."""
        beats = 0
        while not ended.is_set():
            beats += self.beat()
            if beats == 2:
                beats = 0
                self.status()
            self.answer(0.1)

    def answer(self, timeout: float) -> None:
        """Answer the commands of the next datagram, if one comes in this time, s."""
        for message in self.receive(timeout):
            if isinstance(message, mav.CommandLong):
                self._execute(message)

    def _execute(self, command: Any) -> None:
        if command.command in self.silent:
            self.asked.set()
            return
        is_switch = command.command == mavlink.MAV_CMD_ILLUMINATOR_ON_OFF
        is_known = is_switch or (command.command, command.param1) == (
            mavlink.MAV_CMD_REQUEST_MESSAGE, IlluminatorStatus.id)
        self.send(mav.CommandAck(command.command, mavlink.MAV_RESULT_ACCEPTED if is_known
                                 else mavlink.MAV_RESULT_UNSUPPORTED))
        if is_switch:
            self._on = int(command.param1)
        if is_known:
            self.status()


@contextlib.contextmanager
def serving(port: int, count: int = 1) -> Iterator[list[MinimalLight]]:
    """Serve lights, each in a thread of this process."""
    first = LIGHT.component if count <= 12 else FIRST_OF_MANY
    with contextlib.ExitStack() as stack:
        lights = [stack.enter_context(MinimalLight(port, mav.Address(1, first + number)))
                  for number in range(count)]
        ended = threading.Event()
        for light in lights:
            thread = threading.Thread(target=light.serve, args=(ended,))
            thread.start()
            stack.callback(thread.join)
        stack.callback(ended.set)
        yield lights


def _main(port: int, count: int = 1) -> None:
    """Serve lights in a process of their own, which send to a UDP port, until SIGINT."""
    print('ready', flush=True)
    with contextlib.suppress(KeyboardInterrupt):
        if count > 1:
            with serving(port, count):
                threading.Event().wait()
        with MinimalLight(port) as own:
            own.serve(threading.Event())


if __name__ == '__main__':
    _main(*map(int, sys.argv[1:]))


class SerialEnd(ABC):
    """
    The far end of a serial line, which is read in a thread.

    :ivar device: the path of the near end.
    """

    def __init__(self) -> None:
        self.far, self._near = os.openpty()
        tty.setraw(self._near)
        self.device = os.ttyname(self._near)
        self._stopping, self._stop = os.pipe()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self: E) -> E:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        os.write(self._stop, b'\0')
        self._thread.join()
        for descriptor in (self.far, self._near, self._stopping, self._stop):
            os.close(descriptor)

    @abstractmethod
    def take(self, data: bytes) -> None:
        """Take bytes that have arrived."""

    def _run(self) -> None:
        while self._stopping not in select.select([self.far, self._stopping], [], [])[0]:
            self.take(os.read(self.far, 65536))
