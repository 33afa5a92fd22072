# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Programs on a terminal: a pseudo-terminal whose other side is the test."""

from __future__ import annotations

from collections.abc import Mapping
import fcntl
import os
import pty
import re
import signal
import struct
import subprocess
import sys
import termios
import threading

from support.fork_server import fork, prepare_child
from support.processes import environment, ROOT
from support.waiting import PATIENCE

_CONTROL = re.compile(r'\x1b\[[\d;?]*[A-Za-z]')


class Terminal:
    """
    A pseudo-terminal with ``python -m MODULE ARGUMENTS`` on it.

    :param shell: script of a shell with job control, which runs the program as ``"$@"``; '' for
        none.
    """

    def __init__(self, *module: str, size: tuple[int, int] = (24, 100),
                 env: Mapping[str, str] | None = None, shell: str = '') -> None:
        self._master, self._slave = pty.openpty()
        self.resize(*size)
        self.before = termios.tcgetattr(self._slave)
        given = {'TERM': 'xterm-256color', 'LANG': 'C.UTF-8', 'COLUMNS': '', 'LINES': '',
                 **(env or {})}
        streams = (self._slave,) * 3
        self._process = fork(module, environment(given), ROOT, streams) if not shell else (
            subprocess.Popen(
                ['sh', '-mc', shell, 'sh', sys.executable, '-m', *module], cwd=ROOT,
                env=environment(given), stdin=self._slave, stdout=self._slave,
                stderr=self._slave, start_new_session=True, preexec_fn=_own_terminal))
        self._grown = threading.Condition()
        self._raw = b''
        self._gone = False
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        while not self._gone:
            try:
                data = os.read(self._master, 65536)
            except OSError:
                return
            with self._grown:
                self._raw += data
                self._grown.notify_all()

    @property
    def raw(self) -> str:
        """Return the complete output so far."""
        return self._raw.decode('utf-8', errors='replace')

    def resize(self, lines: int, columns: int) -> None:
        """Set the size of the terminal."""
        fcntl.ioctl(self._slave, termios.TIOCSWINSZ, struct.pack('HHHH', lines, columns, 0, 0))

    def type(self, text: str | bytes) -> None:  # noqa: A003
        """Press keys."""
        os.write(self._master, text if isinstance(text, bytes) else text.encode())

    def forget(self) -> None:
        """Forget what was written so far."""
        with self._grown:
            self._raw = b''

    def wait_for(self, pattern: str, timeout: float = PATIENCE) -> None:
        """Wait until matching text has been written; a space matches any number of them."""
        def found() -> bool:
            return bool(re.search(pattern, ' '.join(_CONTROL.sub('', self.raw).split())))

        with self._grown:
            assert self._grown.wait_for(found, timeout), f'no {pattern!r} in {self.raw[-3000:]}'

    def send(self, number: int) -> None:
        """Send a signal to the program."""
        self._process.send_signal(number)

    def hang_up(self) -> None:
        """Hang up, as when a window is closed."""
        self._gone = True
        # The answer to the key ends the reader, which holds the terminal open.
        self.type('?')
        self._reader.join(PATIENCE)
        os.close(self._slave)
        os.close(self._master)

    def wait(self) -> int:
        """Wait for the end and return the exit status."""
        return self._process.wait(PATIENCE)

    @property
    def restored(self) -> bool:
        """Whether the terminal has its former settings and its former screen."""
        now = termios.tcgetattr(self._slave)
        raw = self.raw
        # A missing sequence may still arrive.
        return now == self.before and raw.rfind('\x1b[?1049l') > raw.rindex(
            '\x1b[?1049h') and raw.rfind('\x1b[?25h') > raw.rindex('\x1b[?25l')

    def __enter__(self) -> Terminal:
        return self

    def __exit__(self, *error: object) -> None:
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGKILL)
            self._process.wait(PATIENCE)
        if not self._gone:
            os.close(self._slave)
            self._reader.join(PATIENCE)
            os.close(self._master)


def _own_terminal() -> None:
    """Make this terminal the controlling one, and end the program with its parent."""
    prepare_child()
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)
