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

"""Coroutines that wait for conditions and times, without an event loop: time is an argument."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Generator
from dataclasses import dataclass
import math


class Interrupted(BaseException):
    """The run must end now."""


@dataclass
class _Wait:
    condition: Callable[[], object]
    deadline: float

    def __await__(self) -> Generator[_Wait, None, None]:
        yield self


# A coroutine that awaits :class:`_Wait`, directly or through other coroutines.
Main = Coroutine[_Wait, None, None]


class CoroutineRunner:
    """
    Runs one coroutine after another; each awaits :meth:`until` and :meth:`sleep`.

    :ivar now: time of the latest message or poll, s.
    :ivar interrupted: whether :meth:`interrupt` was called.
    :ivar restoring: whether interruption is ignored, because the device is being restored.
    """

    def __init__(self) -> None:
        self.now = 0.0
        self.interrupted = False
        self.restoring = False
        self._main: Main | None = None
        self._wait: _Wait | None = None

    def run(self, main: Main) -> None:
        """Run a coroutine from the next :meth:`advance` on."""
        self._main, self._wait = main, None

    @property
    def running(self) -> bool:
        """Whether the coroutine has not ended."""
        return self._main is not None

    def advance(self, now: float) -> None:
        """Continue the coroutine if its condition holds or its time has come."""
        self.now = now
        while self._main is not None and (
                self._wait is None or now >= self._wait.deadline or self._wait.condition()):
            self._step(lambda main: main.send(None))

    def next_deadline(self) -> float:
        """Return when :meth:`advance` is due, infinity if never."""
        if self._main is None:
            return math.inf
        return self._wait.deadline if self._wait else self.now

    def interrupt(self, now: float) -> None:
        """Raise :class:`Interrupted` in the coroutine, unless it restores the device."""
        self.interrupted = True
        if not self.restoring:
            self.advance(now)
            self._step(lambda main: main.throw(Interrupted()))
            self.advance(now)

    def _step(self, step: Callable[[Main], _Wait]) -> None:
        if self._main is None:
            return
        try:
            self._wait = step(self._main)
        except (StopIteration, Interrupted):
            self._main = self._wait = None

    async def until(self, condition: Callable[[], object], timeout: float) -> bool:
        """
        Wait for a condition, for ``timeout`` s at most, and return whether it holds.

        :raises Interrupted: if the run must end.
        """
        if self.interrupted and not self.restoring:
            raise Interrupted
        await _Wait(condition, self.now + timeout)
        return bool(condition())

    async def sleep(self, seconds: float) -> None:
        """
        Wait for a time, s.

        :raises Interrupted: if the run must end.
        """
        await self.until(lambda: False, seconds)
