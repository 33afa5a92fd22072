# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The nodes of the devices of one kind: the payload's own, and one for each further device.

Events that devices of each kind have become log lines and topics here.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator
import math
from typing import Any, Generic, Protocol, TypeVar

from rclpy.node import Node

from .diagnostics_publisher import DiagnosticsSource
from .node import NodeEntities
from .node_manager import NodeRequest
from .payload import BridgeContext
from .throttled_log import NodeLog
from ..payload.command_sources import describe
from ..payload.device_events import (
    DeviceConnected,
    DeviceDisconnected,
    DeviceEvent,
    DeviceForgotten,
    DeviceHeld,
)

# s without a device until the log gives the reason, once.
ABSENCE_DELAY = 5.0


class DeviceNode(Protocol):
    """A node that serves a device, or none yet."""

    source: DiagnosticsSource

    def handle(self, event: Any) -> None:
        """Publish an event of the device, which is of a class of its payload."""

    def release(self) -> None:
        """Serve no device: it was forgotten."""

    def absence(self, now: float) -> str:
        """Return why there is no device, for people."""


K = TypeVar('K', bound=Hashable)
N = TypeVar('N', bound=DeviceNode)


class DeviceNodes(Generic[K, N]):
    """
    Gives devices their nodes; for the link's thread.

    :param kind: a noun for a device, such as ``light``.
    :param make: gives the node of a further device its interface; in the thread that makes nodes.
    :param bind: has a node serve a device from then on, given its key and the time (s).
    :ivar first: the payload's own node.
    :ivar get: returns the node that serves a device, None if there is none.
    """

    def __init__(
        self, context: BridgeContext, kind: str, first: N, make: Callable[[Node, NodeLog], N],
        bind: Callable[[N, K, float], None],
    ) -> None:
        self.first = first
        self._context = context
        self._kind = kind
        self._make = make
        self._bind_node = bind
        self._nodes: dict[K, N] = {}
        self.get = self._nodes.get
        # Requests for the nodes of further devices, also before those are made.
        self._requests: dict[K, NodeRequest] = {}
        self._absence_due = context.link.clock() + ABSENCE_DELAY
        context.diagnostics.add(first.source)

    def __iter__(self) -> Iterator[N]:
        return iter(self._nodes.values())

    def has_name(self, name: str) -> bool:
        """Return whether the node of a further device has a name, without namespace."""
        return any(request.name == name for request in self._requests.values())

    @property
    def first_is_free(self) -> bool:
        """Return whether the payload's own node serves no device."""
        return self.first not in self._nodes.values()

    def serve(self, key: K, name: str) -> bool:
        """Give a further device a node of its own; return False if that was done before."""
        if key in self._requests:
            return False
        request = self._requests[key] = NodeRequest(
            f'{self._kind} {key}', name,
            lambda node, log: self._serve(key, request, node, log))
        self._context.nodes.make(request)
        return True

    def _serve(self, key: K, request: NodeRequest, node: Node, log: NodeLog) -> None:
        served = self._make(node, log)
        first = self._context.node
        if shared := _shared_names(node, first):
            log.warning(f'{", ".join(shared)}: {first.get_fully_qualified_name()} has '
                        'the same, since a remapping applies to all nodes; put the name of the '
                        f'node in front, as in -r {request.name}:~/enable:=NAME', 'remapped')
        self._context.log.info(f'{self._kind} {key} is served by {served.source.node}', 'served')

        def bind(now: float) -> None:
            # The device may have been forgotten meanwhile, and found again.
            if self._requests.get(key) is request:
                self.bind(served, key, now)

        self._context.link.call(bind)

    def bind(self, node: N, key: K, now: float) -> None:
        """Have a node serve a device from now on."""
        self._nodes[key] = node
        self._bind_node(node, key, now)
        self._context.diagnostics.add(node.source)

    def handle(self, event: DeviceEvent[K]) -> bool:
        """Take an event of a device; return whether a node serves the device."""
        node = self._nodes.get(event.key)
        if isinstance(event, DeviceForgotten):
            self._forget(event.key)
        elif node is not None:
            node.handle(event)
        return node is not None

    def _forget(self, key: K) -> None:
        """Remove the node of a device that was forgotten; the payload's own one stays."""
        node = self._nodes.pop(key, None)
        if node is not None:
            node.release()
            if node is not self.first:
                self._context.diagnostics.remove(node.source)
                self._context.log.info(
                    f'{self._kind} {key} was silent for long: {node.source.node} is removed',
                    'forgotten')
        if request := self._requests.pop(key, None):
            self._context.nodes.remove(request)

    def poll(self, now: float) -> None:
        """Log once why there is no device."""
        if now >= self._absence_due:
            self._absence_due = math.inf
            if self.first_is_free:
                self._context.log.warning(self.first.absence(now))


def publish_event(
    event: DeviceEvent[Any], kind: str, log: NodeLog, interface: NodeEntities,
) -> None:
    """
    Write the log line of an event, and publish ``~/connected`` or ``~/source``; ignore others.

    :param kind: a noun for the device, such as ``light``.
    """
    match event:
        case DeviceConnected(note=note):
            log.info(f'{kind} {event.key} connected{note and ", "}{note}', 'connection')
            interface.publish('connected', True)
        case DeviceDisconnected(reason=reason):
            log.warning(f'{kind} {event.key} lost: {reason}', 'connection')
            interface.publish('connected', False)
        case DeviceHeld(change=change):
            log.info(f'{kind} {event.key} {describe(change)}', 'holder')
            interface.publish('source', change.after or '')


def _shared_names(node: Node, first: Node) -> list[str]:
    """Return the services and subscribed topics that a remapping gives to two nodes."""
    names, others = (
        {*(service.service_name for service in one.services),
         *(subscription.topic_name for subscription in one.subscriptions)}
        for one in (node, first))
    # Each node with simulated time subscribes to it.
    return sorted(names & others - {'/clock'})
