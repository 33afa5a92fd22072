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
The time from an ILLUMINATOR_STATUS on the wire to a subscriber.

The peers are a bare publisher and subscriber: from before the call of ``publish`` to the
subscriber. All times are of CLOCK_MONOTONIC, which the processes of a machine share. A status
makes seven messages, ``~/enabled`` first and ``~/uptime`` last. Each has a subscriber of its own,
as in the peer: the first message occupies a shared subscriber until after the last one arrives.
"""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import socket
import time

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Bool, Float64

from ..light import MinimalLight
from ..rig import Bench, bridge, Client, free_port, interleaved, PATIENCE, peer
from ..rows import quantiles, Row, times

STATE = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE,
                   durability=DurabilityPolicy.TRANSIENT_LOCAL)
OURS, BARE, RELAY = 'bridge', 'bare publisher', 'bare relay'
CALLED = OURS, BARE, RELAY
# s between two statuses; longer than the path of one, so that a message is of the newest status.
INTERVAL = 0.008
BLOCK = 50


def measure(bench: Bench) -> Iterator[Row]:
    """Measure the first and the last topic."""
    yield over(bench, 'enabled', Bool, ', the first of seven topics', 1.3)
    yield over(bench, 'uptime', Float64, ', the last of seven topics', 1.6)


def over(bench: Bench, topic: str, type_: type[object], place: str, limit: float) -> Row:
    """Measure bridge and peer in blocks, in alternate order."""
    port, control_port = free_port(), free_port()
    took: dict[str, list[float]] = {name: [] for name in CALLED}
    with contextlib.ExitStack() as stack:
        stack.enter_context(bridge(f'udpin://127.0.0.1:{port}'))
        stack.enter_context(peer('publisher', str(control_port)))
        client = stack.enter_context(Client(bench.domain))
        sender = stack.enter_context(contextlib.closing(MinimalLight(port)))
        control = stack.enter_context(socket.socket(type=socket.SOCK_DGRAM))
        control.connect(('127.0.0.1', control_port))
        now = OURS
        counts = dict.fromkeys(CALLED, 0)

        def came(message: object) -> None:
            at = time.monotonic()
            counts[OURS] += 1
            took[OURS].append((at - next(reversed(sender.sent.values()))) * 1e3)

        def came_bare(message: Float64) -> None:
            at = time.monotonic()
            counts[now] += 1
            took[now].append((at - message.data) * 1e3)

        def wait(name: str, count: int) -> None:
            until = time.monotonic() + 0.5
            while counts[name] < count and time.monotonic() < until:
                time.sleep(INTERVAL)

        def block(name: str, size: int) -> None:
            nonlocal now
            now, before = name, counts[name]
            if name == OURS:
                sender.stream(size * INTERVAL - INTERVAL / 2, INTERVAL)
            elif name == BARE:
                control.send(f'publish {size} {INTERVAL}'.encode())
                time.sleep(size * INTERVAL)
            else:
                for _ in range(size):
                    control.send(f'relay {time.monotonic()!r}'.encode())
                    time.sleep(INTERVAL)
            wait(name, before + size)

        client.subscribe(type_, f'/illuminator/{topic}', came, STATE)
        client.subscribe(Float64, '/publisher/time', came_bare, STATE)
        until = time.monotonic() + PATIENCE
        while not all(counts[name] >= bench.amount(100, 2) for name in CALLED):
            for name in CALLED:
                block(name, 10)
            if time.monotonic() > until:
                raise RuntimeError(f'not all is published: {counts}')
        for values in took.values():
            values.clear()
        size = bench.amount(BLOCK, 5)
        rounds = bench.amount(8, 1)
        for name in interleaved(list(CALLED), rounds):
            block(name, size)
    found = {name: quantiles(values) for name, values in took.items()}
    lost = {name: size * rounds - len(values) for name, values in took.items()}
    return Row(
        f'status on the wire to a subscriber of ~/{topic}{place}', 'ms', found[OURS],
        {'bare publisher and subscriber': found[BARE],
         'a datagram in, a message out': found[RELAY]},
        [times(found[OURS], found[BARE], limit, 'p50')],
        f'{size * rounds} of each; lost: {lost[OURS]} and {lost[BARE]}')
