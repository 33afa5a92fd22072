# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A ROS client in the test's process, and the bridge under test in one of its own."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
import contextlib
import os
from pathlib import Path
import threading
from typing import Any

from illuminator_ros.ros.fast_dds import profile_variable
from rcl_interfaces import srv
from rcl_interfaces.msg import ParameterEvent
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_srvs.srv import SetBool, Trigger
from support.light import eventually
from support.ports import claimed_domain
from support.processes import ended, Program, python, slow_python
from support.recording import Call, Recorder
from support.slow import CLOCK
from support.spun import SpunNode
from support.waiting import PATIENCE

STATE = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE,
                   durability=DurabilityPolicy.TRANSIENT_LOCAL)
STREAM = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE,
                    durability=DurabilityPolicy.VOLATILE)


@contextlib.contextmanager
def own_domain() -> Iterator[int]:
    """Yield a ROS domain that no other process on this machine uses."""
    with claimed_domain() as domain:
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
        os.environ[profile_variable()] = str(Path(__file__).with_name('fastdds.xml'))
        yield domain


class Ros(SpunNode):
    """A node of the test's own."""

    def __init__(self, domain: int) -> None:
        self.domain = domain
        self._clients: dict[str, tuple[Any, set[bytes]]] = {}
        self._publishers: dict[str, Any] = {}
        super().__init__('tester', domain)

    def find_publisher(self, topic: str) -> None:
        """Wait until a topic is published."""
        eventually(lambda: self.node.count_publishers(topic))

    def subscribe(self, type_: Any, topic: str, qos: QoSProfile = STATE) -> Recorder:
        """Record a topic: every message from now on, or from the last value on."""
        recorder = Recorder()
        self.node.create_subscription(type_, topic, recorder.append, qos)
        self.find_publisher(topic)
        if qos.durability is DurabilityPolicy.VOLATILE:
            for node in eventually(lambda: self._publishing_nodes(topic)):
                self.meet(node)
        return recorder

    def _publishing_nodes(self, topic: str) -> list[str]:
        """Return the full names of the publishers of a topic; none while one is unknown."""
        found = self.node.get_publishers_info_by_topic(topic)
        if any('UNKNOWN' in info.node_name for info in found):
            return []
        return [f'{info.node_namespace.rstrip("/")}/{info.node_name}' for info in found]

    def publisher(self, type_: Any, topic: str, node: str = '') -> Any:
        """Return a publisher that has been found by a subscriber in the bridge."""
        publisher = self._publishers.get(topic)
        if publisher is None:
            publisher = self._publishers[topic] = self.node.create_publisher(type_, topic, 10)
            eventually(publisher.get_subscription_count)
            self.meet(node or topic.partition('/cmd/')[0])
        return publisher

    def publish(self, type_: Any, topic: str, *values: Any, node: str = '') -> None:
        """Publish values, one after the other."""
        publisher = self.publisher(type_, topic, node)
        for value in values:
            publisher.publish(type_(data=value))

    def meet(self, node: str) -> None:
        """
        Make sure that a node has discovered the entities that this node has just created.

        Discovery on this side does not prove that. Entities are announced in order, so a node that
        answers a client has discovered every entity created before it.
        """
        client = self.node.create_client(srv.GetParameters, f'{node}/get_parameters')
        eventually(client.service_is_ready)
        calls: list[Call] = []

        def is_answered() -> bool:
            # The first requests may get lost: they may precede the discovery of the client.
            calls.append(Call(client.call_async(srv.GetParameters.Request())))
            return calls[-1].answers_within(0.05) or any(call.answered for call in calls)

        eventually(is_answered)
        self.node.destroy_client(client)

    def _client(self, type_: Any, service: str, node: str) -> Any:
        client, met = self._clients.get(service, (None, set()))
        now = self._incarnations(node)
        if client is None or not now or not now <= met:
            # Keep the old client: it may still wait for an answer.
            client = self.node.create_client(type_, service)
            eventually(client.service_is_ready)
            self.meet(node)
            self._clients[service] = (client, self._incarnations(node))
        return client

    def _incarnations(self, node: str) -> set[bytes]:
        """Return ids that distinguish nodes of this name from those before a restart."""
        return {bytes(info.endpoint_gid)
                for info in self.node.get_publishers_info_by_topic('/rosout')
                if f'{info.node_namespace.rstrip("/")}/{info.node_name}' == node}

    def start(self, type_: Any, service: str, request: Any, node: str = '') -> Call:
        """Call a service of a node, once it is there, without waiting for the answer."""
        node = node or service.rpartition('/')[0]
        return Call(self._client(type_, service, node).call_async(request))

    def start_enable(self, on: bool = True, node: str = '/illuminator') -> Call:
        """Begin to switch a light on or off."""
        return self.start(SetBool, f'{node}/enable', SetBool.Request(data=on))

    def enable(self, on: bool = True, node: str = '/illuminator') -> SetBool.Response:
        """Switch a light on or off and return the answer."""
        answer: SetBool.Response = self.start_enable(on, node).result()
        return answer

    def refresh(self, node: str = '/illuminator') -> Trigger.Response:
        """Call ``~/refresh`` and return the answer."""
        answer: Trigger.Response = self.call(Trigger, f'{node}/refresh', Trigger.Request())
        return answer

    def catch_up(self, node: str = '/illuminator') -> None:
        """
        Wait until a node has processed every message that its light has sent so far.

        This client has then taken every resulting message, too.
        """
        answer = self.refresh(node)
        assert 'ILLUMINATOR_STATUS: received' in answer.message, answer.message
        self.synchronize(node)

    def synchronize(self, node: str = '/illuminator') -> None:
        """
        Wait until a node and this client have taken all messages that the other has published.

        An executor may take an answer before a message that arrived just earlier, so call twice.
        An empty set passes through the node's executor and the thread of its link.
        """
        for _ in range(2):
            self.call(srv.SetParameters, f'{node}/set_parameters', srv.SetParameters.Request())

    def outlast(self, seconds: float, others: Iterable[str]) -> None:
        """Let time pass so slowly that the lights of all these nodes stay connected."""
        while seconds > 0:
            CLOCK.forward(min(seconds, 0.5))
            seconds -= 0.5
            for node in others:
                self.catch_up(node)

    def call(
        self, type_: Any, service: str, request: Any, timeout: float = PATIENCE, node: str = '',
    ) -> Any:
        """Call a service of a node and return its answer."""
        return self.start(type_, service, request, node).result(timeout)


