# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A pytest plugin (``-p support.no_ros``) that simulates a machine without ROS."""

from importlib.abc import MetaPathFinder
import sys
from typing import Any

ROS_MODULES = ('rclpy', 'rcl_interfaces', 'std_msgs', 'std_srvs', 'sensor_msgs',
               'diagnostic_msgs', 'ament_index_python')


class _NoRos(MetaPathFinder):
    """Refuses to find any module of ROS."""

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> None:
        """See :meth:`MetaPathFinder.find_spec`."""
        if name.partition('.')[0] in ROS_MODULES:
            raise ModuleNotFoundError(f'no {name}: these tests run without ROS', name=name)


sys.meta_path.insert(0, _NoRos())
