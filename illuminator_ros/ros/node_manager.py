# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Nodes of further devices, made and removed while the process runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import contextlib
from dataclasses import dataclass
import math
import threading
import time

from rclpy.executors import Executor
from rclpy.node import Node

from .parameters import ParameterError
from .payload_node import PayloadNode
from .throttled_log import NodeLog
from ..mavlink.retries import RESOURCE


@dataclass(eq=False)
class NodeRequest:
    """
    A request for a node; requests with equal values are still different requests.

    :param device: the device of the node, for people.
    :param serve: gives the node its interface, with the log of the node; called by
        :meth:`NodeManager.work`.
    :ivar node: the node once it was made, and ``log``, its log.
    :ivar wanted: whether the node is still wanted.
    :ivar due: s, monotonic, for the next attempt to make the node.
    """

    device: str
    name: str
    serve: Callable[[Node, NodeLog], None]
    node: Node | None = None
    log: NodeLog | None = None
    wanted: bool = True
    due: float = 0.0


class NodeManager:
    """
    The nodes of further devices, made and removed one at a time by :meth:`work`.

    :param first: the process's first node, whose namespace the others share.
    :param arguments: the ROS arguments that the nodes follow.
    :param executor: runs the callbacks of the nodes.
    :param wake: requests a call of :meth:`work` in the executor's thread.
    """

    def __init__(
        self, first: PayloadNode, arguments: Sequence[str], log: NodeLog, executor: Executor,
        wake: Callable[[], None],
    ) -> None:
        self._first = first
        self._arguments = without_node_name(arguments)
        self._log = log
        self._wake = wake
        self._lock = threading.Lock()
        self._requests: list[NodeRequest] = []
        self._executor = executor

    def make(self, request: NodeRequest) -> None:
        """
        Make a node soon; callable from any thread.

        A failed attempt is repeated, unless a parameter is wrong.
        """
        with self._lock:
            self._requests.append(request)
        self._wake()

    def remove(self, request: NodeRequest) -> None:
        """Remove a node soon, or do not make it; callable from any thread."""
        request.wanted = False
        self._wake()

    def work(self) -> bool:
        """
        Remove unwanted nodes, make one wanted node, and write the lines that their logs hold.

        :return: whether more nodes must be made.
        """
        now = time.monotonic()
        with self._lock:
            unwanted = [one for one in self._requests if not one.wanted]
            self._requests = [one for one in self._requests if one.wanted]
            due = [one for one in self._requests if one.node is None and one.due <= now]
        for request in unwanted:
            if request.node is not None:
                self._executor.remove_node(request.node)
                request.node.destroy_node()
        for request in due[:1]:
            try:
                self._make(request)
            except ParameterError as error:
                self._log.error(f'{request.device} gets no node: {error}')
                request.due = math.inf
            except Exception as error:
                # Threads, descriptors or memory may be short temporarily.
                self._log.error(f'{request.device} gets no node yet: {error}; trying again in '
                                f'{RESOURCE.first:g} s', f'node of {request.device}')
                request.due = time.monotonic() + RESOURCE.first
        for request in self._requests:
            if request.log is not None:
                request.log.flush()
        return len(due) > 1

    @property
    def nodes(self) -> list[Node]:
        """Return the nodes that were made."""
        return [one.node for one in self._requests if one.node is not None]

    def _make(self, request: NodeRequest) -> None:
        with contextlib.ExitStack() as stack:
            node = PayloadNode(
                request.name, first=self._first, namespace=self._first.get_namespace(),
                cli_args=self._arguments)
            stack.callback(node.destroy_node)
            self._executor.add_node(node)
            stack.callback(self._executor.remove_node, node)
            log = NodeLog(node.get_logger())
            request.serve(node, log)
            stack.pop_all()
        request.node, request.log = node, log


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