@contextlib.contextmanager
def repeated(publisher: Any, message: Any, period: float = 0.002) -> Iterator[None]:
    """Publish a message again and again, with a period, s."""
    ended = threading.Event()

    def publish() -> None:
        while not ended.wait(period):
            publisher.publish(message)

    thread = threading.Thread(target=publish)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


class Parameters:
    """The parameters of another node, through its services."""

    def __init__(self, ros: Ros, node: str = '/illuminator') -> None:
        self._ros = ros
        self._node = node

    def events(self) -> Recorder:
        """Record the node's parameter events from now on."""
        recorder = Recorder()

        def take(event: ParameterEvent) -> None:
            if event.node == self._node:
                recorder.append(event)

        self._ros.node.create_subscription(ParameterEvent, '/parameter_events', take, STREAM)
        self._ros.meet(self._node)
        return recorder

    def start(self, type_: Any, service: str, **request: Any) -> Call:
        """Call one of the parameter services."""
        return self._ros.start(type_, f'{self._node}/{service}', type_.Request(**request))

    def get(self, *names: str) -> list[Any]:
        """Return values, None where not set."""
        response = self.start(srv.GetParameters, 'get_parameters', names=names).result()
        return [parameter_value_to_python(value) for value in response.values]

    def types(self, *names: str) -> list[int]:
        """Return the types by get_parameter_types."""
        call = self.start(srv.GetParameterTypes, 'get_parameter_types', names=names)
        return list(call.result().types)

    def describe(self, *names: str) -> list[Any]:
        """Return descriptors."""
        call = self.start(srv.DescribeParameters, 'describe_parameters', names=names)
        return list(call.result().descriptors)

    def names(self) -> list[str]:
        """Return the names of all parameters."""
        return list(self.start(srv.ListParameters, 'list_parameters').result().result.names)

    def set(self, **values: Any) -> list[Any]:  # noqa: A003
        """Set parameters with one call of set_parameters; return the results."""
        return list(self.start_set(**values).result().results)

    def start_set(self, *, atomically: bool = False, **values: Any) -> Call:
        """Begin to set parameters."""
        type_, service = ((srv.SetParametersAtomically, 'set_parameters_atomically')
                          if atomically else (srv.SetParameters, 'set_parameters'))
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


def bridge_arguments(port: int, *arguments: str, **parameters: Any) -> list[str]:
    """Return the command line of a bridge that listens on a UDP port of loopback."""
    given = {'connection_url': f'udpin://127.0.0.1:{port}', **parameters}
    overrides = [text for name, value in given.items() for text in ('-p', f'{name}:={value}')]
    return ['--ros-args', *overrides, *arguments]


def start_bridge(domain: int, port: int, *arguments: str, **parameters: Any) -> Program:
    """Start the bridge, by the clock of this machine."""
    return python('illuminator_ros.bridge', *bridge_arguments(port, *arguments, **parameters),
                  env={'ROS_DOMAIN_ID': str(domain)})


def start_slow_bridge(domain: int, port: int, *arguments: str, **parameters: Any) -> Program:
    """Start the bridge, by the tests' slow clock, see :mod:`support.slow`."""
    return slow_python(
        'illuminator_ros.bridge', *bridge_arguments(port, *arguments, **parameters),
        env={'ROS_DOMAIN_ID': str(domain)})


@contextlib.contextmanager
def running_bridge(
    domain: int, port: int, *arguments: str, until: str = 'link open', **parameters: Any,
) -> Iterator[Program]:
    """Run the bridge, by the slow clock; it must end with status 0 and without a traceback."""
    with ended(start_slow_bridge(domain, port, *arguments, **parameters)) as bridge:
        bridge.wait_for(until)
        yield bridge


@contextlib.contextmanager
def running_simulator(*arguments: str) -> Iterator[Program]:
    """Run the simulator by the same clock, with the same conditions for its end."""
    with ended(slow_python('illuminator_ros.simulator', *arguments)) as simulator:
        yield simulator
