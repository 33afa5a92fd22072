# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
Floods services and topics until it is killed, as fast as it can.

    python3 -m tools.bench.flooder /illuminator/enable std_srvs/srv/SetBool ~ ...

Each endpoint is a name, a type, and a kind of request: ~ for the plain one, else one of LARGE.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
import importlib
import itertools
import sys
from typing import Any

from rcl_interfaces.msg import Parameter
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

# Values or names in one request, by kind.
LARGE = {'values': 1000, 'names': 100_000}
# Requests of one client that wait for an answer.
OPEN = 50


def requests(type_: Any, kind: str) -> Iterator[Any]:
    """Yield requests for a service, each time with another value where it has one."""
    count = LARGE.get(kind, 1)
    for number in itertools.count():
        request = type_.Request()
        if hasattr(request, 'data'):
            request.data = True
        if hasattr(request, 'names'):
            request.names = ['system_id'] * count
        if hasattr(request, 'prefixes'):
            request.prefixes = ['system_id'] * count
        if type_ in (SetParameters, SetParametersAtomically):
            request.parameters = [_parameter(name, value) for name, value in (
                ('max_brightness', 50.0 + number % 10), ('attitude_rate', 20.0 + number % 10),
                ('setpoint_timeout', 0.4 + number % 10 / 100), ('brightness', 20.0 + number % 10))
            ] * max(count // 4, 1)
            if type_ is SetParametersAtomically and kind == '~':
                request.parameters = request.parameters[:1]
        yield request


def _parameter(name: str, value: float) -> Parameter:
    parameter = Parameter(name=name)
    parameter.value.type, parameter.value.double_value = 3, value
    return parameter


def message(type_: Any) -> Any:
    """Return a message that a node accepts."""
    made = type_()
    if hasattr(made, 'data'):
        made.data = type(made.data)(50)
    pose = made.pose.pose if hasattr(made, 'pose') else made
    for rotation in ('orientation', 'quaternion'):
        if hasattr(pose, rotation):
            getattr(pose, rotation).w = 1.0
    if hasattr(made, 'header'):
        made.header.frame_id = 'base_link'
    if hasattr(made, 'vector'):
        made.vector.z = 0.1
    return made


def class_of(type_: str) -> Any:
    """Return the class of a type such as ``std_msgs/msg/Bool``."""
    package, kind, name = type_.split('/')
    return getattr(importlib.import_module(f'{package}.{kind}'), name)


def _sender(node: Node, name: str, type_: Any, kind: str) -> Callable[[], object]:
    """Return a function that sends one request or message."""
    if not hasattr(type_, 'Request'):
        publisher, sent = node.create_publisher(type_, name, 10), message(type_)
        return lambda: publisher.publish(sent)
    client = node.create_client(type_, name)
    client.wait_for_service(5.0)
    # Made before, since a large one takes long to make.
    made = itertools.cycle([*itertools.islice(
        requests(type_, kind), 2 if kind in LARGE else 20)])
    waiting: set[Any] = set()

    def send() -> None:
        if len(waiting) < OPEN:
            future = client.call_async(next(made))
            waiting.add(future)
            future.add_done_callback(waiting.discard)

    return send


def main(arguments: Sequence[str]) -> None:
    """Flood the endpoints."""
    rclpy.init(args=[])
    node = rclpy.create_node('flooder')
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    senders = [_sender(node, name, class_of(type_), kind) for name, type_, kind in zip(
        arguments[::3], arguments[1::3], arguments[2::3], strict=True)]
    print('flooding', flush=True)
    while rclpy.ok():
        for send in senders:
            send()
        executor.spin_once(timeout_sec=0.0)


if __name__ == '__main__':
    main(sys.argv[1:])
