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

"""The settings of the terminal, and the keys that it sends."""

from collections.abc import Iterator
import os
import pty
import signal
import subprocess
import sys
import tempfile
import termios

from illuminator_ros.cli.monitor.terminal import Keyboard, quiet_errors, unbuffered
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
terminal.suspend(job=True)
"""
GETS_SIGNALS = """
import os, signal
from illuminator_ros.cli.monitor import terminal
with terminal.suspended_by(lambda: None):
    os.kill(os.getpid(), signal.SIGTSTP)
    os.kill(os.getpid(), signal.SIGCONT)
terminal.suspend(job=False)
"""


class Ended(Exception):
    """The terminal has been closed."""


def end() -> None:
    raise Ended


@pytest.fixture
def line() -> Iterator[tuple[int, int]]:
    """Return both ends of a terminal: where keys are pressed, and where they arrive."""
    master, slave = pty.openpty()
    yield master, slave
    for descriptor in (master, slave):
        os.close(descriptor)


def test_keyboard_returns_a_key_at_once_and_nothing_after_the_timeout(
    line: tuple[int, int],
) -> None:
    with unbuffered(line[1]):
        keyboard = Keyboard(line[1])
        os.write(line[0], b'q')

        assert keyboard.read(30.0, end) == b'q'
        assert keyboard.read(0.0, end) == b''

        # The pipe that wakes the reader must not fill up.
        for _ in range(100_000):
            keyboard.wake()
        assert keyboard.read(30.0, end) == b''
        keyboard.close()


def test_keyboard_reports_the_end_of_its_terminal() -> None:
    reading, writing = os.pipe()
    os.close(writing)
    keyboard = Keyboard(reading)

    with pytest.raises(Ended):
        keyboard.read(30.0, end)

    keyboard.close()
    os.close(reading)


def test_terminal_has_its_settings_back_after_an_exception_and_by_restore(
    line: tuple[int, int],
) -> None:
    before = termios.tcgetattr(line[1])

    with pytest.raises(Ended), unbuffered(line[1]) as restore:
        changed = termios.tcgetattr(line[1])
        restore()
        assert termios.tcgetattr(line[1]) == before
        termios.tcsetattr(line[1], termios.TCSANOW, changed)
        end()

    assert termios.tcgetattr(line[1]) == before


def test_ctrl_c_alone_is_still_a_signal(line: tuple[int, int]) -> None:
    with unbuffered(line[1]):
        modes, characters = termios.tcgetattr(line[1])[3], termios.tcgetattr(line[1])[6]

    assert modes & termios.ISIG
    assert [characters[key] for key in (termios.VINTR, termios.VQUIT, termios.VSUSP)] == [
        b'\x03', b'\0', b'\0']


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


@pytest.mark.parametrize(('directory', 'shown'), [(None, 'error\n'), ('/nowhere', '')])
def test_errors_on_the_screen_are_written_afterwards_or_lost_without_a_temporary_directory(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, directory: str | None,
    shown: str,
) -> None:
    # Fixtures need a directory when the test has ended.
    with monkeypatch.context() as patch:
        patch.setattr(tempfile, 'tempdir', directory)
        with quiet_errors():
            os.write(2, b'error\n')
            assert capfd.readouterr().err == ''

    assert capfd.readouterr().err == shown
