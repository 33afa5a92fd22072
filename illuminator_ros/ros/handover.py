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

"""Handing requests from ROS callbacks to the link's thread, and the answers back."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
import threading
import time
from typing import Any, Generic, TypeVar

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future

from ..mavlink.link import Link

T = TypeVar('T')

# s for which the executor itself stands still for an answer. Going to sleep and being woken
# costs it more than a light on a fast link needs to answer.
PATIENCE = 0.002
# s for which the link's thread then stands back, so that the answer is on its way before what
# else a status brings with it: two threads of Python do not run at once.
COURTESY = 0.001


class Newest(Generic[T]):
    """
    Does what a topic asks for, one after the other: of what comes meanwhile only the newest.

    For callbacks of one executor's thread.

    :param do: does it, and returns when it is done.
    """

    def __init__(self, do: Callable[[T], Awaitable[None]]) -> None:
        self._do = do
        self._wanted: list[T] = []
        self._doing = False

    async def want(self, value: T) -> None:
        """Have a value done, unless a newer one overtakes it."""
        self._wanted[:] = [value]
        if self._doing:
            return
        self._doing = True
        try:
            while self._wanted:
                await self._do(self._wanted.pop())
        finally:
            self._doing = False


class _Meeting:
    """Of the executor, which may wait for an answer on the spot, and the link's thread."""

    def __init__(self) -> None:
        self._arrived = threading.Lock()
        self._resumed = threading.Lock()
        # Taken by the one that comes first: the answer, or the executor's turning away.
        self._decided = threading.Lock()
        self._arrived.acquire()
        self._resumed.acquire()

    def wait(self, seconds: float) -> None:
        """Wait for the answer, or turn away from it, in the executor's thread."""
        if not self._arrived.acquire(timeout=seconds):
            self._decided.acquire(blocking=False)
        self._resumed.release()

    def arrive(self) -> bool:
        """Bring the answer, in the link's thread; return whether it was waited for."""
        self._arrived.release()
        if not self._decided.acquire(blocking=False):
            return False
        self._resumed.acquire(timeout=COURTESY)
        return True


class Handover(Generic[T]):
    """
    Lets a coroutine on the executor wait for what happens in the link's thread.

    While it waits, other callbacks go on: each has a callback group in which others may run.
    Only where the last answer came within :data:`PATIENCE` is the next awaited on the spot for
    that long.
    """

    def __init__(self, node: Node, link: Link) -> None:
        self._link = link
        self._patient = True
        self.group = ReentrantCallbackGroup()
        # Completing an rclpy future from another thread does not wake an executor (rclpy before
        # 7.1.9), a guard condition does.
        self._guard = node.create_guard_condition(lambda: None, self.group)

    async def ask(self, request: Callable[[float, Callable[[T], None]], None]) -> T:
        """
        Have ``request(now, answer)`` called in the link's thread and return what it answers.

        The request must answer exactly once, then or later; if it fails, so does this.
        """
        future: Any = Future()
        meeting = _Meeting()

        def arrive() -> None:
            if not meeting.arrive():
                self._guard.trigger()

        def answer(value: T) -> None:
            future.set_result(value)
            arrive()

        def run(now: float) -> None:
            try:
                request(now, answer)
            except Exception as error:
                future.set_exception(error)
                arrive()

        asked = time.monotonic()
        self._link.call(run)
        meeting.wait(PATIENCE if self._patient else 0.0)
        result: T = await future
        self._patient = time.monotonic() - asked < PATIENCE
        return result
