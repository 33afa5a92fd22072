# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The orderly end of a process within a time limit, on each signal that would end it."""

from __future__ import annotations

import atexit
from collections.abc import Callable
import contextlib
import math
import os
import signal
import sys
import threading
import time
from typing import NoReturn

from .output_queue import OutputQueue

# The signals that end a process by default: SIGQUIT of a terminal (Ctrl-\\), SIGUSR1 of a script,
# SIGABRT of a watchdog ... Where one is the fault of the process itself, the kernel ends the
# process although it is blocked.
ENDING = frozenset({signal.SIGINT, signal.SIGTERM, *(
    one for one in signal.valid_signals() if signal.getsignal(one) == signal.SIG_DFL)}) - {
        signal.SIGKILL, signal.SIGSTOP, signal.SIGCONT, signal.SIGTSTP, signal.SIGTTIN,
        signal.SIGTTOU, signal.SIGCHLD, signal.SIGURG, signal.SIGWINCH}
# s from the signal to the exit, even if something hangs.
LIMIT = 0.85
# s in which queued output must be written: at an exit without a signal, since a busy machine may
# need more than 0.1 s; the least time after an orderly end by a signal; and after an end that
# hangs.
OUTPUT_LIMIT = 1.0
HURRIED_OUTPUT_LIMIT = 0.1
OVERDUE_OUTPUT_LIMIT = 0.02


class Termination:
    """
    Takes signals from its construction on: construct it before any slow import.

    A handler would run in the main thread between any two instructions: an exception there breaks
    imports and is printed by destructors, and C code that waits sees no flag. So the signals are
    blocked in this thread and in the threads that it starts, and one thread waits for them.

    A signal that is ignored is left ignored, as SIGHUP is under nohup, except SIGINT and SIGTERM.

    :ivar is_terminal: whether stderr leads to a terminal.
    """

    def __init__(self) -> None:
        signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)
        self.is_terminal = sys.stderr is not None and sys.stderr.isatty()
        self._output: OutputQueue | None = None
        self._lock = threading.Lock()
        self._end: Callable[[], object] | None = None
        self._last: Callable[[], object] | None = None
        self._signalled = False
        # When the process must have ended, s.
        self._deadline = math.inf
        atexit.register(self._write_output, OUTPUT_LIMIT)
        threading.Thread(target=self._wait, name='termination', daemon=True).start()

    def calls(self, end: Callable[[], object], last: Callable[[], object] | None = None) -> None:
        """
        Call ``end()`` on the first signal; without it a signal ends the process at once.

        It is called in another thread; the process ends within the limit even if it hangs.

        :param last: called before the exit if ``end`` hangs; must be quick.
        """
        with self._lock:
            self._end, self._last = end, last
            signalled = self._signalled
        if signalled:
            end()

    def queue_output(self, *descriptors: int) -> None:
        """Have descriptors written to through an :class:`OutputQueue`; call this once."""
        self._output = OutputQueue(*descriptors)

    def finish(self) -> None:
        """
        Exit if a signal has requested it; call this when all parts have ended.

        An exit by the interpreter and the middleware takes 0.1 s, on a busy machine much longer,
        and no thread could then enforce the limit.
        """
        if self._signalled:
            self._exit(max(self._deadline - time.monotonic() - HURRIED_OUTPUT_LIMIT,
                           HURRIED_OUTPUT_LIMIT))

    def _wait(self) -> None:
        signal.sigwait(ENDING)
        with self._lock:
            self._deadline = time.monotonic() + LIMIT
            self._signalled = True
            end = self._end
        # Without ``end`` nothing has been started.
        if end is not None:
            # In another thread, so that the deadline applies whatever ``end`` waits for.
            _run_in_thread(end)
            time.sleep(max(self._deadline - time.monotonic(), 0.0))
            if self._last is not None:
                with contextlib.suppress(Exception):
                    self._last()
        self._exit(OVERDUE_OUTPUT_LIMIT)

    def _exit(self, output_limit: float) -> NoReturn:
        self._write_output(output_limit)
        os._exit(0)

    def _write_output(self, limit: float) -> None:
        until = time.monotonic() + limit
        # In another thread: a thread that is blocked in a write holds the lock of the stream.
        flushing = _run_in_thread(_flush)
        if flushing is not None:
            flushing.join(limit)
        if self._output is not None:
            self._output.finish(max(until - time.monotonic(), OVERDUE_OUTPUT_LIMIT))


def _run_in_thread(function: Callable[[], object]) -> threading.Thread | None:
    """Call a function in a new thread or, if no thread can be started, in this one."""
    thread = threading.Thread(target=function, name='end', daemon=True)
    try:
        thread.start()
    except RuntimeError:
        function()
        return None
    return thread


def _flush() -> None:
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(Exception):
            stream.flush()
