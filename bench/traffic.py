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

"""Messages of an autopilot, and lines that send them at a given rate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import contextlib
import os
import random
import socket
import time
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega

from .rig import udp_queue

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
    values: list[Any] = []
    # Lengths are in wire order, types in the order of the definition.
    lengths = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
    for field, type_ in zip(kind.fieldnames, kind.fieldtypes, strict=True):
        length = lengths[field]

        def value(type_: str = type_) -> Any:
            if type_ in ('float', 'double'):
                return draw.uniform(-100, 100)
            bits = int(''.join(filter(str.isdigit, type_)))
            return draw.randrange(1 << (min(bits, 32) - 1))
        values.append([value() for _ in range(length)] if length else value())
    return kind(*values)


class Line:
    """A way to one receiver."""

    def __init__(self, send: Callable[[Sequence[bytes]], None], busy: Callable[[], bool],
                 close: Callable[[], None]) -> None:
        self._send, self._busy, self.close = send, busy, close
        self.sent = 0

    def feed(self, prepared: Sequence[bytes], rate: float, count: int) -> float:
        """
        Send frames; return the s that it took.

        :param rate: frames per second; 0 = as many as the receiver takes without loss.
        """
        began = time.monotonic()
        done = 0
        while done < count:
            if rate:
                due = min(int((time.monotonic() - began) * rate) + 1, count)
            else:
                due = min(done + CHUNK, count)
                while self._busy():
                    time.sleep(0.0002)
            if due > done:
                at = self.sent % len(prepared)
                part = prepared[at:at + due - done]
                self._send(part)
                done += len(part)
                self.sent += len(part)
            if rate:
                time.sleep(max(began + done / rate - time.monotonic(), 0.001))
        return time.monotonic() - began


def udp_line(port: int) -> Line:
    """Return a line to a UDP port, a datagram for each frame."""
    sender = socket.socket(type=socket.SOCK_DGRAM)
    sender.connect(('127.0.0.1', port))

    def send(part: Sequence[bytes]) -> None:
        for frame in part:
            with contextlib.suppress(ConnectionError):
                sender.send(frame)

    return Line(send, lambda: udp_queue(port)[0] > FULL, sender.close)


class TcpListener:
    """Accepts the connections of the receivers."""

    def __init__(self) -> None:
        self._listener = socket.create_server(('127.0.0.1', 0))
        self.port: int = self._listener.getsockname()[1]

    def line(self) -> Line:
        """Return a line to the next client."""
        self._listener.settimeout(20.0)
        connection, _ = self._listener.accept()
        self._listener.close()
        connection.settimeout(20.0)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        # TCP itself limits the rate.
        return Line(lambda part: connection.sendall(b''.join(part)), lambda: False,
                    connection.close)


class SerialPort:
    """A pseudo-terminal without a speed limit."""

    def __init__(self) -> None:
        self._far, self._near = os.openpty()
        self.path = os.ttyname(self._near)

    def line(self) -> Line:
        """Return a line to the program that has opened it."""
        os.close(self._near)

        def send(part: Sequence[bytes]) -> None:
            data = b''.join(part)
            while data:
                data = data[os.write(self._far, data):]

        return Line(send, lambda: False, lambda: os.close(self._far))
