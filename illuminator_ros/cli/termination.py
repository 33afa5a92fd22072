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

"""Ending a process in order, and in time, on SIGINT, SIGTERM and SIGHUP."""

from __future__ import annotations

import atexit
from collections.abc import Callable, Iterable
import contextlib
import os
import signal
import sys
import threading
import time
from typing import NoReturn

from .output import OutputQueue

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
# s from the signal to the exit, whatever hangs.
LIMIT = 0.95
# s in which queued output must be written: at an exit in order, and at one that is overdue.
OUTPUT_LIMIT = 0.1
OVERDUE_OUTPUT_LIMIT = 0.02


class Termination:
    """
    Takes signals from its construction on: make it before anything slow is imported.

    A handler would run in the main thread between any two instructions, where an exception ends
    half-done imports and is printed by destructors, and a flag is not seen while C code waits.
    So the signals are blocked, in this thread and all that it starts, and one thread waits for
    them.

    :param more: signals beside SIGINT, SIGTERM and SIGHUP. Under nohup SIGHUP is left ignored.
    :param queued: descriptors that are written to through an :class:`OutputQueue`.
    """

    def __init__(
        self, more: Iterable[signal.Signals] = (), queued: Iterable[int] = (),
    ) -> None:
        # sigwait() would return it, blocked, although it is ignored.
        ignored = {signal.SIGHUP} if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN else set()
        self._signals = {*SIGNALS, *more} - ignored
        signal.pthread_sigmask(signal.SIG_BLOCK, self._signals)
        self._output = OutputQueue(*queued)
        self._lock = threading.Lock()
        self._end: Callable[[], None] | None = None
        self._last: Callable[[], None] | None = None
        self._signalled = False
        atexit.register(self._write_output, OUTPUT_LIMIT)
        threading.Thread(target=self._wait, name='termination', daemon=True).start()

    def calls(self, end: Callable[[], None], last: Callable[[], None] | None = None) -> None:
        """
        Have ``end()`` called on a signal, once; until now one would have ended the process.

        It is called in another thread, and the process ends soon after it even if it hangs.

        :param last: called before that if it hangs; must be quick.
        """
        with self._lock:
            self._end, self._last = end, last
            signalled = self._signalled
        if signalled:
            end()

    def finish(self) -> None:
        """
        Exit if a signal has asked for it; everything that must be ended has ended.

        The interpreter and the middleware take 0.1 s for an exit or, on a busy machine, much
        longer, and no thread runs any more that could cut it short.
        """
        if self._signalled:
            self._exit(OUTPUT_LIMIT)

    def _wait(self) -> None:
        signal.sigwait(self._signals)
        deadline = time.monotonic() + LIMIT
        with self._lock:
            self._signalled = True
            end = self._end
        # Before that nothing has been begun that would have to be ended.
        if end is not None:
            # In another thread, so that the deadline applies whatever it waits for.
            _run_in_thread(end)
            time.sleep(max(deadline - time.monotonic(), 0.0))
            if self._last is not None:
                with contextlib.suppress(Exception):
                    self._last()
        self._exit(OVERDUE_OUTPUT_LIMIT)

    def _exit(self, output_limit: float) -> NoReturn:
        self._write_output(output_limit)
        os._exit(0)

    def _write_output(self, limit: float) -> None:
        # In another thread: one that is blocked in a write holds the lock of the stream.
        flushing = _run_in_thread(_flush)
        if flushing is not None:
            flushing.join(limit)
        self._output.finish(limit)


def _run_in_thread(function: Callable[[], None]) -> threading.Thread | None:
    """Call a function in a new thread or, where none can be started, here."""
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
