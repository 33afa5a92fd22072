# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The executor of the nodes, and functions that other threads hand to its thread."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import version
import os
import sys
import threading

from rclpy.context import Context
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node

from .throttled_log import NodeLog

# s; a call of spin_once needs a limit. In the wheels of rclpy 7.1.6 and 9.1.2 the EventsExecutor
# computes the end of a wait without one as a time of the system's clock, which overflows, and
# spins at full load.
SPIN_LIMIT = 1.0


def make_executor(context: Context, log: NodeLog) -> Executor:
    """
    Return rclpy's EventsExecutor, or the SingleThreadedExecutor where rclpy has none.

    The EventsExecutor makes no wait set of all entities of the process for each callback. It takes
    no guard conditions, and has one thread for each clock that timers use. After an exception in
    the callback of the first of several waiting messages, it leaves the others until the next ones
    come (rclpy 7.1.6 and 9.1.2), so a callback must raise none.
    """
    try:
        from rclpy.experimental import EventsExecutor
    except ImportError:
        log.info(f'rclpy {version("rclpy")} has no EventsExecutor, as 7.1.4 and newer have: '
                 'requests take longer and need more CPU')
        return SingleThreadedExecutor(context=context)
    # It enables faulthandler, which refuses a closed stderr.
    if sys.stderr is None:
        sys.stderr = os.fdopen(os.open(os.devnull, os.O_WRONLY), 'w')
    return EventsExecutor(context=context)


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
