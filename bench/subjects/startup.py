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
The time from the start of the process to the first answer, and to the first published status.

The peer is an empty node. The light runs before the start and sends a status each second, so up to
one second of the latter is chance.
"""

from __future__ import annotations

from collections.abc import Iterator
import sys
import threading
import time

from std_msgs.msg import Float64

from .status import STATE
from .. import rig
from ..rows import quantiles, Row, times

OURS, EMPTY = 'bridge', 'empty node'
STATUS_PERIOD = 1.0
RATIO = 1.2


def measure(bench: rig.Bench) -> Iterator[Row]:
    """Start each program repeatedly, in alternate order."""
    port = rig.free_port()
    service: dict[str, list[float]] = {OURS: [], EMPTY: []}
    status: list[float] = []
    with rig.simulator(f'udpout://127.0.0.1:{port}', '--status-interval', str(STATUS_PERIOD)):
        for number, name in enumerate(rig.interleaved([OURS, EMPTY], bench.amount(16, 1))):
            # Each start has a node name of its own: a name that was discovered before is faster.
            answering, publishing = start(bench, name, f'started_{number}', port)
            service[name].append(answering * 1e3)
            if name == OURS:
                status.append(publishing * 1e3)
    found = {name: quantiles(values) for name, values in service.items()}
    note = f'{len(status)} starts of each'
    yield Row('start of the process to ~/enable answering', 'ms', found[OURS],
              {EMPTY: found[EMPTY]}, [times(found[OURS], found[EMPTY], RATIO, 'p50')], note)
    first = quantiles(status)
    yield Row('start of the process to the first status published', 'ms', first,
              {'empty node, its service': found[EMPTY]}, note=note)


def start(bench: rig.Bench, name: str, node: str, port: int) -> tuple[float, float]:
    """Return the times from a start to an answer and to a published status, s."""
    published: list[float] = []
    first = threading.Event()

    def came(message: Float64) -> None:
        published.append(time.monotonic())
        first.set()

    with rig.Client(bench.domain) as client:
        client.client(f'/{node}/enable')
        client.subscribe(Float64, f'/{node}/uptime', came, STATE)
        began = time.monotonic()
        program = (
            rig.start_interpreter(
                'illuminator_ros.bridge', '--ros-args', '-r', f'__node:={node}', '-p',
                f'connection_url:=udpin://127.0.0.1:{port}') if name == OURS
            else rig.Program(sys.executable, str(rig.PEERS / 'empty_server.py'), node))
        with rig.running(program):
            client.meet(f'/{node}/enable', success=False)
            answering = time.monotonic() - began
            if name == EMPTY:
                return answering, 0.0
            if not first.wait(rig.PATIENCE):
                raise RuntimeError(f'no status was published:\n{program.log}')
            return answering, published[0] - began
