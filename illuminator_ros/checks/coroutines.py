# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Coroutines that wait for conditions and times, without an event loop: time is an argument."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Generator
import math
import types
from typing import NamedTuple

from ..mavlink.schedule import Schedule


class Interrupted(BaseException):
    """The run must end now."""


class _Wait(NamedTuple):
    condition: Callable[[], object]
    deadline: float


# A coroutine that waits only by a :class:`CoroutineRunner`.
Main = Coroutine[_Wait, None, None]


@types.coroutine
def _suspend(wait: _Wait) -> Generator[_Wait, None, None]:
    yield wait


class CoroutineRunner:
    """
    Runs one coroutine after another; each awaits :meth:`until` and :meth:`sleep`.

    :param schedule: of the link, which calls :meth:`advance`.
    :ivar now: time of the latest message or poll, s.
    :ivar interrupted: whether :meth:`interrupt` was called.
    :ivar restoring: whether interruption is ignored, because the device is being restored.
    """

    def __init__(self, schedule: Schedule) -> None:
        self.now = 0.0
        self.interrupted = False
        self.restoring = False
        self._schedule = schedule
        self._main: Main | None = None
        self._wait = _Wait(lambda: True, 0.0)

    def run(self, main: Main) -> None:
        """Run a coroutine from the next :meth:`advance` on."""
        self._main, self._wait = main, _Wait(lambda: True, self.now)
        self._schedule.at(self.advance, self.now)

    @property
    def running(self) -> bool:
        """Whether the coroutine has not ended."""
        return self._main is not None

    def advance(self, now: float) -> None:
        """Continue the coroutine if its condition holds or its time has come."""
        self.now = now
        while self._main is not None and (
                now >= self._wait.deadline or self._wait.condition()
                or self.interrupted and not self.restoring):
            try:
                self._wait = self._main.send(None)
            except (StopIteration, Interrupted):
                self._main = None
        self._schedule.at(
            self.advance, math.inf if self._main is None else self._wait.deadline)

    def interrupt(self, now: float) -> None:
        """Raise :class:`Interrupted` in the coroutine, unless it restores the device."""
        self.interrupted = True
        self.advance(now)

    async def until(self, condition: Callable[[], object], timeout: float) -> bool:
        """
        Wait for a condition, for ``timeout`` s at most, and return whether it holds.

        :raises Interrupted: if the run must end.
        """
        if not self.interrupted or self.restoring:
            await _suspend(_Wait(condition, self.now + timeout))
        if self.interrupted and not self.restoring:
            raise Interrupted
        return bool(condition())

    async def sleep(self, seconds: float) -> None:
        """
        Wait for a time, s.

        :raises Interrupted: if the run must end.
        """
        await self.until(lambda: False, seconds)
