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

"""1, 10 and more lights, a node for each in one process, as other processes see them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import time

from ..rig import Bench, bridge, Client, cpu, free_port, memory, PATIENCE, simulator
from ..rows import at_most, Figures, one, quantile, quantiles, Row, times

CALLS = 150
# Participants that discover the nodes, one after the other. Half of them miss the first
# announcement of the bridge, and the row judges the longest discovery.
PARTICIPANTS = 5
MEASURED = 3.0
# Limits for 100 lights and fewer: MB, threads, s.
MEMORY, THREADS, DISCOVERY = 160.0, 20, 3.0


def seen(client: Client, names: list[str]) -> float:
    """Return the time until a participant has discovered the services of all nodes, s."""
    began = time.monotonic()
    clients = [client.client(f'/{name}/enable') for name in names]
    while not all(one.service_is_ready() for one in clients):
        if time.monotonic() > began + PATIENCE:
            raise RuntimeError('not all nodes are discovered')
        time.sleep(0.02)
    return time.monotonic() - began


def measure(bench: Bench) -> Iterator[Row]:
    """Start a bridge for each number of lights."""
    alone: Figures = {}
    for count in bench.amount(bench.lights, (2,)):
        port = free_port()
        names = ['illuminator', *(f'illuminator_2_{n}' for n in range(2, count + 1))]
        arguments = ('--count', str(count), '--system-id', '2', '--component-id', '1')
        with (simulator(f'udpout://127.0.0.1:{port}', *arguments),
              bridge(f'udpin://127.0.0.1:{port}', target_component=1) as program):
            with Client(bench.domain) as first:
                seen(first, names)
            discoveries = []
            for _ in range(bench.amount(PARTICIPANTS, 1)):
                with Client(bench.domain) as participant:
                    discoveries.append(seen(participant, names))
            with Client(bench.domain) as client:
                client.meet('/illuminator/enable')
                time.sleep(bench.amount(2.0, 0.0))
                before = cpu(program.pid)
                time.sleep(bench.amount(MEASURED, 0.1))
                share = 100 * (cpu(program.pid) - before) / bench.amount(MEASURED, 0.1)
                calls = quantiles([client.call('/illuminator/enable', bool(number % 2))[0] * 1e3
                                   for number in range(bench.amount(CALLS, 3))])
            taken = memory(program.pid)['Rss']
            threads = len(list(Path(f'/proc/{program.pid}/task').iterdir()))
        alone = alone or calls
        kind = f'nodes in one process: {count}'
        yield Row(f'CPU, {kind}', '%', one(share), note='each light at 1 Hz')
        yield Row(f'memory, {kind}', 'MB', one(taken), targets=[at_most(taken, MEMORY, 'MB')])
        yield Row(f'threads, {kind}', '', one(threads),
                  targets=[at_most(threads, THREADS, 'threads')])
        yield Row(f'~/enable of the first, {kind}', 'ms', calls, {'the smallest number': alone},
                  [times(calls, alone, 1.2, 'p50')] if calls is not alone else [])
        yield Row(f'discovery of all by a new participant, {kind}', 's',
                  {'p50': quantile(discoveries, 0.5), 'max': max(discoveries)},
                  targets=[at_most(max(discoveries), DISCOVERY, 's')],
                  note=f'{len(discoveries)} participants, one after the other')
