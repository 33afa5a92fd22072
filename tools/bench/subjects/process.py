# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The memory of a process, and many nodes in one."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
from pathlib import Path
import statistics
import time

from support.ports import free_port
from support.waiting import eventually

from ..rig import Bench, bridge, Client, cpu_share, peer, resident, simulator, udp
from ..rows import at_most, Figures, quantiles, Row, times

# s for which a light sends statuses before the memory is measured; MB.
SERVED, LIMIT = 3.0, 20.0


def memory(bench: Bench) -> Iterator[Row]:
    """Compare the memory with a node with one SetBool service; let the bridge serve."""
    took = []
    for _ in range(bench.amount(3, 1)):
        port = free_port()
        with contextlib.ExitStack() as stack:
            stack.enter_context(simulator(port))
            programs = stack.enter_context(bridge(udp(port))), stack.enter_context(
                peer('empty_server'))
            client = stack.enter_context(Client(bench))
            for name in ('/illuminator/enable', '/empty/enable'):
                client.meet(name)
                for _ in range(bench.amount(20, 2)):
                    client.call(name)
            time.sleep(bench.amount(SERVED, 0.1))
            took.append([resident(program.pid) for program in programs])
    ours, theirs = (statistics.median(values) for values in zip(*took, strict=True))
    yield Row('resident memory', 'MB', {'': ours}, {'node with one SetBool service': {'': theirs}},
              [at_most(ours - theirs, LIMIT, 'MB above the peer')])


# Participants that discover the nodes, one after the other. Half of them miss the first
# announcement of the bridge, and the row judges the longest discovery.
PARTICIPANTS = 5
# Limits for 16 lights and fewer: MB above a node with one service, threads, s.
MEMORY, THREADS, DISCOVERY = 60.0, 20, 3.0
# The longest ``~/enable`` of the last light, as a multiple of the time of a single light.
SLOWDOWN = {4: 1.4, 16: 2.5}


def seen(bench: Bench, names: list[str]) -> float:
    """Return the time until a participant has discovered the services of all nodes, s."""
    with Client(bench) as client:
        began = time.monotonic()
        clients = [client.client(f'/{name}/enable') for name in names]
        eventually(lambda: all(one.service_is_ready() for one in clients), 'all nodes are seen')
        return time.monotonic() - began


def nodes(bench: Bench) -> Iterator[Row]:
    """Serve 1, 4 and 16 lights, with a node for each in one process."""
    alone: Figures = {}
    with peer('empty_server') as empty:
        least = resident(empty.pid)
    for count in bench.amount((1, 4, 16), (2,)):
        port = free_port()
        names = ['illuminator', *(f'illuminator_2_{n}' for n in range(2, count + 1))]
        arguments = ('--count', str(count), '--system-id', '2', '--component-id', '1')
        with simulator(port, *arguments), bridge(udp(port), target_component=1) as program:
            seen(bench, names)
            discoveries = [seen(bench, names) for _ in range(bench.amount(PARTICIPANTS, 1))]
            with Client(bench) as client:
                for name in (names[0], names[-1]):
                    client.meet(f'/{name}/enable')
                time.sleep(bench.amount(2.0, 0.0))
                share = cpu_share(program.pid, bench.amount(3.0, 0.1))
                first, last = (quantiles([client.enable(f'/{name}/enable')[0] * 1e3
                                          for _ in range(bench.amount(150, 3))])
                               for name in (names[0], names[-1]))
            taken = resident(program.pid)
            threads = len([*Path(f'/proc/{program.pid}/task').iterdir()])
        alone = alone or first
        kind = f'nodes in one process: {count}'
        yield Row(f'CPU, each light at 1 Hz, {kind}', '%', {'': share})
        yield Row(f'memory, {kind}', 'MB', {'': taken}, {'empty SetBool server': {'': least}}, [
            at_most(taken - least, MEMORY, 'MB more'), at_most(threads, THREADS, 'threads')],
            note=f'{threads} threads')
        one = {'one node': alone}
        yield Row(f'~/enable of the first, {kind}', 'ms', first, one,
                  [times(first, alone, 1.2, 'p50')])
        yield Row(f'~/enable of the last, {kind}', 'ms', last, one, [
            times(last, alone, SLOWDOWN[count], 'p50')] if count in SLOWDOWN else [])
        yield Row(f'discovery of all by a new participant, {kind}', 's',
                  quantiles(discoveries, 0.5, 1),
                  targets=[at_most(max(discoveries), DISCOVERY, 's')])
