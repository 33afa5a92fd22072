# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Calls of services, and the start and end of the programs."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import functools
import signal
import sys
import threading
import time

from illuminator_ros.mavlink.link import Link
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from support.light import CONFIGURE, ServedLight
from support.ports import free_port
from support.processes import ended, Program, start_interpreter

from ..rig import (
    alternate,
    Bench,
    bridge,
    Client,
    interleaved,
    peer,
    PEERS,
    simulator,
    udp,
)
from ..rows import at_most, quantiles, Row, times

OURS, EMPTY, SCRIPT = (
    f'/{name}/enable' for name in ('illuminator', 'empty', 'straightforward'))
CLIENTS = 20


def enable(bench: Bench) -> Iterator[Row]:
    """
    Call ``~/enable`` over UDP, acknowledged by the light and verified by a status.

    The light is the simulator.
    """
    ports = [free_port() for _ in range(2)]
    with contextlib.ExitStack() as stack:
        for program in (
                simulator(ports[0]), simulator(ports[1]),
                bridge(udp(ports[0])),
                peer('straightforward', f'udpin:127.0.0.1:{ports[1]}'), peer('empty_server')):
            stack.enter_context(program)
        client = stack.enter_context(Client(bench))
        for name in (OURS, EMPTY, SCRIPT):
            client.meet(name)
        found = alternate({name: functools.partial(client.enable, name)
                           for name in (OURS, EMPTY, SCRIPT)},
                          bench.amount(1500, 3), bench.amount(50, 1))
    ours, empty, script = found.values()
    yield Row(
        '~/enable over UDP, verified', 'ms', ours,
        {'empty SetBool server': empty, 'straightforward script': script},
        [times(ours, empty, 1.8, 'p50'), times(ours, empty, 2.0, 'p99'),
         times(ours, script, 1.1, 'p50', 'the script')], 'the script does not verify')
    yield at_once(bench)


def at_once(bench: Bench) -> Row:
    """Call from many clients at the same moment."""
    port = free_port()
    with contextlib.ExitStack() as stack:
        stack.enter_context(simulator(port))
        stack.enter_context(bridge(udp(port)))
        callers = [stack.enter_context(Client(bench)) for _ in range(bench.amount(CLIENTS, 5))]
        for caller in callers:
            caller.meet(OURS)
        answers: list[bool] = []

        def call(caller: Client) -> None:
            answers.append(caller.call(OURS, patience=10.0)[1] is not None)

        threads = [threading.Thread(target=call, args=(caller,)) for caller in callers]
        began = time.monotonic()
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        seconds = time.monotonic() - began
    return Row(f'~/enable called by {len(callers)} clients at the same moment, all answered', 's',
               {'': seconds}, targets=[at_most(answers.count(False), 0, 'calls unanswered')])


def limited(what: str, took: list[float], limit: float) -> Row:
    """Return a row of times, s, the longest of which has a limit, ms."""
    took = [seconds * 1e3 for seconds in took]
    return Row(what, 'ms', quantiles(took, 0.5, 1), targets=[at_most(max(took), limit, 'ms')],
               note=f'{len(took)} tries')


def limits(bench: Bench) -> Iterator[Row]:
    """Measure the documented time limits of answers and of the end of the programs."""
    tries, port = range(bench.amount(5, 1)), free_port()
    with bridge(udp(port)), Client(bench) as client:
        client.client('/illuminator/set_parameters', SetParameters)

        def set_brightness(value: float) -> float:
            """Return the time until a set of the parameter is answered, s."""
            return client.call('/illuminator/set_parameters', SetParameters.Request(
                parameters=[Parameter('brightness', value=value).to_parameter_msg()]))[0]

        client.meet('/illuminator/enable', success=False)
        yield limited('~/enable without a light fails',
                      [client.call('/illuminator/enable')[0] for _ in tries], 300)
        yield limited('a set of parameters without a light fails',
                      [set_brightness(50.0) for _ in tries], 300)
        with ServedLight(port, link=Link) as light:
            client.meet('/illuminator/enable')
            light.fake.results = {CONFIGURE: None}
            yield limited('a set of parameters is answered beside a silent light',
                          [set_brightness(10.0 + number) for number in tries], 900)
    for what, off in (('the bridge ends', False),
                      ('the bridge switches the light off and ends', True)):
        yield limited(what, [end(bench, off, (signal.SIGINT, signal.SIGTERM)[number % 2])
                             for number in tries], 1000)


def end(bench: Bench, off: bool, number: int) -> float:
    """Return the time from a signal to the end of a bridge, s."""
    port = free_port()
    with (simulator(port), bridge(udp(port), off_on_shutdown=off) as program,
          Client(bench) as client):
        client.meet('/illuminator/enable')
        client.call('/illuminator/enable')
        began = time.monotonic()
        if program.end(number):
            raise RuntimeError(program.log)
        return time.monotonic() - began


NODE = 'node with one SetBool service'


def startup(bench: Bench) -> Iterator[Row]:
    """Start the bridge and a node with one service, until ``~/enable`` answers."""
    port = free_port()
    took: dict[str, list[float]] = {OURS: [], NODE: []}
    with simulator(port):
        for number, name in enumerate(interleaved([OURS, NODE], bench.amount(16, 1))):
            # Each start has a node name of its own: a name that was discovered before is faster.
            node = f'started_{number}'
            with Client(bench) as client:
                client.client(f'/{node}/enable')
                began = time.monotonic()
                program = (
                    start_interpreter('illuminator_ros.bridge', '--ros-args', '-r',
                                      f'__node:={node}', '-p', f'connection_url:={udp(port)}')
                    if name == OURS
                    else Program(sys.executable, str(PEERS / 'empty_server.py'), node))
                with ended(program):
                    client.meet(f'/{node}/enable', success=False)
                    took[name].append((time.monotonic() - began) * 1e3)
    found = {name: quantiles(values) for name, values in took.items()}
    yield Row('start of the process until ~/enable answers', 'ms', found[OURS],
              {NODE: found[NODE]}, [times(found[OURS], found[NODE], 1.5, 'p50')])
