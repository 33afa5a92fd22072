# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Messages of an autopilot, and lines that send them at a given rate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import contextlib
import functools
import os
from pathlib import Path
import random
import socket
import time
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega
from support.ports import free_port

# Frames that are prepared: a multiple of 256, so that repeating them continues the sequence.
PREPARED = 1024
# In the proportions in which ArduPilot streams them: mostly attitude and position.
COMMON = ('ATTITUDE',) * 5 + ('GLOBAL_POSITION_INT',) * 5 + ('VFR_HUD',) * 3 + (
    'RAW_IMU', 'RAW_IMU', 'SYS_STATUS', 'GPS_RAW_INT', 'GPS_RAW_INT', 'RC_CHANNELS',
    'RC_CHANNELS', 'SERVO_OUTPUT_RAW', 'SERVO_OUTPUT_RAW', 'SCALED_PRESSURE',
    'LOCAL_POSITION_NED', 'BATTERY_STATUS', 'VIBRATION', 'NAV_CONTROLLER_OUTPUT', 'SYSTEM_TIME')
# Of so many frames one is a heartbeat, which ArduPilot sends once a second.
HEARTBEAT_EVERY = 512
# Messages of ArduPilot's own dialect, which other software does not have.
ARDUPILOT = ('AHRS', 'EKF_STATUS_REPORT')
# Bytes that wait in a UDP socket while it is kept busy: 768 for a small datagram, as the kernel
# counts. This is more than the 128 datagrams that the bridge collects, so that it need not wait
# for them, and less than the 208 KiB that any system grants.
FULL = 150_000
CHUNK = 32
BAUD = 921_600


def frames(names: Sequence[str] = (*COMMON, *ARDUPILOT), count: int = PREPARED) -> list[bytes]:
    """Return frames of an autopilot, 1/1, with values as in flight and always the same."""
    draw = random.Random('autopilot')
    sender = ardupilotmega.MAVLink(None, srcSystem=1, srcComponent=1)
    order = [names[number % len(names)] for number in range(count)]
    draw.shuffle(order)
    order[::HEARTBEAT_EVERY] = ['HEARTBEAT'] * len(order[::HEARTBEAT_EVERY])
    made = []
    for number, name in enumerate(order):
        sender.seq = number & 0xFF
        made.append(bytes(_message(name, draw).pack(sender)))
    return made


def _message(name: str, draw: random.Random) -> Any:
    kind = getattr(ardupilotmega, f'MAVLink_{name.lower()}_message')
    if name == 'HEARTBEAT':
        return kind(2, 3, 81, 4, 4, 3)

    def value(type_: str) -> float:
        if type_ in ('float', 'double'):
            return draw.uniform(-100, 100)
        return draw.randrange(1 << (min(int(''.join(filter(str.isdigit, type_))), 32) - 1))

    # Lengths are in wire order, types in the order of the definition.
    lengths = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
    return kind(*([value(type_) for _ in range(lengths[field])] if lengths[field] else value(type_)
                  for field, type_ in zip(kind.fieldnames, kind.fieldtypes, strict=True)))


class Line:
    """
    A way to one receiver, which must be ready before frames are fed.

    :ivar port: of UDP or TCP.
    :ivar urls: the connection URL of the bridge, that of pymavlink, the arguments of
        ``peers/bare_receiver.py``.
    """

    def __init__(self, transport: str) -> None:
        self._sent = 0
        self.port = free_port(socket.SOCK_STREAM)
        at = f'127.0.0.1:{self.port}'
        self._stack = contextlib.ExitStack()
        self._send: Callable[[Sequence[bytes]], None]
        self.urls: tuple[str, str, tuple[object, ...]]
        if transport == 'UDP':
            self._socket = self._stack.enter_context(socket.socket(type=socket.SOCK_DGRAM))
            self._socket.connect(('127.0.0.1', self.port))
            self.urls = f'udpin://{at}', f'udpin:{at}', ('udp', self.port)
            self._send = self._send_datagrams
        elif transport == 'TCP':
            self._socket = self._stack.enter_context(
                socket.create_server(('127.0.0.1', self.port)))
            self.urls = f'tcpout://{at}', f'tcp:{at}', ('tcp', self.port)
            self._send = self._send_stream
        else:
            far, near = os.openpty()
            self._stack.callback(os.close, near)
            self._stack.callback(os.close, far)
            path = os.ttyname(near)
            self.urls = f'serial://{path}:{BAUD}', f'{path},{BAUD}', ('serial', path)
            self._send = functools.partial(_write, far)
        self._is_udp = transport == 'UDP'

    def __enter__(self) -> Line:
        return self

    def __exit__(self, *error: object) -> None:
        self._stack.close()

    def _send_stream(self, part: Sequence[bytes]) -> None:
        if self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ACCEPTCONN):
            self._socket.settimeout(20.0)
            self._socket = self._stack.enter_context(self._socket.accept()[0])
        # TCP itself limits the rate.
        self._socket.sendall(b''.join(part))

    def _send_datagrams(self, part: Sequence[bytes]) -> None:
        for frame in part:
            with contextlib.suppress(ConnectionError):
                self._socket.send(frame)

    def next_of(self, prepared: Sequence[bytes]) -> bytes:
        """Return the frame that is sent next."""
        return prepared[self._sent % len(prepared)]

    def feed(self, prepared: Sequence[bytes], rate: float, count: int) -> None:
        """
        Send frames.

        :param rate: frames per second; 0 = as many as the receiver takes without loss.
        """
        began, done = time.monotonic(), 0
        while done < count:
            if rate:
                time.sleep(max(began + done / rate - time.monotonic(), 0.001))
                due = min(int((time.monotonic() - began) * rate) + 1, count)
            else:
                due = min(done + CHUNK, count)
                while self._is_udp and _queued(self.port) > FULL:
                    time.sleep(0.0002)
            at = self._sent % len(prepared)
            part = prepared[at:at + due - done]
            self._send(part)
            done += len(part)
            self._sent += len(part)


def _queued(port: int) -> int:
    """Return the bytes that wait in the socket of a UDP port."""
    for line in Path('/proc/net/udp').read_text().splitlines()[1:]:
        fields = line.split()
        if fields[1].endswith(f':{port:04X}'):
            return int(fields[4].partition(':')[2], 16)
    raise RuntimeError(f'UDP port {port} is not bound')


def _write(descriptor: int, part: Sequence[bytes]) -> None:
    data = b''.join(part)
    while data:
        data = data[os.write(descriptor, data):]
