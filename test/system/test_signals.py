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

"""SIGINT, SIGTERM and SIGHUP end every program at any moment: status 0, in time, no traceback."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
import random
import signal
import subprocess
import sys
import time

from illuminator_ros.cli import termination
from illuminator_ros.mavlink.link import Link
from illuminator_ros.ros import bridge
import pytest
from std_srvs.srv import SetBool
from support.light import eventually, ON_OFF, ServedLight
from support.ports import free_port
from support.processes import environment, Program, python
from support.ros import Ros, start_bridge, start_slow_bridge

SIGNALS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]
# Programs at a time; more would only measure how they wait for each other.
AT_ONCE = 3
# s; what Fast DDS has by default.
LEASE = 20.0

HANGING = """
import threading
from illuminator_ros.cli.program import run_program
def hang(termination):
    termination.calls(threading.Event().wait, last=lambda: print('at last', flush=True))
    print('hanging', flush=True)
    threading.Event().wait()
run_program('program', hang)
"""

# Exit status, and what was printed.
CommandStatus = tuple[int, str]


def blocked(program: Program) -> set[signal.Signals]:
    """Return which of the signals a program has blocked, in order to wait for them itself."""
    with open(f'/proc/{program.pid}/status') as file:
        [mask] = [line.split()[1] for line in file if line.startswith('SigBlk:')]
    return {number for number in SIGNALS if int(mask, 16) & 1 << number - 1}


def signals_are_taken(program: Program) -> bool:
    """Return whether a program has come so far that it answers for signals itself."""
    return blocked(program) == set(SIGNALS)


class Case:
    """One run of a program, to be ended at some moment of it."""

    def __init__(self, ros: Ros, seed: str) -> None:
        self.ros = ros
        self.random = random.Random(seed)
        self.port = free_port()
        self.node = f'case_{self.port}'
        self._programs: list[Program] = []

    def __enter__(self) -> Case:
        return self

    def __exit__(self, *error: object) -> None:
        for program in self._programs:
            program.kill()

    def pause(self, longest: float) -> None:
        """Let a random time pass: the moment of the signal is what is tested."""
        time.sleep(self.random.uniform(0.0, longest))

    def bridge(self, start: Callable[..., Program] = start_bridge) -> Program:
        self._programs.append(
            start(self.ros.domain, self.port, '-r', f'__node:={self.node}'))
        return self._programs[-1]

    def simulator(self) -> Program:
        self._programs.append(
            python('illuminator_ros.simulator', f'udpout://127.0.0.1:{self.port}'))
        return self._programs[-1]


def bridge_starting(case: Case, number: int) -> CommandStatus:
    program = case.bridge()
    eventually(lambda: signals_are_taken(program))
    case.pause(0.5)
    return program.end(number), program.log


def bridge_connecting(case: Case, number: int) -> CommandStatus:
    program = case.bridge()
    program.wait_for('link open')
    with ServedLight(case.port, link=Link):
        case.pause(0.1)
        return program.end(number), program.log


def bridge_idle(case: Case, number: int) -> CommandStatus:
    program = case.bridge()
    program.wait_for('link open')
    with ServedLight(case.port, link=Link):
        program.wait_for('connected')
        case.pause(0.5)
        return program.end(number), program.log


def bridge_in_a_command(case: Case, number: int) -> CommandStatus:
    program = case.bridge()
    program.wait_for('link open')
    with ServedLight(case.port, link=Link) as light:
        program.wait_for('connected')
        light.fake.results[ON_OFF] = None
        case.ros.start(SetBool, f'/{case.node}/enable', SetBool.Request(data=True))
        light.wait_for(ON_OFF)
        case.pause(0.3)
        return program.end(number), program.log


def simulator_starting(case: Case, number: int) -> CommandStatus:
    program = case.simulator()
    eventually(lambda: signals_are_taken(program))
    case.pause(0.3)
    return program.end(number), program.log


def simulator_running(case: Case, number: int) -> CommandStatus:
    program = case.simulator()
    program.wait_for('link open')
    case.pause(0.3)
    return program.end(number), program.log


@pytest.mark.parametrize('number', SIGNALS, ids=lambda number: number.name)
@pytest.mark.parametrize(('moment', 'count'), [
    (bridge_starting, 8), (bridge_connecting, 4), (bridge_idle, 4), (bridge_in_a_command, 4),
    (simulator_starting, 6), (simulator_running, 4),
], ids=lambda value: getattr(value, '__name__', ''))
def test_a_program_ends(
    ros: Ros, moment: Callable[[Case, int], CommandStatus], count: int,
    number: signal.Signals,
) -> None:
    # It takes the same way as SIGTERM.
    if number == signal.SIGHUP:
        count = 1

    def run(n: int) -> CommandStatus:
        with Case(ros, f'{moment.__name__} {number.name} {n}') as case:
            return moment(case, number)

    with ThreadPoolExecutor(AT_ONCE) as pool:
        outcomes = list(pool.map(run, range(count)))

    for status, log in outcomes:
        assert (status, 'Traceback' in log, 'Exception' in log) == (0, False, False), log


def test_the_node_is_gone_from_the_graph_at_once(ros: Ros) -> None:
    with Case(ros, 'graph') as case:
        # By the slow clock, so that it is not forced to end before it has left.
        program = case.bridge(start_slow_bridge)
        eventually(lambda: case.node in ros.node.get_node_names())

        program.end(signal.SIGTERM)

        # A participant that only fell silent would be listed for as long as its lease runs.
        eventually(lambda: case.node not in ros.node.get_node_names(), within=LEASE / 2)


def test_a_program_that_hangs_ends_all_the_same() -> None:
    program = Program(sys.executable, '-c', HANGING)
    program.wait_for('hanging')

    assert program.end(signal.SIGTERM) == 0
    assert program.count('at last') == 1


def test_the_parts_of_an_end_have_time_before_it_is_forced_and_that_is_within_a_second() -> None:
    assert (bridge.OFF_LIMIT + bridge.STOP_LIMIT + bridge.THREADS_LIMIT
            < termination.LIMIT < 1.0)


def test_impatience_changes_nothing(ros: Ros) -> None:
    with Case(ros, 'impatience') as case:
        program = case.bridge()
        program.wait_for('link open')

        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGINT):
            program.send(number)

        assert program.wait() == 0
        assert 'Traceback' not in program.log


@pytest.mark.parametrize('module', ['illuminator_ros.bridge', 'illuminator_ros.simulator'])
def test_signals_are_taken_before_anything_slow_is_imported(module: str) -> None:
    slow = {'rclpy', 'pymavlink', 'argparse', 'logging', 'numpy', 'socket'}

    loaded = subprocess.run(
        [sys.executable, '-c', f'import sys, {module}; print(*sys.modules)'],
        env=environment(), text=True, capture_output=True, check=True).stdout.split()

    assert slow & set(loaded) == set()


def test_a_program_in_the_background_of_a_script_ends_too(ros: Ros) -> None:
    """A shell without job control has its background programs ignore SIGINT."""
    port = free_port()
    program = Program(
        'sh', '-c', f'{sys.executable} -m illuminator_ros.simulator udpout://127.0.0.1:{port} & '
        'echo pid $!; wait $!; echo status $?')
    program.wait_for('link open')
    [line] = [line for line in program.lines if line.startswith('pid')]

    subprocess.run(['kill', '-INT', line.split()[1]], check=True)

    program.wait_for('status 0')
    assert program.wait() == 0


def test_a_program_under_nohup_outlives_its_terminal() -> None:
    port = free_port()
    program = Program('sh', '-c', 'trap "" HUP; exec "$@"', 'sh', sys.executable, '-m',
                      'illuminator_ros.simulator', f'udpout://127.0.0.1:{port}')
    program.wait_for('link open')

    # A signal that is ignored and not blocked has no effect.
    assert blocked(program) == {signal.SIGINT, signal.SIGTERM}
    assert program.end(signal.SIGTERM) == 0
