# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The simulator as a process: its terminal, input and output, also blocked or closed."""

from collections.abc import Callable
import contextlib
import os
import subprocess
import sys

from illuminator_ros.mavlink.messages import Address
import pytest
from support.fork_server import prepare_child
from support.live_link import Bridge
from support.ports import free_port
from support.processes import ended, environment, python, ROOT, run
from support.terminals import Terminal
from support.waiting import eventually, PATIENCE

SIMULATOR = [sys.executable, '-m', 'illuminator_ros.simulator']


def assert_served(*command: str, stdout: int | None, stderr: int | None) -> None:
    """Assert that a simulator obeys a bridge, and ends on SIGTERM without delay."""
    port = free_port()
    # Retry: the clock of the machine may pause for longer than a confirmation takes.
    with Bridge(f'udpin:127.0.0.1:{port}') as bridge, subprocess.Popen(
            [*command, f'udpout://127.0.0.1:{port}'], env=environment(), cwd=ROOT, stdout=stdout,
            stderr=stderr, stdin=subprocess.DEVNULL, preexec_fn=prepare_child) as process:
        try:
            eventually(lambda: bridge.enable(True).success)
            process.terminate()
            assert process.wait(PATIENCE) == 0
        finally:
            process.kill()


@pytest.mark.parametrize(('stream', 'make'), [
    ('stdout', os.pipe), ('stderr', os.pipe), ('stdout', os.openpty)])
def test_a_reader_that_stops_reading_delays_no_command_and_no_sigterm(
        stream: str, make: Callable[[], tuple[int, int]]) -> None:
    reading, writing = make()
    os.set_blocking(writing, False)
    with contextlib.suppress(BlockingIOError):
        while True:
            os.write(writing, bytes(4096))
    os.set_blocking(writing, True)
    streams = {'stdout': subprocess.DEVNULL, 'stderr': subprocess.DEVNULL, stream: writing}
    try:
        assert_served(*SIMULATOR, stdout=streams['stdout'], stderr=streams['stderr'])
    finally:
        os.close(reading)
        os.close(writing)


@pytest.mark.parametrize('closed', ['<&-', '>&-', '<&- >&- 2>&-'])
def test_lights_are_served_while_standard_streams_are_closed(closed: str) -> None:
    command = f'exec {" ".join(SIMULATOR)} "$0" {closed}'
    assert_served('sh', '-c', command, stdout=None, stderr=None)


@pytest.fixture
def url() -> str:
    return f'udpin://127.0.0.1:{free_port()}'


@pytest.mark.parametrize(('term', 'escapes'), [('xterm', True), ('dumb', False)])
def test_a_simulator_on_a_terminal_takes_commands_and_escapes_only_where_they_work(
        url: str, term: str, escapes: bool) -> None:
    with Terminal('illuminator_ros.simulator', url, '--light', '1/7=bow',
                  env={'TERM': term}) as screen:
        screen.wait_for('1/7 bow +off')
        screen.type('bow on\n')
        screen.wait_for('ON ')
        screen.type('quit\n')
        assert screen.wait() == 0
    assert ('\x1b' in screen.raw) is escapes


def test_a_simulator_on_a_pipe_takes_commands_and_prints_plain_text(url: str) -> None:
    ended = run('illuminator_ros.simulator', url,
                typed='on\nbrightness 40\nfault nope\nstatus\nquit\n')

    assert ended.returncode == 0
    assert "no fault 'nope'" in ended.stdout
    assert 'ON      40 %' in ended.stdout
    assert '\x1b' not in ended.stdout


def test_text_that_the_encoding_lacks_is_escaped_in_output_and_replaced_in_input(
        url: str) -> None:
    ended = run('illuminator_ros.simulator', url, '--light', '1/243=Größe',
                env={'PYTHONIOENCODING': 'ascii:strict'}, typed='status\nGröße on\nquit\n')

    assert ended.returncode == 0
    assert r'1/243 Gr\xf6\xdfe' in ended.stdout
    assert 'no command or component' in ended.stdout


def test_a_simulator_whose_input_has_ended_runs_until_a_signal(url: str) -> None:
    simulator = python('illuminator_ros.simulator', url)
    simulator.wait_for('link open')

    assert simulator.running
    assert simulator.end() == 0


def test_the_first_message_of_a_peer_is_one_line() -> None:
    port = free_port()
    with (ended(python('illuminator_ros.simulator', f'udpout://127.0.0.1:{port}')) as program,
          Bridge(f'udpin:127.0.0.1:{port}') as bridge):
        for on in (True, False):
            eventually(lambda on=on: bridge.enable(on).success)  # type: ignore[misc]
        program.wait_for(f'peer {Address(1, 193)}: first message')
    assert program.count('first message') == 1
