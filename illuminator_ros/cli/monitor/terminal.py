# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The monitor on a terminal: stopping and continuing, closing, errors of the middleware."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
import contextlib
import os
import signal
import sys
import termios
import time
from typing import Any

from textual.driver import Driver
from textual.drivers.linux_driver import LinuxDriver

from .app import MonitorApp


class TerminalDriver(LinuxDriver):
    """Textual's terminal, written on stdout: the middleware writes its errors on stderr."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        assert sys.__stdout__ is not None
        self._file = sys.__stdout__
        # Textual would start again although it has not stopped.
        signal.signal(signal.SIGCONT, signal.SIG_DFL)

    def run_input_thread(self) -> None:
        """See :meth:`LinuxDriver.run_input_thread`; go on after bytes that are not UTF-8."""
        while not self.exit_event.is_set():
            with contextlib.suppress(UnicodeDecodeError):
                super().run_input_thread()


class TerminalApp(MonitorApp):
    """The monitor on the terminal at stdin."""

    def get_driver_class(self) -> type[Driver]:
        """See :meth:`App.get_driver_class`."""
        return TerminalDriver

    def on_mount(self) -> None:
        """Take SIGTSTP."""
        asyncio.get_running_loop().add_signal_handler(
            signal.SIGTSTP, self.action_suspend_process)

    def poll(self) -> None:
        """See :meth:`MonitorApp.poll`; end when the terminal has been closed."""
        if os.isatty(0):
            super().poll()
        else:
            self.exit()

    def action_suspend_process(self) -> None:
        """Stop the job, with "ros2 run", until a shell continues it in the foreground."""
        with self.suspend():
            handler = signal.signal(signal.SIGTSTP, signal.SIG_DFL)
            os.kill(0, signal.SIGTSTP)
            signal.signal(signal.SIGTSTP, handler)
            with contextlib.suppress(OSError):
                # "bg" continues it without the terminal. A signal still ends it.
                while os.tcgetpgrp(0) != os.getpgrp():
                    time.sleep(0.1)

    def restore(self) -> None:
        """See :meth:`MonitorApp.restore`."""
        if isinstance(self._driver, TerminalDriver) and self._driver.attrs_before is not None and (
                os.tcgetpgrp(0) == os.getpgrp()):
            termios.tcsetattr(0, termios.TCSANOW, self._driver.attrs_before)


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
        # The terminal may have been closed.
        with contextlib.suppress(OSError):
            while chunk := os.read(file, 1 << 16):
                os.write(2, chunk)
