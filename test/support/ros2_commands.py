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
The commands of ``ros2`` that the documentation shows, by rclpy: the wheels have no ros2cli.

``python -m support.ros2_commands service call NAME TYPE VALUES`` and so on.
"""

from collections.abc import Callable
import contextlib
from importlib import import_module
import sys
from typing import Any

from builtin_interfaces.msg import Time
import rclpy
from rclpy.node import Node
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import HistoryPolicy, qos_profile_system_default
from support.waiting import PATIENCE
import yaml


def type_of(name: str) -> Any:
    """Return the class of a type, such as ``std_msgs/msg/Bool``."""
    package, kind, type_ = name.split('/')
    return getattr(import_module(f'{package}.{kind}'), type_)


def set_fields(message: Any, values: dict[str, Any], node: Node) -> Any:
    """Set fields of a message from YAML, where a time may be ``now``; return the message."""
    for name, value in values.items():
        field = getattr(message, name)
        if isinstance(field, Time) and value == 'now':
            value = node.get_clock().now().to_msg()
        elif isinstance(value, dict):
            value = set_fields(field, value, node)
        setattr(message, name, value)
    return message


def show(message: Any, indent: str = '') -> None:
    """Print the fields of a message as ``ros2 topic echo`` does."""
    for name in message.get_fields_and_field_types():
        value = getattr(message, name)
        if hasattr(value, 'get_fields_and_field_types'):
            print(f'{indent}{name}:')
            show(value, f'{indent}  ')
        else:
            text = str(value).lower() if isinstance(value, bool) else value
            print(f'{indent}{name}: {text}', flush=True)


def service_call(node: Node, name: str, type_name: str, values: str = '{}') -> None:
    """Call a service and print the answer."""
    type_ = type_of(type_name)
    client = node.create_client(type_, name)
    assert client.wait_for_service(PATIENCE), name
    future = client.call_async(set_fields(type_.Request(), yaml.safe_load(values), node))
    rclpy.spin_until_future_complete(node, future, timeout_sec=PATIENCE)
    print(future.result())


def param_set(node: Node, of: str, name: str, value: str) -> None:
    """Set a parameter of a node and print the outcome."""
    client = AsyncParameterClient(node, of)
    assert client.wait_for_services(PATIENCE), of
    number = float(value)
    future = client.set_parameters([rclpy.parameter.Parameter(name, value=number)])
    rclpy.spin_until_future_complete(node, future, timeout_sec=PATIENCE)
    [result] = future.result().results
    print('Set parameter successful' if result.successful else result.reason)


def topic_pub(node: Node, *arguments: str) -> None:
    """Publish once to one subscriber (-1), or at a rate (-r)."""
    *how, name, type_name, values = arguments
    type_ = type_of(type_name)
    publisher = node.create_publisher(type_, name, qos_profile_system_default)

    def publish() -> None:
        publisher.publish(set_fields(type_(), yaml.safe_load(values), node))

    if how == ['-1']:
        matched = rclpy.task.Future()
        timer = node.create_timer(0.05, lambda: (
            matched.set_result(None)
            if publisher.get_subscription_count() and not matched.done() else None))
        rclpy.spin_until_future_complete(node, matched, timeout_sec=PATIENCE)
        timer.cancel()
        publish()
        assert publisher.wait_for_all_acked(rclpy.duration.Duration(seconds=PATIENCE))
    else:
        node.create_timer(1 / float(how[1]), publish)
        rclpy.spin(node)


def topic_echo(node: Node, name: str, type_name: str = '') -> None:
    """Print the messages on a topic, with the durability and reliability of its publisher."""
    found = rclpy.task.Future()

    def look() -> None:
        if not found.done() and (infos := node.get_publishers_info_by_topic(name)):
            found.set_result(infos[0])

    timer = node.create_timer(0.05, look)
    rclpy.spin_until_future_complete(node, found, timeout_sec=PATIENCE)
    timer.cancel()
    info = found.result()
    info.qos_profile.history, info.qos_profile.depth = HistoryPolicy.KEEP_LAST, 10
    node.create_subscription(type_of(type_name or info.topic_type), name, show, info.qos_profile)
    rclpy.spin(node)


COMMANDS: dict[tuple[str, str], Callable[..., None]] = {
    ('service', 'call'): service_call, ('param', 'set'): param_set,
    ('topic', 'pub'): topic_pub, ('topic', 'echo'): topic_echo}


def main() -> None:
    """Run the command of the arguments."""
    first, second, *arguments = sys.argv[1:]
    rclpy.init()
    node = Node('ros2_command', enable_rosout=False)
    with contextlib.suppress(KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        COMMANDS[first, second](node, *arguments)
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
