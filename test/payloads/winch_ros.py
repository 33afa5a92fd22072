# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The ROS half of a winch: ``~/line_length``, ``~/cmd/release``, and its view in the monitor."""

from __future__ import annotations

from illuminator_ros.payload import Result
from illuminator_ros.ros import (
    BridgeContext,
    CommandTopic,
    Entity,
    monitor_view,
    NodeEntities,
    RosPayload,
    ServedPayload,
    SWITCH_QOS,
)
from illuminator_ros.ros.monitor_view import Device, Key, Request, Topic
from payloads.winch import WinchClient
from std_msgs.msg import Float32

LINE_LENGTH = Entity('line_length', Float32, 'length of the line that is out, m')
RELEASE = Entity('cmd/release', Float32, 'length of line to release, m', SWITCH_QOS)


class WinchNode(ServedPayload):
    """Serves all winches of a link with one node; at the end the winch stays as it is."""

    def __init__(self, client: WinchClient, context: BridgeContext) -> None:
        def release(length: float, now: float) -> None:
            for winch in client.winches.values():
                winch.release(length, now, released)

        def released(result: Result, now: float) -> None:
            context.log.info(f'~/cmd/release: {result.message}', 'release')

        interface = NodeEntities(
            context.node, context.link, context.log, publications=[LINE_LENGTH],
            commands=[CommandTopic(RELEASE, release)])
        client.events.subscribe(
            lambda report: interface.publish('line_length', report.line_length))


WINCH = RosPayload(
    'winch', lambda commands, values: WinchClient(commands), WinchNode, summary='a winch',
    link_defaults={'component_id': 195})


def length(device: Device) -> str:
    """Return the released line."""
    return monitor_view.measured(device.values.get('line_length'), 'm')


def release_key(device: Device, typed: str) -> Request | str:
    """Release line, m, or wind it in if negative."""
    found = monitor_view.numbers(typed, 1)
    return Request(f'release {found[0]:g} m', 'cmd/release', Float32, Float32(data=found[0])) if (
        found) else f'{typed!r} is not a length'


VIEW = monitor_view.View(
    'winch', {'line_length': Topic(Float32)}, ('line_length',), lambda device: [length(device)],
    lambda device: [('line', [f'{length(device)} released'])],
    (Key(('p',), 'release line', release_key, 'length (m, negative winds in)'),))
