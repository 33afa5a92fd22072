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

"""Ending a process in order, and in time, on SIGINT and SIGTERM."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import os
import signal
import sys
import threading
import time
from typing import NoReturn

SIGNALS = (signal.SIGINT, signal.SIGTERM)
# s from the signal to the exit, whatever hangs.
LIMIT = 0.95


class Termination:
    """
    Takes SIGINT and SIGTERM from its construction on: make it before anything slow is imported.

    A handler would run in the main thread between any two instructions, where an exception ends
    half-done imports and is printed by destructors, and a flag is not seen while C code waits.
    So the signals are blocked, in this thread and all that it starts, and one thread waits for
    them.
    """

    def __init__(self) -> None:
        signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
        self._lock = threading.Lock()
        self._end: Callable[[], None] | None = None
        self._signalled = False
        threading.Thread(target=self._wait, name='termination', daemon=True).start()

    def calls(self, end: Callable[[], None]) -> None:
        """
        Have ``end()`` called on a signal, once; until now one would have ended the process.

        It is called in another thread, and the process ends soon after it even if it hangs.
        """
        with self._lock:
            self._end = end
            signalled = self._signalled
        if signalled:
            end()

    def finish(self) -> None:
        """
        Exit if a signal has asked for it; all is ended that has to be.

        What the interpreter and the middleware do at an exit takes 0.1 s or, on a busy machine,
        much longer, and nothing runs any more that could cut it short.
        """
        if self._signalled:
            _exit()

    def _wait(self) -> None:
        signal.sigwait(SIGNALS)
        with self._lock:
            self._signalled = True
            end = self._end
        # Before that nothing has been begun that would have to be ended.
        if end is not None:
            # Not here: whatever it may wait for, the time runs.
            threading.Thread(target=end, name='end', daemon=True).start()
            time.sleep(LIMIT)
        _exit()


def _exit() -> NoReturn:
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(Exception):
            stream.flush()
    os._exit(0)
