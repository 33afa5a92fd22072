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

"""The terminal: where the screen is written, stopping and continuing, errors of the middleware."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import errno
import os
import signal
import sys
import termios
import threading
from typing import Any

from textual.drivers.linux_driver import LinuxDriver


class TerminalDriver(LinuxDriver):
    """Textual's terminal, written on stdout: the middleware writes its errors on stderr."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        assert sys.__stdout__ is not None
        self._file = sys.__stdout__
        # Textual would start again although it has not stopped.
        signal.signal(signal.SIGCONT, signal.SIG_DFL)
        signal.signal(signal.SIGTSTP, self._take_stop)

    def _take_stop(self, *_: object) -> None:
        """Take a SIGTSTP; the process stops only in :func:`suspend`."""
        request_stop()
        self._app.call_later(self._app.run_action, 'press("ctrl+z")')


def is_open() -> bool:
    """Return whether the terminal at stdin has not been closed."""
    try:
        termios.tcgetattr(0)
    except termios.error as error:
        return bool(error.args[0] != errno.EIO)
    return True


def request_stop() -> None:
    """
    Make this thread stop when it unblocks SIGTSTP, unless a SIGCONT comes before.

    The kernel discards a pending SIGTSTP when a SIGCONT comes. If the process stopped itself after
    that SIGCONT, the shell would not send another one.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTSTP])
    # Signal this thread: another thread would stop later, while this thread uses the terminal.
    signal.pthread_kill(threading.get_ident(), signal.SIGTSTP)


def suspend() -> None:
    """
    Stop until a shell continues the process in the foreground; without such a shell do nothing.

    A SIGTSTP of :class:`TerminalDriver` waits, or else the whole job stops, including "ros2 run".
    """
    handler = signal.signal(signal.SIGTSTP, signal.SIG_DFL)
    if signal.SIGTSTP not in signal.pthread_sigmask(signal.SIG_BLOCK, []):
        # Before the rest of the job stops: the shell can continue the job from then on.
        request_stop()
        os.kill(0, signal.SIGTSTP)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGTSTP])
    signal.signal(signal.SIGTSTP, handler)
    with contextlib.suppress(OSError):
        # "bg" continues it without the terminal.
        while os.tcgetpgrp(0) != os.getpgrp():
            os.kill(os.getpid(), signal.SIGSTOP)


@contextlib.contextmanager
def quiet_errors() -> Iterator[None]:
    """Keep errors of the middleware off the screen, and write them afterwards."""
    kept, file = os.dup(2), os.memfd_create('errors')
    os.dup2(file, 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.lseek(file, 0, os.SEEK_SET)
        while chunk := os.read(file, 1 << 16):
            os.write(2, chunk)
