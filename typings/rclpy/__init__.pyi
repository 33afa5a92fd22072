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

from collections.abc import Sequence
from typing import TypeVar

from rclpy.context import Context
from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

Result = TypeVar('Result')

def init(
    *, args: Sequence[str] | None = None, context: Context | None = None,
    domain_id: int | None = None, signal_handler_options: SignalHandlerOptions | None = None,
) -> None: ...
def ok(*, context: Context | None = None) -> bool: ...
def shutdown(*, context: Context | None = None) -> None: ...
def try_shutdown(*, context: Context | None = None) -> None: ...
def spin(node: Node, executor: Executor | None = None) -> None: ...
def spin_once(
    node: Node, *, executor: Executor | None = None, timeout_sec: float | None = None,
) -> None: ...
def spin_until_future_complete(
    node: Node, future: Future[Result], executor: Executor | None = None,
    timeout_sec: float | None = None,
) -> None: ...
def create_node(
    node_name: str, *, context: Context | None = None, cli_args: list[str] | None = None,
    namespace: str | None = None, use_global_arguments: bool = True, enable_rosout: bool = True,
    start_parameter_services: bool = True, parameter_overrides: list[Parameter] | None = None,
    allow_undeclared_parameters: bool = False,
    automatically_declare_parameters_from_overrides: bool = False,
    enable_logger_service: bool = False,
) -> Node: ...
