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

"""``simulator`` as a process: its terminal, and its standard input."""

import contextlib
import subprocess
import sys

import pytest
from support.ports import free_port
from support.processes import environment, python, ROOT, run
from support.terminals import Terminal
from support.waiting import eventually


@pytest.fixture
def url() -> str:
    return f'udpin://127.0.0.1:{free_port()}'


def test_a_simulator_on_a_terminal_takes_commands_and_draws_with_escapes(url: str) -> None:
    with Terminal('illuminator_ros.simulator', url, '--light', '1/7=bow') as screen:
        screen.wait_for('1/7 bow')
        screen.type('bow on\n')
        screen.wait_for('ON ')
        screen.type('quit\n')
        assert screen.wait() == 0
    assert '\x1b7' in screen.raw


def test_a_simulator_on_a_terminal_without_escape_sequences_prints_plain_text(url: str) -> None:
    with Terminal('illuminator_ros.simulator', url, env={'TERM': 'dumb'}) as screen:
        screen.wait_for('1/243 off')
        screen.type('on\nquit\n')
        assert screen.wait() == 0
    assert '\x1b' not in screen.raw


def test_a_simulator_on_a_pipe_takes_commands_and_prints_plain_text(url: str) -> None:
    ended = run('illuminator_ros.simulator', url,
                typed='on\nbrightness 40\nfault nope\nstatus\nquit\n')

    assert ended.returncode == 0
    assert "no fault 'nope'" in ended.stdout
    assert 'ON      40 %' in ended.stdout
    assert '\x1b' not in ended.stdout


def test_a_simulator_whose_input_has_ended_runs_until_a_signal(url: str) -> None:
    simulator = python('illuminator_ros.simulator', url)
    simulator.wait_for('link open')

    assert simulator.running
    assert simulator.end() == 0


def test_undecodable_input_does_not_end_the_console_of_a_simulator(url: str) -> None:
    process = subprocess.Popen(
        [sys.executable, '-m', 'illuminator_ros.simulator', url], cwd=ROOT,
        stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
        env=environment({'PYTHONIOENCODING': 'utf-8:strict'}))
    assert process.stdin is not None

    def ended() -> bool:
        # Repeat the line: the simulator drops a line that it reads together with invalid bytes.
        assert process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            process.stdin.write(b'quit\n')
            process.stdin.flush()
        return process.poll() is not None

    try:
        process.stdin.write(b'\xff\n')
        process.stdin.flush()
        eventually(ended, 'it takes no command any more')
        assert process.returncode == 0
    finally:
        process.kill()
        process.wait()
        with contextlib.suppress(BrokenPipeError):
            process.stdin.close()
