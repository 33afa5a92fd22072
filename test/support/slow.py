# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
A slow clock, which several processes share.

Lights and bridges of the tests use this clock, so that a pause of the machine for a second does
not cause a time-out. A test that needs a time-out sets the clock forward.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
import contextlib
import fcntl
import mmap
import os
from pathlib import Path
import selectors
import threading
import time
from typing import Any

from illuminator_ros.mavlink.link import Link
from support.waiting import eventually

# s of this clock in one real s.
SPEED = 0.05
# Real s after which a sleeping link looks at the clock again: it may have been set forward.
LOOK_INTERVAL = 0.05
# s; the initial time: not 0, so that a wrong use of 0 as a time shows.
START = 1000.0
VARIABLE = 'ILLUMINATOR_ROS_TEST_CLOCK'
# Links that use the clock at a time.
LINKS = 256
# Bytes of a number in the file.
SIZE = 8


class SlowClock:
    """
    A clock that all processes with the same file share.

    The file has the time by which the clock was set forward, and for each link a process id, 0
    for none, and the time up to which the link has done its work.

    :ivar path: the path of the file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock = threading.Lock()
        self._file = path.open('r+b')
        mapped = memoryview(mmap.mmap(self._file.fileno(), SIZE * (1 + 2 * LINKS))).cast('d')
        self._ahead, self._pids, self._done = (
            mapped[:1], mapped[1:1 + LINKS], mapped[1 + LINKS:])

    def __call__(self) -> float:
        return START + time.monotonic() * SPEED + self._ahead[0]

    @property
    def ahead(self) -> float:
        """Return the time by which it was set forward, s."""
        return self._ahead[0]

    def forward(self, seconds: float) -> None:
        """Let time pass, s of this clock."""
        self._ahead[0] += seconds

    def step(self, seconds: float) -> None:
        """Let time pass if all links have done their work since the clock was set forward."""
        with self._locked():
            if self.is_caught_up():
                self.forward(seconds)

    @property
    def environment(self) -> Mapping[str, str]:
        """Return the environment variables that give another process this clock."""
        return {VARIABLE: str(self.path)}

    @contextlib.contextmanager
    def _locked(self) -> Iterator[None]:
        # A file lock belongs to the whole process.
        with self._lock:
            fcntl.lockf(self._file, fcntl.LOCK_EX)
            try:
                yield
            finally:
                fcntl.lockf(self._file, fcntl.LOCK_UN)

    def add_link(self) -> int:
        """Return the number of one more link."""
        with self._locked():
            number = next(
                number for number, pid in enumerate(self._pids) if not _runs(int(pid)))
            self._done[number] = self.ahead
            self._pids[number] = os.getpid()
        return number

    def remove_link(self, number: int) -> None:
        """Wait for this link no longer."""
        self._pids[number] = 0

    def work_done(self, number: int, ahead: float) -> None:
        """Note the time up to which a link has done its work."""
        self._done[number] = ahead

    def is_caught_up(self) -> bool:
        """Return whether all links have done their work since the clock was set forward."""
        return all(done >= self.ahead or not _runs(int(pid))
                   for pid, done in zip(self._pids, self._done, strict=True))


def _runs(pid: int) -> bool:
    """Return whether a process runs; a zombie does not."""
    if pid in (0, os.getpid()):
        return pid != 0
    with contextlib.suppress(OSError):
        return Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[0] not in 'ZX'
    return False


def _open_clock() -> SlowClock:
    if path := os.environ.get(VARIABLE):
        return SlowClock(Path(path))
    # A file in memory, which ends with the last process that has it open.
    descriptor = os.memfd_create('clock of tests')
    os.ftruncate(descriptor, SIZE * (1 + 2 * LINKS))
    return SlowClock(Path(f'/proc/{os.getpid()}/fd/{descriptor}'))


CLOCK = _open_clock()


def pass_time_until(condition: Callable[[], Any], step: float = 1.0) -> None:
    """
    Let time pass until a condition holds.

    A step is over when all links have done the work that was due in it, and have received the
    frames that were sent before it. So a frame takes one step at most, however busy the machine
    is; a step must be shorter than any limit that must hold.
    """
    def passed() -> Any:
        if not (result := condition()):
            CLOCK.step(step)
        return result

    eventually(passed, 'what time was to bring')


@contextlib.contextmanager
def time_passes() -> Iterator[None]:
    """Let time pass meanwhile, as fast as all links do the work that is due in it."""
    ended = threading.Event()

    def run() -> None:
        while not ended.wait(0.01):
            # Shorter than any limit that must hold, see pass_time_until.
            CLOCK.step(0.2)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


class _SlowSelector(selectors.DefaultSelector):
    """Waits for real time in place of slow time, and notes in the clock that a link waits."""

    def __init__(self) -> None:
        super().__init__()
        self._number: int | None = None
        self._ahead = CLOCK.ahead

    def select(self, timeout: float | None = None) -> Any:
        if self._number is None:
            self._number = CLOCK.add_link()
        CLOCK.work_done(self._number, self._ahead)
        seconds = LOOK_INTERVAL if timeout is None else timeout / SPEED
        found = super().select(min(seconds, LOOK_INTERVAL))
        if self._ahead != CLOCK.ahead:
            self._ahead = CLOCK.ahead
            # Frames sent before the clock was set forward may have come after the first look.
            found = super().select(0)
        return found

    def close(self) -> None:
        if self._number is not None:
            CLOCK.remove_link(self._number)
        super().close()


class SlowLink(Link):
    """A link that uses the slow clock."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, clock=CLOCK, selector=_SlowSelector(), **named)
