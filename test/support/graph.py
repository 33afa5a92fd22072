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

"""The interface of a node in the ROS graph."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from support.light import eventually
from support.ros import Ros

Lookup = Callable[[str, str], list[tuple[str, list[str]]]]


@dataclass(frozen=True)
class Interface:
    """Names and types of the topics and services of a node."""

    publishers: dict[str, str]
    subscriptions: dict[str, str]
    services: dict[str, str]
    clients: dict[str, str]


def interface(ros: Ros, node: str, last: Sequence[str]) -> Interface:
    """
    Return the interface of a node in the root namespace.

    :param last: the names whose discovery completes it.
    """
    def found() -> Interface | None:
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
        return Interface(*parts) if set(last) <= set().union(*parts) else None

    interface = eventually(found)
    assert interface is not None
    return interface
