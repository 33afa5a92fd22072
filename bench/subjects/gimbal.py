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
The time from a message on ``~/cmd/rate`` to the datagram.

The peer is a bare subscriber that sends a datagram. The time runs from before the call of
``publish`` to the arrival of the datagram. This process takes all times.
"""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import math
import socket
import struct
import threading
import time

from geometry_msgs.msg import Vector3, Vector3Stamped
from illuminator_ros.gimbal.messages import (
    GimbalManagerInformation,
    GimbalManagerSetAttitude,
    GimbalManagerStatus,
)
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.frame import HEADER_V2
from illuminator_ros.mavlink.messages import Address, Heartbeat
from illuminator_ros.payload.messages import GimbalDeviceAttitudeStatus
from support.frames import frame_of

from ..rig import Bench, bridge, Client, free_port, interleaved, PATIENCE, peer
from ..rows import quantiles, Row, times

MANAGER, BRIDGE = Address(1, 1), Address(1, 194)
OURS, BARE = 'bridge', 'bare subscriber'
TOPICS = {OURS: '/gimbal/cmd/rate', BARE: '/subscriber/cmd/rate'}
# s between two messages; longer than the path of a message takes.
INTERVAL = 0.008
BLOCK = 50
# Offset of the yaw rate in a setpoint of the bridge, and in a datagram of the peer.
RATE_OFFSET = {OURS: HEADER_V2 + 28, BARE: 8}
NAN = math.nan


class Manager:
    """
    A gimbal manager that the bridge controls, and the receiver of all datagrams.

    :ivar arrived: CLOCK_MONOTONIC of each rate, s, by the rate.
    """

    def __init__(self, port: int) -> None:
        self.arrived: dict[float, float] = {}
        self.link = socket.socket(type=socket.SOCK_DGRAM)
        self.link.connect(('127.0.0.1', port))
        self.bare = socket.socket(type=socket.SOCK_DGRAM)
        self.bare.bind(('127.0.0.1', 0))
        self._ended = threading.Event()
        self._threads = [threading.Thread(target=self._send), *(
            threading.Thread(target=self._receive, args=arguments)
            for arguments in ((self.link, OURS), (self.bare, BARE)))]

    def __enter__(self) -> Manager:
        for one in (self.link, self.bare):
            one.settimeout(0.2)
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._ended.set()
        for thread in self._threads:
            thread.join()
        self.link.close()
        self.bare.close()

    def _send(self) -> None:
        sequence = 0
        while not self._ended.wait(0.2):
            for message in (
                    Heartbeat(2, 12, 0, 0, 4, 3),
                    GimbalManagerInformation(0, 0xFFFF, 1, -1, 1, -1, 1, -1, 1),
                    GimbalManagerStatus(0, 12, 1, *BRIDGE, 0, 0),
                    GimbalDeviceAttitudeStatus(
                        0, 0, 0, mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME, (1, 0, 0, 0),
                        NAN, NAN, NAN, 0, NAN, NAN, 1)):
                sequence = (sequence + 1) & 0xFF
                with contextlib.suppress(ConnectionError):
                    self.link.send(frame_of(message, sequence, MANAGER))

    def _receive(self, source: socket.socket, name: str) -> None:
        setpoint = GimbalManagerSetAttitude.id.to_bytes(3, 'little')
        while not self._ended.is_set():
            try:
                data = source.recv(2048)
            except (TimeoutError, ConnectionError):
                continue
            at = time.monotonic()
            if name == BARE or data[7:10] == setpoint:
                [rate] = struct.unpack_from('<f', data, RATE_OFFSET[name])
                self.arrived[abs(rate)] = at


def measure(bench: Bench) -> Iterator[Row]:
    """Publish to both in blocks, in alternate order."""
    port = free_port()
    took: dict[str, list[float]] = {name: [] for name in TOPICS}
    with contextlib.ExitStack() as stack:
        stack.enter_context(bridge(
            f'udpin://127.0.0.1:{port}', 'gimbal', payloads='[gimbal]', setpoint_timeout=60.0))
        manager = stack.enter_context(Manager(port))
        stack.enter_context(peer('subscriber', str(manager.bare.getsockname()[1])))
        client = stack.enter_context(Client(bench.domain))
        publishers = {name: client.node.create_publisher(Vector3Stamped, topic, 10)
                      for name, topic in TOPICS.items()}
        number = 0

        def block(name: str, size: int) -> None:
            nonlocal number
            sent: dict[float, float] = {}
            for _ in range(size):
                number += 1
                # The rates are exact in float32.
                rate = number / 65536
                message = Vector3Stamped(vector=Vector3(z=rate))
                sent[rate] = time.monotonic()
                publishers[name].publish(message)
                time.sleep(INTERVAL)
            time.sleep(0.05)
            took[name] += [(manager.arrived[rate] - at) * 1e3
                           for rate, at in sent.items() if rate in manager.arrived]

        until = time.monotonic() + PATIENCE
        while not all(len(values) >= bench.amount(100, 2) for values in took.values()):
            for name in TOPICS:
                block(name, 10)
            if time.monotonic() > until:
                arrived = {name: len(values) for name, values in took.items()}
                raise RuntimeError(f'not all rates arrive: {arrived}')
        for values in took.values():
            values.clear()
        size, rounds = bench.amount(BLOCK, 5), bench.amount(12, 1)
        for name in interleaved(list(TOPICS), rounds):
            block(name, size)
    found = {name: quantiles(values) for name, values in took.items()}
    lost = {name: size * rounds - len(values) for name, values in took.items()}
    yield Row(
        '~/cmd/rate to the datagram', 'ms', found[OURS],
        {'bare subscriber that sends a datagram': found[BARE]},
        [times(found[OURS], found[BARE], 1.5, 'p50')],
        f'{size * rounds} of each; lost: {lost[OURS]} and {lost[BARE]}')
