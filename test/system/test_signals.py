# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""SIGINT, SIGTERM and SIGHUP end every program at any moment: status 0, in time, no traceback."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
import contextlib
import random
import signal
import subprocess
import sys
import threading

from illuminator_ros.cli import termination
from illuminator_ros.mavlink.link import Link
from illuminator_ros.ros import bridge
import pytest
from support.embedded import embedded_bridge
from support.light import ON_OFF, ServedLight
from support.ports import free_port
from support.processes import environment, Program, start_interpreter
from support.ros import bridge_arguments, Ros, start_bridge, start_slow_bridge
from support.waiting import eventually, PATIENCE

SIGNALS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]
# Programs at a time; with more, each would mostly wait for the others.
AT_ONCE = 3
ENDING = 'the bridge is ending'
# s; the default of Fast DDS.
LEASE = 20.0

HANGING = """
import threading
from illuminator_ros.cli.entry_point import run_program


def hang(termination):
    termination.calls(threading.Event().wait, last=lambda: print('at last', flush=True))
    print('hanging', flush=True)
    threading.Event().wait()
run_program('program', hang)
"""

# A program whose writing thread gets the processor late.
BUSY = """
import sys
import threading
import time
from illuminator_ros.cli.entry_point import run_program

run = threading.Thread.run


def run_late(thread):
    if thread.name == 'output':
        time.sleep(0.2)
    run(thread)


def fail(termination):
    termination.queue_output(2)
    print('the reason', file=sys.stderr)
    return 2


threading.Thread.run = run_late
sys.exit(run_program('program', fail))
"""


def blocked(program: Program) -> set[signal.Signals]:
    """Return the signals that a program has blocked, which one of its threads waits for."""
    with open(f'/proc/{program.pid}/status') as file:
        [mask] = [line.split()[1] for line in file if line.startswith('SigBlk:')]
    return {number for number in SIGNALS if int(mask, 16) & 1 << number - 1}


Moment = Callable[[Ros, int, str], contextlib.AbstractContextManager[Program]]


@contextlib.contextmanager
def bridge_starting(ros: Ros, port: int, node: str) -> Iterator[Program]:
    program = start_interpreter(
        'illuminator_ros.bridge', *bridge_arguments(port, '-r', f'__node:={node}'),
        env={'ROS_DOMAIN_ID': str(ros.domain)})
    eventually(lambda: blocked(program) == set(SIGNALS))
    yield program


@contextlib.contextmanager
def bridge_in_a_command(ros: Ros, port: int, node: str) -> Iterator[Program]:
    program = start_bridge(ros.domain, port, '-r', f'__node:={node}')
    program.wait_for('link open')
    with ServedLight(port, link=Link) as light:
        program.wait_for('connected')
        light.fake.results[ON_OFF] = None
        ros.start_enable(node=f'/{node}')
        light.wait_for(ON_OFF)
        yield program


@contextlib.contextmanager
def simulator_starting(ros: Ros, port: int, node: str) -> Iterator[Program]:
    program = start_interpreter('illuminator_ros.simulator', f'udpout://127.0.0.1:{port}')
    eventually(lambda: blocked(program) == set(SIGNALS))
    yield program


@pytest.mark.parametrize('number', SIGNALS[:2], ids=lambda number: number.name)
@pytest.mark.parametrize(('moment', 'count', 'longest'), [
    (bridge_starting, 2, 0.5), (bridge_in_a_command, 1, 0.3), (simulator_starting, 1, 0.3),
], ids=lambda value: getattr(value, '__name__', None) or f'up to {value}')
def test_program_ends_with_status_0_and_without_a_traceback(
    ros: Ros, moment: Moment, count: int, longest: float, number: signal.Signals,
) -> None:
    def run(attempt: int) -> tuple[int, str]:
        port = free_port()
        with moment(ros, port, f'case_{port}') as program:
            # The test varies the moment of the signal.
            threading.Event().wait(random.Random(
                f'{moment.__name__} {number.name} {attempt}').uniform(0.0, longest))
            try:
                return program.end(number), program.log
            finally:
                program.kill()

    with ThreadPoolExecutor(AT_ONCE) as pool:
        outcomes = list(pool.map(run, range(count)))

    for status, log in outcomes:
        assert (status, 'Traceback' in log, 'Exception' in log) == (0, False, False), log


