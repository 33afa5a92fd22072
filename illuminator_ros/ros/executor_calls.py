# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

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
