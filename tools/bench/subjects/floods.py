# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Floods of each service and topic of each node: turns of the link's thread, and times to OFF."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
import contextlib
import signal
import sys
import time

from std_srvs.srv import SetBool
from support.ports import free_port
from support.processes import Program, start_interpreter
from support.waiting import eventually, PATIENCE

from ..rig import Bench, Client, ready, simulator, udp
from ..rows import at_most, quantiles, Row

# s for which an endpoint is flooded before the turns are read, and between two OFF meanwhile.
FLOODED, SPACING = 0.5, 0.1
OFFS = 3
# ms: CPU time of a turn; from the cause of an OFF to the wire.
TURN, OFF = 5.0, 50.0
# The simulated payload of each node, None for lights.
NODES = {'illuminator': None, 'gimbal': 'gimbal_manager', 'gimbal_manager': 'gimbal',
         'rededge': 'rededge'}
# The kinds of requests in the flood of a service, by the last part of its type.
KINDS = {'SetParameters': ('~', 'values'), 'SetParametersAtomically': ('~', 'values'),
         'GetParameters': ('~', 'names'), 'ListParameters': ('~', 'names')}
# Each node has more services: those of parameters, loggers and types.
MIN_SERVICES = 9
# Name, type and kind of request.
Endpoint = tuple[str, str, str]


class Flooded:
    """
    A bridge with its devices, to be flooded.

    :param count: how many devices.
    """

    def __init__(self, bench: Bench, node: str, count: int) -> None:
        self._bench, self._node, self._count = bench, node, count
        self.turns: dict[str, float] = {}
        self.calls: dict[str, float] = {}
        self.signals: dict[str, float] = {}

    def measure(self) -> None:
        """Flood each endpoint of the first node, then those that wait for the link at once."""
        with self._running() as bridge, Client(self._bench) as client:
            found = self._endpoints(client)
            floods = [[one] for one in found] + [found]
            for flood in floods[:self._bench.amount(None, 1)]:
                with flooding(flood):
                    self._note(self.turns, flood, self._turn(bridge))
                    if self._node == 'illuminator':
                        self._note(self.calls, flood, self._offs(client, bridge))
        if self._node == 'illuminator':
            # Each needs a bridge of its own.
            for flood in floods if self._count > 1 and not self._bench.quick else floods[-1:]:
                with self._running() as bridge, Client(self._bench) as client:
                    self._endpoints(client)
                    with flooding(flood):
                        self._note(self.signals, flood, self._signal(bridge))

    @contextlib.contextmanager
    def _running(self) -> Iterator[Program]:
        port, payload = free_port(), NODES[self._node]
        with contextlib.ExitStack() as stack:
            stack.enter_context(simulator(port, *(
                ('--payload', payload) if payload else
                ('--count', str(self._count), '--component-id', '1'))))
            options = () if payload else ('--ros-args', '-p', 'off_on_shutdown:=true')
            bridge = stack.enter_context(ready(start_interpreter(
                'tools.bench.timed_bridge', self._node, udp(port), *options), 'link open'))
            bridge.wait_for(' connected', PATIENCE, self._count)
            yield bridge

    def _endpoints(self, client: Client) -> list[Endpoint]:
        """Return the services and subscribed topics of the node, with each kind of request."""
        graph, name = client.node, (self._node, '/')
        eventually(lambda: name in graph.get_node_names_and_namespaces() and len(
            graph.get_service_names_and_types_by_node(*name)) > MIN_SERVICES, 'services are known')
        services = [(one, types[0]) for one, types in sorted(
            graph.get_service_names_and_types_by_node(*name))]
        topics = [(one, types[0]) for one, types in sorted(
            graph.get_subscriber_names_and_types_by_node(*name)) if self._node in one]
        return [(*one, kind) for one in (*services, *topics)
                if 'logger' not in one[0] and 'type_description' not in one[0]
                for kind in KINDS.get(one[1].rpartition('/')[2], ('~',))]

    def _turn(self, bridge: Program) -> float:
        before = len(_values(bridge, 'turn'))
        time.sleep(FLOODED)
        eventually(lambda: len(_values(bridge, 'turn')) > before + 1, 'turns are printed')
        # The first one may be of the time before the flood.
        return max(one[-1] for one in _values(bridge, 'turn')[before + 1:])

    def _offs(self, client: Client, bridge: Program) -> float:
        """Switch on and off; return the longest time from an OFF that is taken to the wire, ms."""
        longest = 0.0
        for _ in range(OFFS):
            client.call('/illuminator/enable', SetBool.Request(data=True), 5.0)
            taken, offs = _next(bridge, 'taken'), _next(bridge, 'off')
            client.call('/illuminator/enable', SetBool.Request(data=False), 5.0)
            longest = max(longest, offs() - taken())
            time.sleep(SPACING)
        return longest * 1e3

    def _signal(self, bridge: Program) -> float:
        """Send SIGTERM; return the time until each light was sent its OFF, ms."""
        time.sleep(FLOODED)
        before = len(_values(bridge, 'off'))
        began = time.monotonic()
        bridge.send(signal.SIGTERM)
        bridge.wait()
        first: dict[float, float] = {}
        for light, at in _values(bridge, 'off')[before:]:
            first.setdefault(light, at)
        if len(first) < self._count:
            raise RuntimeError(f'{len(first)} of {self._count} lights were sent an OFF')
        return (max(first.values()) - began) * 1e3

    @staticmethod
    def _note(into: dict[str, float], flood: Sequence[Endpoint], value: float) -> None:
        name = (f'{flood[0][0]} {flood[0][2]}'.replace(' ~', '') if len(flood) == 1
                else 'all at once')
        into[name] = value
        print(f'    {name}: {value:.3g} ms', file=sys.stderr, flush=True)

    def rows(self) -> Iterator[Row]:
        """Yield the longest turn and the longest times to OFF, each with its flood."""
        kind = f'{self._node}, {self._count} lights' if self._count > 1 else self._node
        for what, found, limit in (
                ("longest turn of the link's thread, CPU time", self.turns, TURN),
                ('`~/enable` false taken to its OFF on the wire', self.calls, OFF),
                ('SIGTERM to the last OFF on the wire', self.signals, OFF)):
            if found:
                worst = max(found, key=found.__getitem__)
                yield Row(f'{what}, {kind}', 'ms', quantiles([*found.values()], 0.5, 1),
                          targets=[at_most(found[worst], limit, 'ms')],
                          note=f'{len(found)} floods, the worst is {worst}')


