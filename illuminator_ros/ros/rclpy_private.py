# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The private parts of rclpy that nodes import, and the type of its loggers.

Where a part of rclpy is replaced or called in place of an executor, the module says why:
``deferred_service``, ``payload_node``, ``cli/monitor/ros_graph``. All were seen in rclpy 7.1.6, of
Jazzy, and in 9.1.2, of Kilted.
"""

from collections.abc import Mapping

# The type of a node's logger.
from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.node import Node
from rclpy.parameter import Parameter

__all__ = ('parameter_overrides', 'RcutilsLogger')


def parameter_overrides(node: Node) -> Mapping[str, Parameter]:
    """Return the parameters from the command line and files, declared or not, by name."""
    return node._parameter_overrides
