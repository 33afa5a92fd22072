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

"""
The private parts of rclpy that this package uses.

All were seen in rclpy 7.1.6, of Jazzy, and in 9.1.2, of Kilted.
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
