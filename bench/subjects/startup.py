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
From the start of the process to its service answering, and to the first status published.

Against the same of an empty node. The light is there before, with a status a second, so up to
that second is chance.
"""

from __future__ import annotations

from collections.abc import Iterator
import subprocess
import sys
import threading
import time

from std_msgs.msg import Float64

from .status import STATE
from ..rig import (
    Bench,
    Client,
    free_port,
    interleaved,
    PATIENCE,
    PEERS,
    Program,
    python,
    ROOT,
    running,
    simulator,
)
from ..rows import middle, quantiles, Row, Target

OURS, EMPTY = 'bridge', 'empty node'
STATUS_PERIOD = 1.0
RATIO = 1.3


def measure(bench: Bench) -> Iterator[Row]:
    """Start each again and again, in alternate order."""
    port = free_port()
    service: dict[str, list[float]] = {OURS: [], EMPTY: []}
    status: list[float] = []
    with simulator(f'udpout://127.0.0.1:{port}', '--status-interval', str(STATUS_PERIOD)):
        for number, name in enumerate(interleaved([OURS, EMPTY], bench.amount(8, 1))):
            # Each start has its own names, so that no earlier process answers.
            answering, publishing = start(bench, name, f'started_{number}', port)
            service[name].append(answering * 1e3)
            if name == OURS:
                status.append(publishing * 1e3)
    found = {name: quantiles(values) for name, values in service.items()}
    limit = RATIO * found[EMPTY]['p50'] + STATUS_PERIOD * 1e3
    text = f'p50 at most {RATIO:g} times the peer + {STATUS_PERIOD:g} s'
    note = f'{len(status)} starts of each'
    yield Row('start of the process to ~/enable answering', 'ms', found[OURS],
              {EMPTY: found[EMPTY]}, [Target(text, found[OURS]['p50'], limit)], note,
              {'bridge': service[OURS], 'empty node': service[EMPTY]})
    first = quantiles(status)
    yield Row('start of the process to the first status published', 'ms', first,
              {'empty node, its service': found[EMPTY]},
              [Target(text, first['p50'], limit)], note)
    yield imports(bench)


def start(bench: Bench, name: str, node: str, port: int) -> tuple[float, float]:
    """Return the s from a start until the service answers, and until a status is published."""
    published: list[float] = []
    first = threading.Event()

    def came(message: Float64) -> None:
        published.append(time.monotonic())
        first.set()

    with Client(bench.domain) as client:
        client.client(f'/{node}/enable')
        client.subscribe(Float64, f'/{node}/uptime', came, STATE)
        began = time.monotonic()
        program = (
            python('illuminator_ros.bridge', '--ros-args', '-r', f'__node:={node}',
                   '-p', f'connection_url:=udpin://127.0.0.1:{port}') if name == OURS
            else Program(sys.executable, str(PEERS / 'empty_server.py'), node))
        with running(program):
            client.meet(f'/{node}/enable', success=False)
            answering = time.monotonic() - began
            if name == EMPTY:
                return answering, 0.0
            if not first.wait(PATIENCE):
                raise RuntimeError(f'no status was published:\n{program.log}')
            return answering, published[0] - began


def imports(bench: Bench) -> Row:
    """Compare what is imported, in ms as Python itself tells it."""
    modules = {
        OURS: 'import illuminator_ros.ros.bridge, illuminator_ros.bridge',
        EMPTY: 'import rclpy, rclpy.executors, std_srvs.srv',
    }
    took: dict[str, list[float]] = {name: [] for name in modules}
    for name in interleaved(list(modules), bench.amount(5, 1)):
        result = subprocess.run(
            [sys.executable, '-X', 'importtime', '-c', modules[name]], cwd=ROOT, text=True,
            capture_output=True, check=True)
        lines = [line.split(':')[1] for line in result.stderr.splitlines()
                 if line.startswith('import time:') and '[us]' not in line]
        took[name].append(sum(int(line.split('|')[0]) for line in lines) / 1e3)
    return Row('imports, by -X importtime', 'ms', middle(took[OURS]),
               {EMPTY: middle(took[EMPTY])}, note='part of the two above')
