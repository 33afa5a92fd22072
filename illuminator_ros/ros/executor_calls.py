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

"""Functions that other threads hand to the thread of a node's executor."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import threading

from rclpy.exceptions import InvalidHandle
from rclpy.node import Node


class ExecutorCalls:
    """Calls functions in the thread of the executor of a node, in order."""

    def __init__(self, node: Node) -> None:
        self._waiting: list[Callable[[], None]] = []
        self._lock = threading.Lock()
        self._called = node.create_guard_condition(self._run)

    def call(self, function: Callable[[], None]) -> None:
        """Have a function called, once if it waits already; callable from any thread."""
        with self._lock:
            if function not in self._waiting:
                self._waiting.append(function)
        # The node of a forgotten device may be gone, and at the end of the process each one.
        with contextlib.suppress(InvalidHandle):
            self._called.trigger()

    def _run(self) -> None:
        with self._lock:
            waiting, self._waiting = self._waiting, []
        for function in waiting:
            function()
