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

"""An ordinary ROS client: it knows the node's names and standard types, nothing else."""

from __future__ import annotations

from collections.abc import Callable
import functools
import threading
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, SetParameters, SetParametersAtomically
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Bool, Float32
from std_srvs.srv import SetBool

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
TOPICS = {'connected': Bool, 'enabled': Bool, 'brightness': Float32, 'strobe_period': Float32}


class TimedOut(Exception):
    """What was waited for did not happen; the text says what."""


class RosClient:
    """Calls the services and follows the topics of one illuminator node."""

    def __init__(self, node_name: str = 'illuminator') -> None:
        rclpy.init()
        self._node = rclpy.create_node('demo')
        self._name = node_name
        self._changed = threading.Condition()
        self._topics: dict[str, Any] = {}
        self._diagnostics: dict[str, Any] = {}
        for topic, type_ in TOPICS.items():
            self._node.create_subscription(
                type_, f'/{node_name}/{topic}',
                functools.partial(self._note_topic, topic), LATCHED)
        self._node.create_subscription(
            DiagnosticArray, '/diagnostics', self._note_diagnostics, 10)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._executor.spin, daemon=True)
        self._thread.start()

    def _note(self, into: dict[str, Any], key: str, value: Any) -> None:
        with self._changed:
            into[key] = value
            self._changed.notify_all()

    def _note_topic(self, topic: str, message: Any) -> None:
        self._note(self._topics, topic, message.data)

    def _note_diagnostics(self, array: Any) -> None:
        for status in array.status:
            self._note(self._diagnostics, status.name, status)

    def wait(self, what: str, condition: Callable[[], Any], timeout: float = 10.0) -> Any:
        """
        Wait until a condition on topics and diagnostics holds and return what it gives.

        :raises TimedOut: if it does not within ``timeout`` s.
        """
        with self._changed:
            if not self._changed.wait_for(condition, timeout):
                raise TimedOut(f'{what} did not happen within {timeout:g} s')
            return condition()

    def topic(self, name: str) -> Any:
        """Return the last value of a topic, None before the first."""
        return self._topics.get(name)

    def lamp(self) -> Any:
        """Return the last diagnostic status of the lamp, None before the first."""
        return self._diagnostics.get(f'{self._name}: lamp')

    def call(self, type_: Any, service: str, request: Any, timeout: float = 10.0) -> Any:
        """
        Call a service of the node.

        :raises TimedOut: if it is not there or does not answer.
        """
        client = self._node.create_client(type_, f'/{self._name}/{service}')
        try:
            if not client.wait_for_service(timeout):
                raise TimedOut(f'no service /{self._name}/{service} within {timeout:g} s')
            answered = threading.Event()
            future = client.call_async(request)
            future.add_done_callback(lambda _: answered.set())
            if not answered.wait(timeout):
                raise TimedOut(f'/{self._name}/{service} did not answer within {timeout:g} s')
            return future.result()
        finally:
            self._node.destroy_client(client)

    def enable(self, on: bool) -> Any:
        """Call ``~/enable``."""
        return self.call(SetBool, 'enable', SetBool.Request(data=on))

    def set(self, **values: Any) -> list[Any]:  # noqa: A003
        """Set parameters one by one, as ``ros2 param set`` does; return the results."""
        return list(self.call(SetParameters, 'set_parameters', SetParameters.Request(
            parameters=_parameters(values))).results)

    def set_atomically(self, **values: Any) -> Any:
        """Set parameters all at once; return the result."""
        return self.call(
            SetParametersAtomically, 'set_parameters_atomically',
            SetParametersAtomically.Request(parameters=_parameters(values))).result

    def get(self, name: str) -> float:
        """Return the value of a number parameter."""
        response = self.call(GetParameters, 'get_parameters',
                             GetParameters.Request(names=[name]))
        return float(response.values[0].double_value)

    def close(self) -> None:
        """Leave the ROS graph."""
        self._executor.shutdown()
        self._thread.join(2.0)
        rclpy.try_shutdown()


def _parameters(values: dict[str, Any]) -> list[Any]:
    return [Parameter(name=name, value=_value(value)) for name, value in values.items()]


def _value(value: Any) -> Any:
    if isinstance(value, float):
        return ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value)
    if isinstance(value, int):
        return ParameterValue(type=ParameterType.PARAMETER_INTEGER, integer_value=value)
    return ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=value)
