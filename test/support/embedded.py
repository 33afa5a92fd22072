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

"""The bridge in the test's own process, where its parts can be reached and made to fail."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import threading
from typing import Any

from illuminator_ros.ros.node import IlluminatorNode
from illuminator_ros.ros.process import BridgeProcess
import rclpy
from rclpy.context import Context
from rclpy.parameter import Parameter


@contextlib.contextmanager
def embedded_bridge(domain: int, port: int, **parameters: Any) -> Iterator[BridgeProcess]:
    """Run the bridge in a thread, listening on a UDP port of loopback."""
    context = Context()
    rclpy.init(context=context, domain_id=domain)
    given = {'connection_url': f'udpin://127.0.0.1:{port}', **parameters}
    process = BridgeProcess(IlluminatorNode(context=context, parameter_overrides=[
        Parameter(name, value=value) for name, value in given.items()]), [])
    thread = threading.Thread(target=process.run)
    thread.start()
    try:
        yield process
    finally:
        process.end()
        thread.join(5.0)
        rclpy.try_shutdown(context=context)
        assert not thread.is_alive()
