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

"""The terminal of the monitor: stopping and continuing, closing, errors of the middleware."""

import os
import pty
import signal
import subprocess
import sys

from illuminator_ros.cli.monitor.terminal import is_open, quiet_errors
import pytest
from support.fork_server import prepare_child
from support.processes import environment, ROOT
from support.waiting import PATIENCE

# os.kill() stops the rest of the job, and returns after the job has been continued.
STOPS_ITS_JOB = """
import os, sys
from illuminator_ros.cli.monitor import terminal
kill = os.kill
os.kill = lambda *arguments: (kill(*arguments), sys.stdin.read())
terminal.suspend()
"""
GETS_SIGNALS = """
import os, signal
from illuminator_ros.cli.monitor import terminal
signal.signal(signal.SIGTSTP, lambda *_: terminal.request_stop())
os.kill(os.getpid(), signal.SIGTSTP)
os.kill(os.getpid(), signal.SIGCONT)
terminal.suspend()
"""


def test_closed_terminal_is_reported() -> None:
    master, slave = pty.openpty()
    before = os.dup(0)
    os.dup2(slave, 0)
    try:
        assert is_open()
        os.close(master)
        assert not is_open()
    finally:
        os.dup2(before, 0)
        os.close(before)
        os.close(slave)


def start(*command: str, group: int = 0) -> subprocess.Popen[bytes]:
    """Start a process in a process group, as a shell does; 0 is a new group."""
    def prepare() -> None:
        prepare_child()
        os.setpgid(0, group)

    return subprocess.Popen(command, stdin=subprocess.PIPE, cwd=ROOT, env=environment(),
                            preexec_fn=prepare)


def runs_to_its_end(process: subprocess.Popen[bytes]) -> bool:
    """Wait until a process ends or stops, and return whether it ends without an error."""
    _, status = os.waitpid(process.pid, os.WUNTRACED)
    return os.WIFEXITED(status) and os.WEXITSTATUS(status) == 0


def test_job_continued_before_its_last_process_stops_goes_on() -> None:
    with (start(sys.executable, '-c', STOPS_ITS_JOB) as process,
          start('sleep', str(PATIENCE), group=process.pid) as rest):
        try:
            os.waitpid(rest.pid, os.WUNTRACED)
            os.killpg(process.pid, signal.SIGCONT)
            assert process.stdin is not None
            process.stdin.close()

            assert runs_to_its_end(process)
        finally:
            os.killpg(process.pid, signal.SIGKILL)


def test_process_continued_before_it_restores_the_terminal_goes_on() -> None:
    with start(sys.executable, '-c', GETS_SIGNALS) as process:
        try:
            assert runs_to_its_end(process)
        finally:
            process.kill()


def test_errors_on_the_screen_are_written_afterwards(capfd: pytest.CaptureFixture[str]) -> None:
    with quiet_errors():
        os.write(2, b'error\n')
        assert capfd.readouterr().err == ''

    assert capfd.readouterr().err == 'error\n'
