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
``~/enable`` of a simulated light over UDP, acknowledged and verified by a status.

Against an empty SetBool server, and the straightforward script, which verifies nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
import contextlib

from ..rig import Bench, bridge, Client, free_port, peer, simulator
from ..rows import quantiles, Row, times

OURS, EMPTY, SCRIPT = '/illuminator/enable', '/empty/enable', '/straightforward/enable'
WARM_UP = 50


def measure(bench: Bench) -> Iterator[Row]:
    """Call one after the other, in turn."""
    took: dict[str, list[float]] = {name: [] for name in (OURS, EMPTY, SCRIPT)}
    ports = free_port(), free_port()
    with contextlib.ExitStack() as stack:
        for port in ports:
            stack.enter_context(simulator(f'udpout://127.0.0.1:{port}'))
        stack.enter_context(bridge(f'udpin://127.0.0.1:{ports[0]}'))
        stack.enter_context(peer('straightforward', f'udpin:127.0.0.1:{ports[1]}'))
        stack.enter_context(peer('empty_server'))
        client = stack.enter_context(Client(bench.domain))
        for name in took:
            client.meet(name)
            for _ in range(bench.amount(WARM_UP, 2)):
                client.call(name, False)
        names = list(took)
        for number in range(bench.amount(1500, 4)):
            # Never the same one twice in a row: it may still have to clear up after its answer.
            first = number % len(names)
            for name in names[first:] + names[:first]:
                seconds, answer = client.call(name, number % 2 == 0)
                if answer is None or not answer.success:
                    raise RuntimeError(f'{name}: {answer}')
                took[name].append(seconds * 1e3)
    found = {name: quantiles(values) for name, values in took.items()}
    yield Row(
        '~/enable over UDP, verified', 'ms', found[OURS],
        {'empty SetBool server': found[EMPTY], 'straightforward script': found[SCRIPT]},
        [times(found[OURS], found[EMPTY], 1.6, 'p50'),
         times(found[OURS], found[EMPTY], 2.0, 'p99')],
        f'{len(took[OURS])} calls of each; the script does not verify',
        {'bridge, verified': took[OURS], 'empty SetBool server': took[EMPTY],
         'straightforward script': took[SCRIPT]})
