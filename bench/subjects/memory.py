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

"""Memory of the bridge above an empty node, and its growth while it serves a light."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import time

from ..rig import Bench, bridge, Client, free_port, memory, peer, simulator
from ..rows import at_most, middle, one, Row

CALLS = 20
# s for which a light sends statuses before the memory is measured.
SERVED = 3.0
LIMIT_MB = 12.0
# MB; the growth of memory that the soak tolerates, which the allocator causes.
GROWTH_MB = 1.0


def measure(bench: Bench) -> Iterator[Row]:
    """Compare processes that have answered some calls, then let one serve for longer."""
    took: list[tuple[dict[str, float], dict[str, float]]] = []
    for _ in range(bench.amount(3, 1)):
        port = free_port()
        with contextlib.ExitStack() as stack:
            stack.enter_context(simulator(f'udpout://127.0.0.1:{port}'))
            ours = stack.enter_context(bridge(f'udpin://127.0.0.1:{port}'))
            empty = stack.enter_context(peer('empty_server'))
            with Client(bench.domain) as client:
                for name in ('/illuminator/enable', '/empty/enable'):
                    client.meet(name)
                    for number in range(bench.amount(CALLS, 2)):
                        client.call(name, number % 2 == 0)
                time.sleep(bench.amount(SERVED, 0.1))
                took.append((memory(ours.pid), memory(empty.pid)))
    for name, what in (('Rss', 'resident (RSS)'), ('Pss', 'shared pages divided (PSS)'),
                       ('Private_Dirty', 'its own alone (private dirty)')):
        above = middle([ours[name] - empty[name] for ours, empty in took])
        yield Row(
            f'memory, {what}', 'MB', middle([ours[name] for ours, _ in took]),
            {'empty node': middle([empty[name] for _, empty in took])},
            [at_most(above['value'], LIMIT_MB, 'MB above the peer')] if name == 'Rss' else [],
            f'{above["value"]:.1f} MB above; median of {len(took)} starts')
    yield growth(bench)


def growth(bench: Bench) -> Row:
    """Call ``~/enable`` of a light at 10 Hz for some time; the first quarter is the warm-up."""
    seconds = bench.amount(bench.soak, 0.4)
    port = free_port()
    with contextlib.ExitStack() as stack:
        stack.enter_context(simulator(f'udpout://127.0.0.1:{port}', '--status-interval', '0.1'))
        program = stack.enter_context(bridge(f'udpin://127.0.0.1:{port}'))
        client = stack.enter_context(Client(bench.domain))
        client.meet('/illuminator/enable')
        began, warm = time.monotonic(), 0.0
        while time.monotonic() < began + seconds:
            client.call('/illuminator/enable', bool(int(time.monotonic() * 2) % 2))
            if not warm and time.monotonic() > began + seconds / 4:
                warm = memory(program.pid)['Rss']
            time.sleep(seconds / 40)
        grown = memory(program.pid)['Rss'] - warm
    return Row(f'memory gained in {seconds:g} s at 10 Hz, after the first quarter', 'MB',
               one(grown), targets=[at_most(grown, GROWTH_MB, 'MB')])
