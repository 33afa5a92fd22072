# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Programs under test: each is started here, and read, ended and waited for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
import contextlib
import functools
import os
from pathlib import Path
import select
import signal
import subprocess
import sys
import tempfile
import threading
from typing import Any, IO

from support.fork_server import fork, ForkedProcess, prepare_child
from support.waiting import PATIENCE

ROOT = Path(__file__).parents[2]


class Program:
    """
    A process whose output, standard output and error together, can be waited for.

    :param forked: whether the command is a module of this package and its arguments.
    """

    def __init__(self, *command: str, env: Mapping[str, str] | None = None,
                 cwd: Path | None = None, forked: bool = False) -> None:
        self._output, writing = os.pipe()
        with open(os.devnull) as nothing, open(writing, 'wb') as output:
            self._process = _start(
                command, environment(env), cwd or ROOT, (nothing, output, output), forked)
        self._lines: list[str] = []
        self._rest = b''
        self._ended = False
        self._grown = threading.Condition(threading.RLock())
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        """Return the process id."""
        return self._process.pid

    @property
    def lines(self) -> list[str]:
        """Return all complete lines printed so far, including lines not yet read."""
        with self._grown:
            while self._take():
                # The thread that reads gets none of it.
                self._grown.notify_all()
            return list(self._lines)

    @property
    def log(self) -> str:
        """Return the complete output so far."""
        return ''.join(self.lines)

    def _read(self) -> None:
        going = True
        while going:
            # Wait without the lock, which other threads may need meanwhile.
            select.select([self._output], [], [])
            with self._grown:
                going = self._take() or not self._ended
                self._grown.notify_all()
        os.close(self._output)

    def _take(self) -> bool:
        """Take the printed output; return whether there was any."""
        if self._ended or not select.select([self._output], [], [], 0.0)[0]:
            return False
        data = os.read(self._output, 65536)
        self._ended = not data
        *whole, self._rest = (self._rest + data).split(b'\n')
        if self._ended and self._rest:
            whole, self._rest = [*whole, self._rest], b''
        self._lines += [line.decode(errors='replace') + '\n' for line in whole]
        return bool(data)

    def wait_for(self, text: str, timeout: float = PATIENCE, count: int = 1) -> None:
        """Wait until ``count`` lines with this text have been printed."""
        with self._grown:
            found = self._grown.wait_for(lambda: self.count(text) >= count, timeout)
        assert found, f'{text!r} was not printed {count} times:\n{self.log}'

    def count(self, text: str) -> int:
        """Return how many lines have this text."""
        return sum(text in line for line in self.lines)

    def send(self, number: int) -> None:
        """Send a signal."""
        self._process.send_signal(number)

    def wait(self, timeout: float = PATIENCE) -> int:
        """Wait for the end and return the exit status."""
        status = self._process.wait(timeout)
        self._reader.join(timeout)
        return status

    def end(self, number: int = signal.SIGINT) -> int:
        """Send a signal, and return the exit status."""
        self.send(number)
        return self.wait()

    def kill(self) -> None:
        """Kill the process if it still runs."""
        if self._process.poll() is None:
            self._process.kill()
        self.wait()

    @property
    def running(self) -> bool:
        """Whether it has not ended."""
        return self._process.poll() is None


def _start(
    command: Sequence[str], variables: Mapping[str, str], directory: Path,
    streams: Sequence[IO[Any]], forked: bool,
) -> subprocess.Popen[bytes] | ForkedProcess:
    """Start a program with its standard input, output and error."""
    if forked:
        return fork(command, variables, directory, [stream.fileno() for stream in streams])
    stdin, stdout, stderr = streams
    return subprocess.Popen(command, env=variables, cwd=directory, stdin=stdin, stdout=stdout,
                            stderr=stderr, preexec_fn=prepare_child)


@functools.cache
def _home() -> tempfile.TemporaryDirectory[str]:
    """Return the home directory of all programs that this process starts."""
    return tempfile.TemporaryDirectory(prefix='illuminator_ros_home_')


def environment(more: Mapping[str, str] | None = None) -> dict[str, str]:
    """Return the environment of programs under test: this tree, a home of their own, loopback."""
    home = _home().name
    return {
        **os.environ, 'HOME': home, 'ROS_HOME': f'{home}/.ros', 'ROS_LOG_DIR': f'{home}/log',
        'PYTHONPATH': os.pathsep.join(
            filter(None, (str(ROOT), str(ROOT / 'test'), os.environ.get('PYTHONPATH')))),
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST', **(more or {})}


def _python_variables(variables: Mapping[str, str]) -> dict[str, str]:
    return {name: value for name, value in variables.items() if name.startswith('PYTHON')}


# Python reads them when it starts, so a fork has those of this process.
PYTHON_VARIABLES = _python_variables(os.environ)


def _can_be_forked(env: Mapping[str, str] | None) -> bool:
    # A fork takes that of this process, but runs no sitecustomize, for which a test gives another.
    path = {'PYTHONPATH': ''}
    return _python_variables({**os.environ, **path, **(env or {})}) == PYTHON_VARIABLES | path


def is_running(pid: str) -> bool:
    """Return whether a process has not ended; a zombie has no command line."""
    try:
        return bool(Path(f'/proc/{pid}/cmdline').read_text())
    except OSError:
        return False


def python(module: str, *arguments: str, env: Mapping[str, str] | None = None) -> Program:
    """Start a module of this package."""
    if _can_be_forked(env):
        return Program(module, *arguments, env=env, forked=True)
    return start_interpreter(module, *arguments, env=env)


def start_interpreter(
    module: str, *arguments: str, env: Mapping[str, str] | None = None,
) -> Program:
    """Start a module of this package in a new interpreter, as users do."""
    return Program(sys.executable, '-m', module, *arguments, env=env)


def slow_python(module: str, *arguments: str, env: Mapping[str, str] | None = None) -> Program:
    """Start a module of this package by the tests' slow clock, see :mod:`support.slow`."""
    from support.slow import CLOCK
    return python('support.slow_program', module, *arguments,
                  env={**CLOCK.environment, **(env or {})})


def run(
    module: str, *arguments: str, env: Mapping[str, str] | None = None, typed: str = '',
    redirection: str = '',
) -> subprocess.CompletedProcess[str]:
    """
    Run a module of this package to its end; return its exit status and output.

    :param typed: the text on its standard input.
    :param redirection: of a shell, such as ``> /dev/full``.
    """
    forked = _can_be_forked(env) and not redirection
    command = [module, *arguments] if forked else [
        'sh', '-c', f'exec "$@" {redirection}', 'sh', sys.executable, '-m', module, *arguments]
    with contextlib.ExitStack() as opened:
        streams = [opened.enter_context(tempfile.TemporaryFile('w+')) for _ in range(3)]
        streams[0].write(typed)
        streams[0].seek(0)
        process = _start(command, environment(env), ROOT, streams, forked)
        try:
            status = process.wait(PATIENCE)
        finally:
            process.kill()
        for stream in streams:
            stream.seek(0)
        return subprocess.CompletedProcess(
            command, status, streams[1].read(), streams[2].read())


@contextlib.contextmanager
def ended(program: Program) -> Iterator[Program]:
    """End a program with SIGINT; its status must be 0 then, and its log have no traceback."""
    try:
        yield program
        if program.running:
            status = program.end()
            assert (status, 'Traceback' in program.log) == (0, False), f'{status}: {program.log}'
    finally:
        program.kill()