def test_node_leaves_the_graph_at_once_and_further_signals_change_nothing(
    ros: Ros, port: int,
) -> None:
    # Use the slow clock, so that the program is not forced to end before it has left the graph.
    program = start_slow_bridge(ros.domain, port, '-r', '__node:=leaving')
    program.wait_for('link open')
    eventually(lambda: ros.node.count_publishers('/leaving/connected'))

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGINT):
        program.send(number)

    # The publishers of a participant that only stops sending are listed until its lease ends. The
    # name may remain: rmw_fastrtps loses its removal if it hears the end of the participant first.
    eventually(lambda: not ros.node.count_publishers('/leaving/connected'), within=0.9 * LEASE)
    assert (program.wait(), 'Traceback' in program.log) == (0, False)


def test_idle_bridge_ends_without_waiting_for_a_timer(
    ros: Ros, port: int, monkeypatch: pytest.MonkeyPatch,
) -> None:
    for timer in ('TICK', 'GRAPH_INTERVAL'):
        monkeypatch.setattr(bridge, timer, 2 * PATIENCE)
    with embedded_bridge(ros.domain, port, diagnostics_period=2 * PATIENCE):
        ros.meet('/illuminator')
        # Nothing announces that the executor has begun to wait.
        threading.Event().wait(0.1)


def test_last_line_is_written_on_a_busy_machine() -> None:
    program = Program(sys.executable, '-c', BUSY)
    try:
        assert (program.wait(), program.log) == (2, 'the reason\n')
    finally:
        program.kill()


def test_hanging_program_is_forced_to_end_within_a_second() -> None:
    program = Program(sys.executable, '-c', HANGING)
    program.wait_for('hanging')

    assert program.end(signal.SIGTERM) == 0
    assert program.count('at last') == 1
    assert (bridge.OFF_LIMIT + bridge.STOP_LIMIT + bridge.ACKNOWLEDGEMENT_LIMIT
            < termination.LIMIT < 1.0)


@pytest.mark.parametrize(
    'name', ['bridge', 'simulator', 'conformance', 'discover', 'monitor'])
def test_signals_are_handled_before_anything_slow_is_imported(name: str) -> None:
    slow = {'rclpy', 'pymavlink', 'argparse', 'logging', 'numpy', 'socket', 'textual'}

    loaded = subprocess.run(
        [sys.executable, '-c', f'import sys, illuminator_ros.{name}; print(*sys.modules)'],
        env=environment(), text=True, capture_output=True, check=True).stdout.split()

    assert slow & set(loaded) == set()


# Sends a signal when the program imports its run.
EARLY = """
import os, sys
from illuminator_ros.cli.{name} import main

class Run:
    def __getattr__(self, name):
        os.kill(os.getpid(), {number})
        return lambda *_: 0

sys.modules['illuminator_ros.cli.{name}.run'] = Run()
sys.exit(main())
"""


@pytest.mark.parametrize(('name', 'number'), [
    ('conformance', signal.SIGINT),
    *(('discover', one) for one in (*SIGNALS, signal.SIGQUIT))])
def test_signal_before_the_run_ends_with_status_1_and_without_a_traceback(
    name: str, number: int,
) -> None:
    program = Program(sys.executable, '-c', EARLY.format(name=name, number=int(number)))

    assert program.wait() == 1
    assert program.log == ''


def test_program_under_nohup_outlives_its_terminal(port: int) -> None:
    program = Program('sh', '-c', 'trap "" HUP; exec "$@"', 'sh', sys.executable, '-m',
                      'illuminator_ros.simulator', f'udpout://127.0.0.1:{port}')
    program.wait_for('link open')

    # A signal that is ignored and not blocked has no effect.
    assert blocked(program) == {signal.SIGINT, signal.SIGTERM}
    assert program.end(signal.SIGTERM) == 0
