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

"""A ROS client in the test's process, and the bridge under test in one of its own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import contextlib
import os
from pathlib import Path
import random
import socket
import threading
from typing import Any

from rcl_interfaces.msg import ParameterEvent
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
import rclpy
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from support.light import eventually
from support.processes import ended, Program, python
from support.recording import Call, Recorder

STATE = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE,
                   durability=DurabilityPolicy.TRANSIENT_LOCAL)
STREAM = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE)


@contextlib.contextmanager
def own_domain() -> Iterator[int]:
    """Yield a ROS domain that nobody else on this machine uses meanwhile."""
    with socket.socket(socket.AF_UNIX) as claim:
        while True:
            # Domains up to 101 have ports below the ephemeral ones.
            domain = random.randint(1, 101)
            with contextlib.suppress(OSError):
                _look_for_participants(domain)
                claim.bind(f'\0illuminator_ros_test_domain_{domain}')
                break
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
        # The first name is that of Fast DDS 2, which Jazzy has, the second that of Fast DDS 3.
        for name in ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE'):
            os.environ[name] = str(Path(__file__).with_name('fastdds.xml'))
        yield domain


def _look_for_participants(domain: int) -> None:
    """Raise OSError if somebody listens where participants do (DDSI-RTPS, 9.6.1.1)."""
    for participant in range(10):
        with socket.socket(type=socket.SOCK_DGRAM) as probe:
            probe.bind(('', 7410 + 250 * domain + 2 * participant))


class Ros:
    """A node of the test's own, spun in a thread: what is waited for comes by itself."""

    def __init__(self, domain: int) -> None:
        self.domain = domain
        self.context = Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = rclpy.create_node('tester', context=self.context)
        self._clients: dict[str, Any] = {}
        self._publishers: dict[str, Any] = {}
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        with contextlib.suppress(ExternalShutdownException):
            self._executor.spin()

    def close(self) -> None:
        """Leave the graph."""
        rclpy.try_shutdown(context=self.context)
        self._thread.join(5.0)
        self.node.destroy_node()

    def find_publisher(self, topic: str) -> None:
        """Wait until a topic is published."""
        eventually(lambda: self.node.count_publishers(topic))

    def subscribe(self, type_: Any, topic: str, qos: QoSProfile = STATE) -> Recorder:
        """Record a topic, once its publisher is there."""
        recorder = Recorder()
        self.node.create_subscription(type_, topic, recorder.take, qos)
        self.find_publisher(topic)
        return recorder

    def publisher(self, type_: Any, topic: str) -> Any:
        """Return a publisher that has been found by a subscriber in the bridge."""
        publisher = self._publishers.get(topic)
        if publisher is None:
            publisher = self._publishers[topic] = self.node.create_publisher(type_, topic, 10)
            eventually(publisher.get_subscription_count)
            self._meet(topic.partition('/cmd/')[0])
        return publisher

    def publish(self, type_: Any, topic: str, *values: Any) -> None:
        """Publish values, one after the other."""
        publisher = self.publisher(type_, topic)
        for value in values:
            publisher.publish(type_(data=value))

    def _meet(self, node: str) -> None:
        """
        Make sure that a node knows what we have just created.

        That we know its side says nothing of that; but news of ours that it gets later does.
        """
        client = self._client(GetParameters, f'{node}/get_parameters')
        for _ in range(2):
            # The first question may get lost: it may come before it is known where it is from.
            while not Call(client.call_async(GetParameters.Request())).answers_within(0.5):
                pass

    def _client(self, type_: Any, service: str) -> Any:
        client = self._clients.get(service)
        if client is None:
            client = self._clients[service] = self.node.create_client(type_, service)
            eventually(client.service_is_ready, 10.0)
            self._meet(service.rpartition('/')[0])
        return client

    def start(self, type_: Any, service: str, request: Any) -> Call:
        """Call a service, once it is there, without waiting for the answer."""
        return Call(self._client(type_, service).call_async(request))

    def call(self, type_: Any, service: str, request: Any, timeout: float = 10.0) -> Any:
        """Call a service and return its answer."""
        return self.start(type_, service, request).result(timeout)


class Parameters:
    """The parameters of another node, through its services."""

    def __init__(self, ros: Ros, node: str = '/illuminator') -> None:
        self._ros = ros
        self._node = node

    def events(self) -> Recorder:
        """Record the node's parameter events from now on."""
        recorder = Recorder()
        self._ros.node.create_subscription(
            ParameterEvent, '/parameter_events',
            lambda event: event.node == self._node and recorder.take(event), STREAM)
        self._ros.find_publisher('/parameter_events')
        self.get('frame_id')
        return recorder

    def start(self, type_: Any, service: str, **request: Any) -> Call:
        """Call one of the parameter services."""
        return self._ros.start(type_, f'{self._node}/{service}', type_.Request(**request))

    def get(self, *names: str) -> list[Any]:
        """Return values, None where not set."""
        response = self.start(GetParameters, 'get_parameters', names=names).result()
        return [parameter_value_to_python(value) for value in response.values]

    def types(self, *names: str) -> list[int]:
        """Return the types that get_parameter_types tells."""
        call = self.start(GetParameterTypes, 'get_parameter_types', names=names)
        return list(call.result().types)

    def describe(self, *names: str) -> list[Any]:
        """Return descriptors."""
        call = self.start(DescribeParameters, 'describe_parameters', names=names)
        return list(call.result().descriptors)

    def names(self) -> list[str]:
        """Return the names of all parameters."""
        return list(self.start(ListParameters, 'list_parameters').result().result.names)

    def set(self, **values: Any) -> list[Any]:  # noqa: A003
        """Set parameters with one call of set_parameters; return the results."""
        return list(self.start_set(**values).result().results)

    def start_set(self, *, atomically: bool = False, **values: Any) -> Call:
        """Begin to set parameters."""
        type_, service = ((SetParametersAtomically, 'set_parameters_atomically')
                          if atomically else (SetParameters, 'set_parameters'))
        return self.start(type_, service, parameters=[
            Parameter(name, value=value).to_parameter_msg() for name, value in values.items()])

    def set_atomically(self, **values: Any) -> Any:
        """Set all parameters or none; return the result."""
        return self.start_set(atomically=True, **values).result().result

    def wait(self, **values: Any) -> None:
        """Wait until parameters have these values."""
        eventually(lambda: self.get(*values) == list(values.values()))

    def wait_range(self, name: str, high: float) -> None:
        """Wait until the range of a number ends at ``high``."""
        def ends() -> float:
            [descriptor] = self.describe(name)
            return float(descriptor.floating_point_range[0].to_value)
        eventually(lambda: ends() == high)


def start_bridge(
    domain: int, port: int, *arguments: str, env: Mapping[str, str] | None = None,
    **parameters: Any,
) -> Program:
    """Start the bridge, listening on a UDP port of loopback."""
    given = {'connection_url': f'udpin://127.0.0.1:{port}', **parameters}
    overrides = [text for name, value in given.items() for text in ('-p', f'{name}:={value}')]
    return python('illuminator_ros.bridge', '--ros-args', *overrides, *arguments,
                  env={'ROS_DOMAIN_ID': str(domain), **(env or {})})


@contextlib.contextmanager
def running_bridge(
    domain: int, port: int, *arguments: str, until: str = 'link open', **parameters: Any,
) -> Iterator[Program]:
    """Run the bridge; at its end it must end as it promises, and have had no traceback."""
    with ended(start_bridge(domain, port, *arguments, **parameters)) as bridge:
        bridge.wait_for(until)
        yield bridge
