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
``~/enable`` over UDP, acknowledged by the light and verified by a status.

The peers are an empty SetBool server, the straightforward script, which verifies nothing, and the
least script that verifies. The light is the simulator. In a second row it is a minimal light,
which answers almost immediately, so that the row shows the bridge's own share.
"""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import random
import threading
import time

from ..rig import Bench, bridge, Client, free_port, peer, simulator
from ..rows import at_most, one, quantiles, Row, times

OURS, EMPTY, SCRIPT = '/illuminator/enable', '/empty/enable', '/straightforward/enable'
MINIMAL, LEAST = '/minimal/enable', '/verifying/enable'
# Seed of the order of the calls. Each server is called after each other one equally often, since
# the program that ran before determines the content of the processor's caches.
SEED = 1
WARM_UP = 50
CLIENTS = 50


def measure(bench: Bench) -> Iterator[Row]:
    """Call the servers in turn."""
    took: dict[str, list[float]] = {name: [] for name in (OURS, EMPTY, SCRIPT, MINIMAL, LEAST)}
    ports = free_port(), free_port(), free_port(), free_port()
    with contextlib.ExitStack() as stack:
        for port in ports[:3]:
            stack.enter_context(simulator(f'udpout://127.0.0.1:{port}'))
        stack.enter_context(peer('responder', str(ports[3])))
        stack.enter_context(bridge(f'udpin://127.0.0.1:{ports[0]}'))
        stack.enter_context(peer('straightforward', f'udpin:127.0.0.1:{ports[1]}'))
        stack.enter_context(bridge(f'udpin://127.0.0.1:{ports[3]}', name='minimal'))
        stack.enter_context(peer('verifying', str(ports[2])))
        stack.enter_context(peer('empty_server'))
        client = stack.enter_context(Client(bench.domain))
        for name in took:
            client.meet(name)
            for _ in range(bench.amount(WARM_UP, 2)):
                client.call(name, False)
        names, last, order = list(took), '', random.Random(SEED)
        for number in range(bench.amount(1500, 4)):
            order.shuffle(names)
            # Never call a server twice in a row: it may still be busy after its answer.
            if names[0] == last:
                names.reverse()
            last = names[-1]
            for name in names:
                seconds, answer = client.call(name, number % 2 == 0)
                if answer is None or not answer.success:
                    raise RuntimeError(f'{name}: {answer}')
                took[name].append(seconds * 1e3)
    found = {name: quantiles(values) for name, values in took.items()}
    ours = found[OURS]
    yield Row(
        '~/enable over UDP, verified', 'ms', ours,
        {'empty SetBool server': found[EMPTY], 'straightforward script': found[SCRIPT],
         'least script that verifies': found[LEAST]},
        [times(ours, found[EMPTY], 1.6, 'p50'), times(ours, found[EMPTY], 1.8, 'p99'),
         times(ours, found[SCRIPT], 1.05, 'p50', 'the script')],
        f'{len(took[OURS])} calls of each; the script does not verify')
    yield Row('~/enable over UDP, verified, of a light that answers at once', 'ms',
              found[MINIMAL], {'empty SetBool server': found[EMPTY]},
              note='the share of the bridge alone')
    yield at_once(bench)


def at_once(bench: Bench) -> Row:
    """Call from many clients at the same moment."""
    port = free_port()
    with contextlib.ExitStack() as stack:
        stack.enter_context(simulator(f'udpout://127.0.0.1:{port}'))
        stack.enter_context(bridge(f'udpin://127.0.0.1:{port}'))
        callers = [stack.enter_context(Client(bench.domain))
                   for _ in range(bench.amount(CLIENTS, 5))]
        for caller in callers:
            caller.meet(OURS)
        answered = threading.Semaphore(0)
        began = time.monotonic()
        for number, caller in enumerate(callers):
            caller.start(OURS, number % 2 == 0).add_done_callback(lambda _: answered.release())
        count = sum(answered.acquire(timeout=max(began + bench.amount(10.0, 5.0)
                                                 - time.monotonic(), 0)) for _ in callers)
        seconds = time.monotonic() - began
    return Row(f'~/enable called by {len(callers)} clients at the same moment, all answered', 's',
               one(seconds), targets=[at_most(len(callers) - count, 0, 'calls unanswered')])
