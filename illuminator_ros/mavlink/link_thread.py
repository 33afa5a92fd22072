# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The thread that owns a link: one selector, the calls of other threads, and deadlines."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
import contextlib
import logging
import math
import random
import select
import selectors
import socket
import threading
import time

# s; the longest wait.
MAX_WAIT = 10.0
# s after which a turn begins no more messages and calls, so that the deadlines have their turn.
TURN_TIME = 0.001
# Calls that wait; another thread with one more waits for room, for this time at most, s, since
# this thread may hang.
MAX_CALLS = 2
ROOM_TIMEOUT = 0.25
# s; the pause of a loop after an exception, and the shortest time between log lines.
FAULT_PAUSE = 0.1
FAULT_LOG_INTERVAL = 1.0
# s by which a wait may be longer than intended before the process counts as stopped meanwhile.
STALL_TIME = 2.0

_log = logging.getLogger(__name__)


class FaultLog:
    """
    Logs exceptions of the functions that a loop calls.

    :ivar pause: the shortest next wait of the loop, s, so that a lasting fault does not use up
        the processor.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self.pause = 0.0
        self._clock = clock
        self._due = -math.inf

    def call(self, function: Callable[..., None], *arguments: object) -> None:
        """Call a function; log its exception."""
        try:
            function(*arguments)
        except Exception:
            self.pause = FAULT_PAUSE
            self.log()

    def log(self) -> None:
        """Log the exception that is handled."""
        if self._clock() >= self._due:
            self._due = self._clock() + FAULT_LOG_INTERVAL
            _log.exception('internal error in the link')


class Waker:
    """Ends the wait of a thread from other threads."""

    def __init__(self) -> None:
        self._read, self._write = socket.socketpair()
        self._read.setblocking(False)
        self._write.setblocking(False)
        self._poll = select.poll()
        self._poll.register(self._read, select.POLLIN)

    def fileno(self) -> int:
        """Return the descriptor that is ready to be read after a call of :meth:`wake`."""
        return self._read.fileno()

    def wake(self) -> None:
        """End the wait; callable from any thread."""
        # A full buffer has woken the thread already; a closed one has no thread to wake.
        with contextlib.suppress(OSError):
            self._write.send(b'\0')

    def wait(self, seconds: float) -> None:
        """Wait to be woken."""
        self._poll.poll(1000 * seconds)

    def clear(self) -> None:
        """Be ready for the next wait."""
        with contextlib.suppress(BlockingIOError):
            self._read.recv(4096)

    def close(self) -> None:
        """Free the descriptors."""
        self._read.close()
        self._write.close()


class StallDetector:
    """
    Detects that the process was stopped (SIGSTOP, docker pause).

    :param monotonic: s, the machine's own clock.
    """

    def __init__(self, monotonic: Callable[[], float]) -> None:
        self._monotonic = monotonic
        self._woken_at = monotonic()

    def waited(self, seconds: float) -> float:
        """
        Note the end of a wait.

        :param seconds: the longest time that it should have taken.
        :return: s for which the process was stopped, 0 if it was not.
        """
        before, self._woken_at = self._woken_at, self._monotonic()
        stall = self._woken_at - before - seconds
        return stall if stall > STALL_TIME else 0.0


class LinkThread:
    """
    Waits for descriptors, calls and deadlines, and handles each in this thread.

    No number of calls delays frames and deadlines: a turn begins no call after its time, except
    its first one, and other threads that call too often wait.

    :param work: called after each wait; returns when it must be called again, s.
    :param finish: called at the end.
    :param stalled: called with s for which the process was stopped, before the calls that wait.
    :param clock: s, monotonic.
    :param monotonic: s, the machine's own clock, which shows such a stop.
    :ivar selector: the ``data`` of its keys is a function, called with the object that is ready
        and its events.
    """

    def __init__(
        self, work: Callable[[], float], finish: Callable[[], None],
        faults: FaultLog, clock: Callable[[], float],
        selector: selectors.BaseSelector | None = None, *,
        stalled: Callable[[float], None] = lambda seconds: None,
        monotonic: Callable[[], float] = time.monotonic,
    ) -> None:
        self.selector = selector or selectors.DefaultSelector()
        self._work = work
        self._finish = finish
        self._faults = faults
        self._clock = clock
        self._stalled = stalled
        self._due = 0.0
        self._detector = StallDetector(monotonic)
        # When the turn begins no more messages and calls, s.
        self._turn_ends = math.inf
        self._calls: deque[Callable[[float], None]] = deque()
        # Set while few calls wait.
        self._room = threading.Event()
        self._room.set()
        self._waker = Waker()
        self.selector.register(
            self._waker, selectors.EVENT_READ, lambda waker, events: waker.clear())
        self._stopping = threading.Event()
        self._starting = threading.Lock()
        self._thread = threading.Thread(target=self._run, name='mavlink-link', daemon=True)

    # From any thread

    def start(self) -> None:
        """
        Start the thread.

        :raises RuntimeError: if that fails; it may be tried again.
        """
        with self._starting:
            if not self._stopping.is_set():
                self._thread.start()

    def stop(self, timeout: float) -> None:
        """
        End the thread; it cannot be started again.

        :param timeout: how long to wait for the thread, s.
        """
        with self._starting:
            self._stopping.set()
            if self._thread.ident is None:
                self._release()
        self._waker.wake()
        if self._thread.is_alive() and threading.current_thread() is not self._thread:
            self._thread.join(timeout)

    def is_running(self) -> bool:
        """Return whether the thread runs."""
        return self._thread.is_alive()

    def call(self, function: Callable[[float], None]) -> None:
        """
        Have ``function(now)`` called in this thread, unless the thread has ended.

        Another thread waits first while :data:`MAX_CALLS` calls wait.
        """
        if threading.current_thread() is not self._thread and self._thread.is_alive():
            self._room.wait(ROOM_TIMEOUT)
        self._calls.append(function)
        if len(self._calls) >= MAX_CALLS:
            # The thread wakes after this, and sets it again.
            self._room.clear()
        self._waker.wake()

    def call_first(self, function: Callable[[float], None]) -> None:
        """Have ``function(now)`` called in this thread, before the calls that wait."""
        self._calls.appendleft(function)
        self._waker.wake()

    # In this thread

    def pause(self, seconds: float) -> None:
        """Wait for calls only, if that takes 1 ms at least: poll() cannot wait for less."""
        if seconds >= 0.001 and not self._calls:
            self._waker.wait(seconds)

    def defer(self, function: Callable[[float], None]) -> bool:
        """
        Have ``function(now)`` called first in the next turn, if this turn is over.

        :return: whether it is.
        """
        is_over = self._clock() >= self._turn_ends
        if is_over:
            self.call_first(function)
        return is_over

    def run_once(self) -> None:
        """Wait once, and handle everything that is ready or due."""
        wait = max(self._due - self._clock(), self._faults.pause) if not self._calls else 0.0
        self._faults.pause = 0.0
        # A stop of the process (SIGSTOP, docker pause) interrupts the wait, which then finds
        # nothing. Frames that came meanwhile precede the deadlines that have passed.
        ready = self.selector.select(min(wait, MAX_WAIT)) or self.selector.select(0)
        self._turn_ends = self._clock() + TURN_TIME
        if stall := self._detector.waited(min(max(wait, 0.0), MAX_WAIT)):
            self._faults.call(self._stalled, stall)
        # A selector returns them in the same order each time: by chance each is the first one, so
        # that none of them waits for ever for others that are always ready.
        first = random.randrange(len(ready)) if len(ready) > 1 else 0
        for key, events in ready[first:] + ready[:first]:
            key.data(key.fileobj, events)
            if self._clock() >= self._turn_ends:
                break
        self._make_calls()
        self._due = self._work()

    def _make_calls(self) -> None:
        """Make the calls that wait, until the turn is over."""
        for _ in range(len(self._calls)):
            self._faults.call(self._calls.popleft(), self._clock())
            if self._clock() >= self._turn_ends:
                break
        if len(self._calls) < MAX_CALLS:
            self._room.set()

    def _run(self) -> None:
        while not self._stopping.is_set():
            try:
                self.run_once()
            except Exception:
                self._faults.log()
                self._stopping.wait(FAULT_PAUSE)
        self._turn_ends = math.inf
        self._make_calls()
        self._faults.call(self._finish)
        self._release()

    def _release(self) -> None:
        self.selector.close()
        self._waker.close()
