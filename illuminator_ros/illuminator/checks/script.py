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

"""
An endpoint that does what a coroutine says. No I/O; time is passed in.

There is no event loop: the coroutine waits for a condition or a time, and goes on when a message
or the time has come. So a run against a simulated light needs no real time.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Generator
from dataclasses import dataclass
import math
from typing import Any

from ...mavlink.component import Endpoint


class Interrupted(BaseException):
    """The run is to end now."""


@dataclass
class _Wait:
    condition: Callable[[], Any]
    deadline: float

    def __await__(self) -> Generator[_Wait, None, None]:
        yield self


class Script(Endpoint):
    """
    Runs a coroutine that awaits :meth:`until`, :meth:`more` and :meth:`sleep`.

    :ivar now: the time, s, as the coroutine sees it.
    :ivar tidying: whether it is bringing back what was, and is not to be interrupted.
    """

    def __init__(self) -> None:
        super().__init__()
        self.now = 0.0
        self.tidying = False
        self._began: float | None = None
        self._main: Coroutine[_Wait, None, None] | None = None
        self._wait: _Wait | None = None

    def run(self, main: Coroutine[Any, Any, None]) -> None:
        """Have a coroutine run from the next poll on."""
        self._main = main

    @property
    def running(self) -> bool:
        """Whether the coroutine has not ended."""
        return self._main is not None

    @property
    def elapsed(self) -> float:
        """Return the time since anything happened first, s."""
        return self.now - (self._began or 0.0)

    def poll(self, now: float) -> None:
        """See :meth:`Endpoint.poll`."""
        self._at(now)
        self._advance()

    def next_deadline(self) -> float:
        """See :meth:`Endpoint.next_deadline`."""
        if self._main is None:
            return math.inf
        return self._wait.deadline if self._wait else self.now

    def interrupt(self, now: float) -> None:
        """End the run, unless it is tidying up already."""
        if self.tidying:
            return
        self._at(now)
        self._advance()
        if self._main is not None:
            self._step(lambda main: main.throw(Interrupted()))
            self._advance()

    def _at(self, now: float) -> None:
        self._began = now if self._began is None else self._began
        self.now = now

    def _advance(self) -> None:
        while self._main is not None and (
                self._wait is None or self.now >= self._wait.deadline or self._wait.condition()):
            self._step(lambda main: main.send(None))

    def _step(self, step: Callable[[Coroutine[_Wait, None, None]], _Wait]) -> None:
        assert self._main is not None
        try:
            self._wait = step(self._main)
        except (StopIteration, Interrupted):
            self._main = self._wait = None

    async def until(self, condition: Callable[[], Any], timeout: float) -> bool:
        """Wait until something is so, s at most; return whether it is."""
        await _Wait(condition, self.now + timeout)
        return bool(condition())

    async def more(self, came: list[Any], before: int, timeout: float) -> bool:
        """Wait until there are more than there were before; return whether there are."""
        return await self.until(lambda: len(came) > before, timeout)

    async def sleep(self, seconds: float) -> None:
        """Let time pass."""
        await _Wait(lambda: False, self.now + seconds)
