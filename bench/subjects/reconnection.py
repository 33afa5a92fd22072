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

"""
The time that the link needs to recover after the return of the other side.

It runs from that return (a TCP server listens, a serial device exists, a UDP light sends from
another port) to the first frame of the bridge that arrives there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
import socket
import tempfile
import time

from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import heartbeat
from support.frames import frame_of
from support.ptys import PtyDevice

from ..rig import Bench, bridge, free_port, PATIENCE
from ..rows import at_most, quantile, Row

LIMIT_MS = 1000.0
# s for which the other side is absent; the pauses between attempts grow with it.
ABSENCES = (0.2, 1.0, 4.0)
# s for which the other side is present; longer than the time that proves a connection.
LASTING = 1.2
HELLO = frame_of(heartbeat(mavlink.MAV_TYPE_ILLUMINATOR), 0)


def tcp(absences: tuple[float, ...], lasting: float) -> list[float]:
    """Restart a TCP server."""
    took = []
    server = socket.create_server(('127.0.0.1', 0))
    port: int = server.getsockname()[1]
    with bridge(f'tcpout://127.0.0.1:{port}'):
        for absence in absences:
            connection, _ = server.accept()
            connection.recv(4096)
            time.sleep(lasting)
            server.close()
            connection.close()
            time.sleep(absence)
            server = socket.create_server(('127.0.0.1', port))
            began = time.monotonic()
            server.settimeout(PATIENCE)
            took.append(_tcp_return(server, began))
    server.close()
    return took


def _tcp_return(server: socket.socket, began: float) -> float:
    connection, _ = server.accept()
    with connection:
        connection.recv(4096)
        return time.monotonic() - began


def serial(absences: tuple[float, ...], lasting: float) -> list[float]:
    """Pull a serial device out, and plug it in again."""
    took = []
    with tempfile.TemporaryDirectory() as directory:
        device = PtyDevice(Path(directory))
        with bridge(f'serial://{device.path}:57600'):
            for absence in absences:
                device.read(PATIENCE)
                time.sleep(lasting)
                device.pull_out()
                time.sleep(absence)
                device.plug_in()
                began = time.monotonic()
                while not device.read(0.001):
                    if time.monotonic() > began + PATIENCE:
                        raise RuntimeError('the serial port is not opened again')
                took.append(time.monotonic() - began)
        device.pull_out()
    return took


def udp(absences: tuple[float, ...], lasting: float) -> list[float]:
    """Move a UDP light to another port."""
    took = []
    port = free_port()
    with bridge(f'udpin://127.0.0.1:{port}'):
        for absence in (0.0, *(lasting + absence for absence in absences)):
            time.sleep(absence)
            with socket.socket(type=socket.SOCK_DGRAM) as light:
                light.settimeout(PATIENCE)
                light.connect(('127.0.0.1', port))
                began = time.monotonic()
                light.send(HELLO)
                light.recv(4096)
                took.append(time.monotonic() - began)
    return took[1:]


def measure(bench: Bench) -> Iterator[Row]:
    """Measure all three at once, since they mostly wait."""
    kinds: dict[str, Callable[[tuple[float, ...], float], list[float]]] = {
        'TCP server restarted': tcp, 'serial device plugged in again': serial,
        'UDP light on another port': udp}
    absences, lasting = bench.amount((ABSENCES, LASTING), ((0.1,), 0.1))
    with ThreadPoolExecutor() as pool:
        running = {kind: pool.submit(function, absences, lasting)
                   for kind, function in kinds.items()}
    for kind, future in running.items():
        took = [seconds * 1e3 for seconds in future.result()]
        yield Row(f'link up again, {kind}', 'ms', {'p50': quantile(took, 0.5), 'max': max(took)},
                  targets=[at_most(max(took), LIMIT_MS, 'ms')],
                  note=f'away for {", ".join(map("{:g}".format, absences))} s')
