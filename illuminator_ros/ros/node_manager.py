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

"""Nodes of further devices, made and removed while the process runs, on few threads."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
import contextlib
from dataclasses import dataclass
import functools
import threading
import time

from rclpy.node import Node
from rclpy.parameter import Parameter

from .executor import NodeExecutor
from .parameters import ParameterError
from .payload_node import PayloadNode
from .throttled_log import NodeLog

# Threads for all nodes except the first. Each further node on a thread costs 5 us a callback.
EXECUTORS = 1
# s to the next attempt to make a node, from the first to the longest.
RETRY_DELAYS = (0.5, 30.0)


@dataclass
class _Wanted:
    device: str
    name: str
    serve: Callable[[Node], None]
    due: float
    delay: float = RETRY_DELAYS[0]


class NodeManager:
    """
    The nodes of further devices, made and removed one at a time by :meth:`work`.

    :param first: the process's first node; the others share its namespace and context,
        and its publisher of parameter events.
    :param arguments: the ROS arguments that the nodes follow.
    :param wake: requests a call of :meth:`work`.
    """

    def __init__(
        self, first: PayloadNode, arguments: Sequence[str], log: NodeLog,
        wake: Callable[[], None],
    ) -> None:
        self._first = first
        self._arguments = without_node_name(arguments)
        self._log = log
        self._wake = wake
        self._lock = threading.Lock()
        self._wanted: dict[Hashable, _Wanted] = {}
        self._unwanted: list[Hashable] = []
        self._nodes: dict[Hashable, tuple[Node, NodeExecutor]] = {}
        self._executors: list[tuple[NodeExecutor, threading.Thread]] = []

    def make(
        self, key: Hashable, device: str, name: str, serve: Callable[[Node], None],
    ) -> None:
        """
        Make a node soon; callable from any thread.

        A failure is tried again.

        :param device: the device of the node, for people.
        :param serve: gives the node its interface; called by :meth:`work`.
        """
        with self._lock:
            self._wanted[key] = _Wanted(device, name, serve, time.monotonic())
        self._wake()

    def remove(self, key: Hashable) -> None:
        """Remove a node soon, or do not make it; callable from any thread."""
        with self._lock:
            self._wanted.pop(key, None)
            self._unwanted.append(key)
        self._wake()

    def work(self) -> bool:
        """Remove unwanted nodes and make one wanted node; return whether more must be made."""
        now = time.monotonic()
        with self._lock:
            unwanted, self._unwanted = self._unwanted, []
            due = [(key, one) for key, one in self._wanted.items() if one.due <= now]
        for key in unwanted:
            if key in self._nodes:
                node, executor = self._nodes.pop(key)
                executor.call(functools.partial(_discard, node, executor))
        if not due:
            return False
        key, wanted = due[0]
        try:
            made = self._make(wanted)
        except ParameterError as error:
            self._log.error(f'{wanted.device} gets no node: {error}')
        except Exception as error:
            # Threads, descriptors or memory may be short temporarily.
            self._log.error(f'{wanted.device} gets no node yet: {error}; trying again in '
                            f'{wanted.delay:g} s', f'node {key}')
            wanted.due = time.monotonic() + wanted.delay
            wanted.delay = min(2 * wanted.delay, RETRY_DELAYS[1])
            return len(due) > 1
        else:
            self._nodes[key] = made
        with self._lock:
            if self._wanted.get(key) is wanted:
                del self._wanted[key]
        return len(due) > 1

    def end(self) -> None:
        """Stop running callbacks; callable from any thread."""
        for executor, _ in list(self._executors):
            executor.end()

    def join(self, deadline: float) -> None:
        """Wait until ``deadline`` (s, monotonic) for the threads."""
        for _, thread in list(self._executors):
            thread.join(max(deadline - time.monotonic(), 0.0))

    @property
    def nodes(self) -> list[Node]:
        """Return the nodes that were made."""
        return [node for node, _ in list(self._nodes.values())]

    def _make(self, wanted: _Wanted) -> tuple[Node, NodeExecutor]:
        executor = self._executor()
        node = PayloadNode(
            wanted.name, first=self._first, namespace=self._first.get_namespace(),
            context=self._first.context, cli_args=self._arguments, use_global_arguments=False,
            # Its types are those of the first node, and the service takes 0.13 MB.
            parameter_overrides=[Parameter('start_type_description_service', value=False)])
        try:
            wanted.serve(node)
        except BaseException:
            node.destroy_node()
            raise
        executor.add_node(node)
        return node, executor

    def _executor(self) -> NodeExecutor:
        if len(self._executors) < EXECUTORS:
            executor = NodeExecutor(self._first.context, self._log)
            thread = threading.Thread(target=executor.run, name='nodes', daemon=True)
            thread.start()
            self._executors.append((executor, thread))
        return min((executor for executor, _ in self._executors),
                   key=lambda executor: len(executor.get_nodes()))


def _discard(node: Node, executor: NodeExecutor) -> None:
    executor.remove_node(node)
    with contextlib.suppress(Exception):
        node.destroy_node()


def without_node_name(arguments: Sequence[str]) -> list[str]:
    """
    Return the ROS arguments without those that name the node.

    ``-r __node:=spot`` names every node of a process; further devices keep names of their own.
    """
    kept: list[str] = []
    for argument in arguments:
        if argument.startswith(('__node:=', '__name:=')) and kept[-1:] in (['-r'], ['--remap']):
            kept.pop()
        else:
            kept.append(argument)
    return kept
