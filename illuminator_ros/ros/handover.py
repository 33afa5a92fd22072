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

from collections.abc import Callable
from typing import Any, Generic, TypeVar

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future

from ..mavlink.link import Link

T = TypeVar('T')


class Handover(Generic[T]):
    """
    Lets a coroutine on the executor wait for what happens in the link's thread.

    Completing an rclpy future from another thread does not wake an executor (rclpy before
    7.1.9), a guard condition does. While a callback waits, nothing else does: each has a
    callback group in which others may run.
    """

    def __init__(self, node: Node, link: Link) -> None:
        self._link = link
        self.group = ReentrantCallbackGroup()
        self._guard = node.create_guard_condition(lambda: None, self.group)

    async def ask(self, request: Callable[[float, Callable[[T], None]], None]) -> T:
        """
        Have ``request(now, answer)`` called in the link's thread and return what it answers.

        The request must answer exactly once, then or later; if it fails, so does this.
        """
        future: Any = Future()

        def answer(value: T) -> None:
            future.set_result(value)
            self._guard.trigger()

        def run(now: float) -> None:
            try:
                request(now, answer)
            except Exception as error:
                future.set_exception(error)
                self._guard.trigger()

        self._link.call(run)
        result: T = await future
        return result
