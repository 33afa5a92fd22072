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

"""A thread that waits for events and does what others bring to it, and outlives its faults."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
import contextlib
import logging
import math
import selectors
import socket
import threading
from typing import Any

# s; after a fault of ours the loop goes on no faster, and shows no more of them, than this.
FAULT_PAUSE = 0.1
FAULT_LOG_INTERVAL = 1.0

_log = logging.getLogger(__name__)


class Worker(ABC):
    """
    Takes turns in a thread of its own until it is stopped.

    :param clock: s, monotonic.
    """

    def __init__(self, name: str, clock: Callable[[], float]) -> None:
        self.clock = clock
        self._calls: deque[Callable[[float], None]] = deque()
        self._wake_out, self._wake_in = socket.socketpair()
        self._wake_out.setblocking(False)
        self._wake_in.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._wake_out, selectors.EVENT_READ)
        self._stopping = threading.Event()
        self._starting = threading.Lock()
        # s that the next turn is to wait at least: there was a fault.
        self._pause = 0.0
        self._fault_log_due = -math.inf
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    # From any thread

    def start(self) -> None:
        """Start the thread."""
        with self._starting:
            if not self._stopping.is_set():
                self._thread.start()

    def stop(self, timeout: float = 1.0) -> None:
        """
        End the thread; it cannot be started again.

        :param timeout: how long to wait for the thread, s.
        """
        with self._starting:
            self._stopping.set()
            if self._thread.ident is None:
                self._release()
        self._wake()
        if self._thread.is_alive() and threading.current_thread() is not self._thread:
            self._thread.join(timeout)

    def call(self, function: Callable[[float], None]) -> None:
        """Have ``function(now)`` called in the thread, unless that has ended."""
        self._calls.append(function)
        self._wake()

    def _wake(self) -> None:
        # A full buffer has woken the thread already; a closed one has no thread to wake.
        with contextlib.suppress(OSError):
            self._wake_in.send(b'\0')

    # In the thread

    def _run(self) -> None:
        self._begin()
        while not self._stopping.is_set():
            try:
                self._turn()
            except Exception:
                self._show_fault()
                self._stopping.wait(FAULT_PAUSE)
        self._end()
        self._release()

    def _release(self) -> None:
        self._selector.close()
        self._wake_out.close()
        self._wake_in.close()

    def _ready(self, seconds: float) -> list[tuple[Any, int]]:
        """Return what is ready and for which events, waiting for that or for a call."""
        ready = []
        for key, events in self._selector.select(seconds):
            if key.fileobj is self._wake_out:
                with contextlib.suppress(BlockingIOError):
                    self._wake_out.recv(4096)
            else:
                ready.append((key.fileobj, events))
        return ready

    def _unregister_all(self) -> None:
        """Wait for nothing any more but calls."""
        for key in list(self._selector.get_map().values()):
            if key.fileobj is not self._wake_out:
                self._selector.unregister(key.fileobj)

    @abstractmethod
    def _begin(self) -> None:
        """Do what comes before the first turn."""

    @abstractmethod
    def _turn(self) -> None:
        """Wait for events and calls, but no longer than until something is due; do it."""

    @abstractmethod
    def _end(self) -> None:
        """Do what comes after the last turn."""

    def _guarded(self, function: Callable[..., None], *arguments: Any) -> None:
        """Call what is not ours: its fault must not end the thread."""
        try:
            function(*arguments)
        except Exception:
            self._pause = FAULT_PAUSE
            self._show_fault()

    def _show_fault(self) -> None:
        """Log the exception under way, but not again and again."""
        if self.clock() >= self._fault_log_due:
            self._fault_log_due = self.clock() + FAULT_LOG_INTERVAL
            _log.exception('internal error in the link')

    def _run_calls(self) -> None:
        for _ in range(len(self._calls)):
            self._guarded(self._calls.popleft(), self.clock())
