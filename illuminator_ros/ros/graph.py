# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Types, names and publishers in the ROS graph."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from rclpy.node import Node
from rclpy.qos import ReliabilityPolicy

# The name of a node in the graph until its participant has announced it (rmw_dds_common).
UNKNOWN_NAME = '_NODE_NAME_UNKNOWN_'


def type_name(type_: Any) -> str:
    """Return the name of a message type in the graph."""
    return f'{type_.__module__.partition(".")[0]}/msg/{type_.__name__}'


def shared_names(nodes: Sequence[Node]) -> Iterator[str]:
    """Return for each of our nodes whose name another node has the remedy, for people."""
    names = [f'{namespace.rstrip("/")}/{name}'
             for name, namespace in nodes[0].get_node_names_and_namespaces()]
    for name in (node.get_fully_qualified_name() for node in nodes):
        if names.count(name) > 1:
            yield (f'another node is called {name}: services and parameters of either may answer; '
                   'give one another name with -r __node:=NAME')


def unheard_publishers(node: Node) -> Iterator[str]:
    """Return for each publisher of a topic that the node cannot hear why, for people."""
    for subscription in node.subscriptions:
        topic, wanted = subscription.topic_name, type_name(subscription.msg_type)
        # Counting takes a fifth of the time.
        if not node.count_publishers(topic):
            continue
        for info in node.get_publishers_info_by_topic(topic):
            if info.node_name == UNKNOWN_NAME:
                continue
            reason = ''
            if info.topic_type != wanted:
                reason = f'it publishes {info.topic_type} instead of {wanted}'
            elif (subscription.qos_profile.reliability is ReliabilityPolicy.RELIABLE
                  and info.qos_profile.reliability is ReliabilityPolicy.BEST_EFFORT):
                reason = 'it publishes best effort, and this topic needs reliable'
            if reason:
                publisher = f'{info.node_namespace.rstrip("/")}/{info.node_name}'
                yield f'{topic}: messages of {publisher} are not received: {reason}'
