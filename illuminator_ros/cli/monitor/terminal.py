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

"""The terminal: its settings, stopping and continuing, and the keys."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import errno
import functools
import os
import select
import signal
import sys
import tempfile
import termios
import threading
from typing import IO

from ..entry_point import discard_output

# s after an escape in which the rest of its sequence must arrive.
ESCAPE_TIMEOUT = 0.05


@contextlib.contextmanager
def while_it_lasts() -> Iterator[None]:
    """End without an error if the terminal closes."""
    try:
        yield
    except (OSError, termios.error) as error:
        if error.args[0] != errno.EIO:
            raise
        # The interpreter would write the remaining output at its exit.
        discard_output()


@contextlib.contextmanager
def unbuffered(descriptor: int) -> Iterator[Callable[[], None]]:
    """
    Let a terminal pass on each key at once, without an echo.

    Yield a function that restores it without waiting for pending output.
    """
    before = termios.tcgetattr(descriptor)
    changed = termios.tcgetattr(descriptor)
    changed[3] &= ~(termios.ICANON | termios.ECHO)
    changed[6][termios.VMIN], changed[6][termios.VTIME] = 1, 0
    # Ctrl-\ and ctrl-z as signals would end or stop "ros2 run" at once, and the shell would get
    # the terminal before it is restored.
    changed[6][termios.VQUIT] = changed[6][termios.VSUSP] = b'\0'
    try:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, changed)
        yield functools.partial(termios.tcsetattr, descriptor, termios.TCSANOW, before)
    finally:
        # With SIGTTOU blocked, the settings work after the shell has taken the terminal back.
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTTOU])
        # The terminal may be closed.
        with contextlib.suppress(termios.error):
            termios.tcsetattr(descriptor, termios.TCSADRAIN, before)
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


@contextlib.contextmanager
def suspended_by(on_stop: Callable[[], None]) -> Iterator[None]:
    """Call ``on_stop()`` on SIGTSTP; the process stops only in :func:`suspend`."""
    def handle(*_: object) -> None:
        _request_stop()
        on_stop()

    before = signal.signal(signal.SIGTSTP, handle)
    try:
        yield
    finally:
        signal.signal(signal.SIGTSTP, before)


def _request_stop() -> None:
    """
    Make this thread stop when it unblocks SIGTSTP, unless a SIGCONT comes before.

    The kernel discards a pending SIGTSTP when a SIGCONT comes. If the process stopped itself after
    that SIGCONT, the shell would not send another one.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTSTP])
    # Signal this thread: another thread would stop later, while this thread uses the terminal.
    signal.pthread_kill(threading.get_ident(), signal.SIGTSTP)


def suspend(job: bool) -> None:
    """
    Stop until a shell continues the process; without such a shell nothing happens.

    Nothing happens either if the shell has already continued it.

    :param job: stop the whole job, including "ros2 run", as ctrl-z does.
    """
    if job:
        # Before the rest of the job stops: the shell can continue the job from then on.
        _request_stop()
        os.kill(0, signal.SIGTSTP)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGTSTP])


@contextlib.contextmanager
def quiet_errors() -> Iterator[None]:
    """Keep errors of the middleware off the screen, and write them afterwards."""
    sys.stderr.flush()
    kept = os.dup(2)
    with _errors_file() as file:
        os.dup2(file.fileno(), 2)
        try:
            yield
        finally:
            sys.stderr.flush()
            os.dup2(kept, 2)
            os.close(kept)
            file.seek(0)
            while chunk := file.read(1 << 16):
                os.write(2, chunk)


def _errors_file() -> IO[bytes]:
    try:
        return tempfile.TemporaryFile()
    except OSError:
        # No directory can be written, as on a full disk: the errors are lost.
        return open(os.devnull, 'r+b')


class Keyboard:
    """Reads keys; other threads can :meth:`wake` it."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._woken, self._waker = os.pipe()
        os.set_blocking(self._waker, False)

    def close(self) -> None:
        """Close its pipe."""
        os.close(self._woken)
        os.close(self._waker)

    def wake(self) -> None:
        """Let :meth:`read` return; callable from any thread."""
        with contextlib.suppress(OSError):
            os.write(self._waker, b'\0')

    def read(self, timeout: float, on_end: Callable[[], None]) -> bytes:
        """
        Wait for keys and return their bytes, b'' if none was pressed.

        :param timeout: s.
        :param on_end: called if the terminal is closed.
        """
        ready, _, _ = select.select([self._descriptor, self._woken], [], [], timeout)
        if self._woken in ready:
            os.read(self._woken, 4096)
        if self._descriptor not in ready:
            return b''
        try:
            data = os.read(self._descriptor, 4096)
        except OSError:
            data = b''
        if not data:
            on_end()
        return data
