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

"""Running the callbacks of one node."""

from __future__ import annotations

import threading

from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node


class Spinner:
    """
    An executor for one node, to be run in a thread of its own.

    In rclpy an executor looks at all its entities each time that it has waited: with all nodes on
    one, each request would cost the more the more lights there are, and wait for the others'.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._ended = threading.Event()
        self._executor = SingleThreadedExecutor(context=node.context)
        self._executor.add_node(node)

    def run(self) -> None:
        """Serve until :meth:`end` is called or the context is shut down."""
        while not self._ended.is_set() and self._node.context.ok():
            try:
                self._executor.spin_once()
            except ExternalShutdownException:
                break
            except Exception as error:
                # Our own callbacks answer for what goes wrong in them; rclpy's may not.
                self._node.get_logger().error(
                    f'internal error: {error!r}', throttle_duration_sec=5.0)

    def end(self) -> None:
        """Have :meth:`run` return; callable from any thread."""
        self._ended.set()
        # Waking the executor is not enough: it goes on waiting until it has something to do.
        self._executor.create_task(lambda: None)
