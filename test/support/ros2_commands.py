# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The commands of ``ros2`` that the documentation shows, by rclpy: the wheels have no ros2cli.

``python -m support.ros2_commands service call NAME TYPE VALUES`` and so on.
"""

import contextlib
from importlib import import_module
import os
import sys
import threading
from typing import Any

from builtin_interfaces.msg import Time
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import HistoryPolicy
from support.ros import Parameters, Ros
from support.waiting import eventually, PATIENCE
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


def service_call(ros: Ros, name: str, type_name: str, values: str = '{}') -> None:
    """Call a service and print the answer."""
    type_ = type_of(type_name)
    print(ros.call(type_, name, set_fields(type_.Request(), yaml.safe_load(values), ros.node)))


def param_set(ros: Ros, of: str, name: str, value: str) -> None:
    """Set a number of a node and print the outcome."""
    [result] = Parameters(ros, of).set(**{name: float(value)})
    print('Set parameter successful' if result.successful else result.reason)


def topic_pub(ros: Ros, *arguments: str) -> None:
    """Publish once to one subscriber (-1), or at a rate (-r)."""
    *how, name, type_name, values = arguments
    type_ = type_of(type_name)
    publisher = ros.node.create_publisher(type_, name, 10)
    if how == ['-1']:
        eventually(publisher.get_subscription_count)
    period = threading.Event()
    while True:
        publisher.publish(set_fields(type_(), yaml.safe_load(values), ros.node))
        if how == ['-1']:
            assert publisher.wait_for_all_acked(Duration(seconds=PATIENCE))
            return
        period.wait(1 / float(how[1]))


def topic_echo(ros: Ros, name: str, type_name: str = '') -> None:
    """Print the messages on a topic, with the durability and reliability of its publisher."""
    info = eventually(lambda: ros.node.get_publishers_info_by_topic(name))[0]
    info.qos_profile.history, info.qos_profile.depth = HistoryPolicy.KEEP_LAST, 10
    ros.node.create_subscription(
        type_of(type_name or info.topic_type), name, show, info.qos_profile)
    threading.Event().wait()


COMMANDS: dict[tuple[str, str], Any] = {
    ('service', 'call'): service_call, ('param', 'set'): param_set,
    ('topic', 'pub'): topic_pub, ('topic', 'echo'): topic_echo}


if __name__ == '__main__':
    first, second, *given = sys.argv[1:]
    with (contextlib.closing(Ros(int(os.environ['ROS_DOMAIN_ID']))) as client,
          contextlib.suppress(KeyboardInterrupt)):
        COMMANDS[first, second](client, *given)
