# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The interface of a node in the ROS graph."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from support.light import eventually
from support.ros import Ros

Lookup = Callable[[str, str], list[tuple[str, list[str]]]]


@dataclass(frozen=True)
class Entity:
    """Names and types of the topics and services of a node."""

    publishers: dict[str, str]
    subscriptions: dict[str, str]
    services: dict[str, str]
    clients: dict[str, str]


def interface(ros: Ros, node: str, last: Sequence[str]) -> Entity:
    """
    Return the interface of a node in the root namespace.

    :param last: the names whose discovery completes it.
    """
    def found() -> Entity | None:
        graph = ros.node
        lookups: tuple[Lookup, ...] = (
            graph.get_publisher_names_and_types_by_node,
            graph.get_subscriber_names_and_types_by_node,
            graph.get_service_names_and_types_by_node,
            graph.get_client_names_and_types_by_node)
        if node not in graph.get_node_names():
            return None
        parts: Any = [{name: types[0] for name, types in lookup(node, '/')}
                      for lookup in lookups]
        return Entity(*parts) if set(last) <= set().union(*parts) else None

    interface = eventually(found)
    assert interface is not None
    return interface
