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

"""CommandStatus a process in order, and in time, on SIGINT, SIGTERM and SIGHUP."""

from __future__ import annotations

from collections.abc import Callable, Iterable
import contextlib
import os
import signal
import sys
import threading
import time
from typing import NoReturn

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
# s from the signal to the exit, whatever hangs.
LIMIT = 0.95


class Termination:
    """
    Takes signals from its construction on: make it before anything slow is imported.

    A handler would run in the main thread between any two instructions, where an exception ends
    half-done imports and is printed by destructors, and a flag is not seen while C code waits.
    So the signals are blocked, in this thread and all that it starts, and one thread waits for
    them.

    :param more: signals beside SIGINT, SIGTERM and SIGHUP. Under nohup SIGHUP is left ignored.
    """

    def __init__(self, more: Iterable[signal.Signals] = ()) -> None:
        # Blocked, it would be waited for although it is ignored.
        ignored = {signal.SIGHUP} if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN else set()
        self._signals = {*SIGNALS, *more} - ignored
        signal.pthread_sigmask(signal.SIG_BLOCK, self._signals)
        self._lock = threading.Lock()
        self._end: Callable[[], None] | None = None
        self._last: Callable[[], None] | None = None
        self._signalled = False
        threading.Thread(target=self._wait, name='termination', daemon=True).start()

    def calls(self, end: Callable[[], None], last: Callable[[], None] | None = None) -> None:
        """
        Have ``end()`` called on a signal, once; until now one would have ended the process.

        It is called in another thread, and the process ends soon after it even if it hangs.

        :param last: called before that if it hangs; is to be quick.
        """
        with self._lock:
            self._end, self._last = end, last
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
        signal.sigwait(self._signals)
        with self._lock:
            self._signalled = True
            end = self._end
        # Before that nothing has been begun that would have to be ended.
        if end is not None:
            # Not here: whatever it may wait for, the time runs.
            threading.Thread(target=end, name='end', daemon=True).start()
            time.sleep(LIMIT)
            if self._last is not None:
                with contextlib.suppress(Exception):
                    self._last()
        _exit()


def _exit() -> NoReturn:
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(Exception):
            stream.flush()
    os._exit(0)
