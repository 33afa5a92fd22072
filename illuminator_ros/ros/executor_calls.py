# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Functions that other threads hand to the thread of a node's executor."""

from __future__ import annotations

from collections.abc import Callable
import threading

from rclpy.node import Node


class ExecutorCalls:
    """Calls functions in the thread of the executor of a node, in order."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._waiting: list[Callable[[], None]] = []
        self._lock = threading.Lock()

    def call(self, function: Callable[[], None]) -> None:
        """Have a function called, once if it waits already; callable from any thread."""
        with self._lock:
            if function in self._waiting:
                return
            self._waiting.append(function)
        # At the end of the process it is gone.
        if (executor := self._node.executor) is not None:
            executor.create_task(self._run)

    def _run(self) -> None:
        with self._lock:
            waiting, self._waiting = self._waiting, []
        for function in waiting:
            function()