def floods(bench: Bench) -> Iterator[Row]:
    """Flood each endpoint of each node, and all at once; switch lights off meanwhile."""
    for node, count in bench.amount(
            [('illuminator', 1), ('illuminator', 16), ('gimbal', 1), ('gimbal_manager', 1),
             ('rededge', 1)], [('illuminator', 2)]):
        flooded = Flooded(bench, node, count)
        flooded.measure()
        yield from flooded.rows()


@contextlib.contextmanager
def flooding(flood: Sequence[Endpoint]) -> Iterator[None]:
    """Flood endpoints from a process of its own."""
    program = start_interpreter('tools.bench.flooder', *(text for one in flood for text in one))
    try:
        program.wait_for('flooding', PATIENCE)
        yield
    finally:
        program.kill()


def _next(program: Program, word: str) -> Callable[[], float]:
    """Return a function that waits for the next line of a word, and returns its last number."""
    before = len(_values(program, word))

    def wait() -> float:
        eventually(lambda: len(_values(program, word)) > before, word)
        return _values(program, word)[before][-1]

    return wait


def _values(program: Program, word: str) -> list[tuple[float, ...]]:
    """Return the numbers of each line that begins with a word."""
    return [tuple(map(float, line.split()[1:])) for line in program.lines
            if line.startswith(f'{word} ')]
