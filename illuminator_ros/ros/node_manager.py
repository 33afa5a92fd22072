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

from collections.abc import Callable, Sequence
import contextlib
from dataclasses import dataclass
import functools
import threading
import time

from rclpy.node import Node

from .executor import NodeExecutor
from .parameters import ParameterError
from .payload_node import PayloadNode
from .throttled_log import NodeLog

# s to the next attempt to make a node, from the first to the longest.
RETRY_DELAYS = (0.5, 30.0)


@dataclass(eq=False)
class NodeRequest:
    """
    A request for a node; requests with equal values are still different requests.

    :param device: the device of the node, for people.
    :param serve: gives the node its interface; called by :meth:`NodeManager.work`.
    :ivar due: s, monotonic, for the next attempt to make the node.
    :ivar delay: s from a failed attempt to the next one.
    """

    device: str
    name: str
    serve: Callable[[Node], None]
    due: float = 0.0
    delay: float = RETRY_DELAYS[0]


class NodeManager:
    """
    The nodes of further devices, made and removed one at a time by :meth:`work`.

    One thread runs the callbacks of all of them; each node adds 20 us to a callback.

    :param first: the process's first node, whose namespace the others share.
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
        self._wanted: list[NodeRequest] = []
        self._unwanted: list[NodeRequest] = []
        self._nodes: dict[NodeRequest, Node] = {}
        self._executor = NodeExecutor(first.context, log)
        self._thread = threading.Thread(target=self._executor.run, name='nodes', daemon=True)

    def make(self, request: NodeRequest) -> None:
        """
        Make a node soon; callable from any thread.

        A failed attempt is repeated, unless a parameter is wrong.
        """
        with self._lock:
            self._wanted.append(request)
        self._wake()

    def remove(self, request: NodeRequest) -> None:
        """Remove a node soon, or do not make it; callable from any thread."""
        with self._lock:
            self._unwanted.append(request)
        self._wake()

    def work(self) -> bool:
        """Remove unwanted nodes and make one wanted node; return whether more must be made."""
        now = time.monotonic()
        with self._lock:
            unwanted, self._unwanted = self._unwanted, []
            self._wanted = [one for one in self._wanted if one not in unwanted]
            due = [one for one in self._wanted if one.due <= now]
        for request in unwanted:
            if node := self._nodes.pop(request, None):
                self._executor.call(functools.partial(self._discard, node))
        if not due:
            return False
        request = due[0]
        try:
            self._nodes[request] = self._make(request)
        except ParameterError as error:
            self._log.error(f'{request.device} gets no node: {error}')
        except Exception as error:
            # Threads, descriptors or memory may be short temporarily.
            self._log.error(f'{request.device} gets no node yet: {error}; trying again in '
                            f'{request.delay:g} s', f'node of {request.device}')
            request.due = time.monotonic() + request.delay
            request.delay = min(2 * request.delay, RETRY_DELAYS[1])
            return len(due) > 1
        with self._lock:
            self._wanted.remove(request)
        return len(due) > 1

    def end(self) -> None:
        """Stop running callbacks; callable from any thread."""
        self._executor.end()

    def join(self, deadline: float) -> None:
        """Wait until ``deadline`` (s, monotonic) for the thread."""
        if self._thread.ident is not None:
            self._thread.join(max(deadline - time.monotonic(), 0.0))

    @property
    def nodes(self) -> list[Node]:
        """Return the nodes that were made."""
        return list(self._nodes.values())

    def _make(self, request: NodeRequest) -> Node:
        if self._thread.ident is None:
            self._thread.start()
        node = PayloadNode(
            request.name, first=self._first, namespace=self._first.get_namespace(),
            cli_args=self._arguments)
        try:
            request.serve(node)
        except BaseException:
            node.destroy_node()
            raise
        self._executor.add_node(node)
        return node

    def _discard(self, node: Node) -> None:
        self._executor.remove_node(node)
        with contextlib.suppress(Exception):
            node.destroy_node()


def without_node_name(arguments: Sequence[str]) -> list[str]:
    """
    Return the ROS arguments without those that name the node.

    ``-r __node:=spot`` names every node of a process; nodes after the first keep their own names.
    """
    kept: list[str] = []
    for argument in arguments:
        if argument.startswith(('__node:=', '__name:=')) and kept[-1:] in (['-r'], ['--remap']):
            kept.pop()
        else:
            kept.append(argument)
    return kept
