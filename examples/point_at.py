# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Light a place up: point_at.py LATITUDE LONGITUDE ALTITUDE, m above the ellipsoid."""

import functools
import math
import signal
import sys
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
import rclpy
from rclpy.client import Client
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import NavSatFix
from std_msgs.msg import Bool, Float32
from std_srvs.srv import SetBool, Trigger

# Change these: the nodes, the brightness, %, and how long the gimbal may take, s.
LIGHT, GIMBAL = 'illuminator', 'gimbal'
BRIGHTNESS = 40.0
TIMEOUT = 20.0

STATE = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class PointAt(Node):

    def __init__(self, place: NavSatFix) -> None:
        super().__init__('point_at')
        self.place, self.reason, self.is_stopped = place, 'no diagnostics', False
        # By topic of the gimbal.
        self.shown: dict[str, Any] = {
            'in_control': Bool(), 'on_target': Bool(), 'roi': NavSatFix()}
        self.enable = self.create_client(SetBool, f'{LIGHT}/enable')
        self.take = self.create_client(Trigger, f'{GIMBAL}/take_control')
        self.release = self.create_client(Trigger, f'{GIMBAL}/release_control')
        self.roi = self.create_publisher(NavSatFix, f'{GIMBAL}/cmd/roi', 10)
        self.brightness = self.create_publisher(Float32, f'{LIGHT}/cmd/brightness', 10)
        # Repeated, so that off_after_silence of the bridge ends the light with this program.
        self.create_timer(0.5, lambda: self.brightness.publish(Float32(data=BRIGHTNESS)))
        for name, message in self.shown.items():
            self.create_subscription(type(message), f'{GIMBAL}/{name}', functools.partial(
                self.shown.__setitem__, name), STATE)
        self.create_subscription(DiagnosticArray, '/diagnostics', self.take_diagnostics, 10)

    def take_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            values = {one.key: one.value for one in status.values}
            if values.get('node') == self.resolve_topic_name(GIMBAL):
                self.reason = values.get('off_target', self.reason)

    def stop(self, *signal_and_frame: object) -> None:
        self.is_stopped = True

    def call(self, client: Client, request: object) -> str:
        """Return why it failed, '' if it did not."""
        # The answer to the first call of a client may be lost.
        for _ in range(3):
            answer = client.call_async(request)
            rclpy.spin_until_future_complete(self, answer, timeout_sec=4.0)
            if result := answer.result():
                break
        if result and result.success:
            return ''
        return f'{client.service_name} failed: {result.message if result else "no answer"}'

    def is_there(self) -> bool:
        """Return whether the gimbal shows that it points at this place, and at no other."""
        shown, place = self.shown['roi'], self.place
        return self.shown['in_control'].data and self.shown['on_target'].data and math.dist(
            (shown.latitude, shown.longitude), (place.latitude, place.longitude)) < 1e-6

    def run(self) -> str:
        """Return why it failed, '' after a signal."""
        if reason := self.call(self.take, Trigger.Request()):
            return reason
        deadline = time.monotonic() + TIMEOUT
        while not self.is_there():
            self.roi.publish(self.place)
            rclpy.spin_once(self, timeout_sec=0.1)
            if self.is_stopped:
                return ''
            if time.monotonic() > deadline:
                return f'not on target within {TIMEOUT:g} s: {self.reason}'
        if reason := self.call(self.enable, SetBool.Request(data=True)):
            return reason
        while not self.is_stopped and self.shown['in_control'].data:
            rclpy.spin_once(self, timeout_sec=0.1)
        return '' if self.is_stopped else 'control of the gimbal is lost'


def main() -> None:
    try:
        latitude, longitude, altitude = map(float, remove_ros_args(sys.argv)[1:])
    except ValueError:
        sys.exit(__doc__)
    # By default Ctrl-C ends ROS, and the light could not be switched off any more.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = PointAt(NavSatFix(latitude=latitude, longitude=longitude, altitude=altitude))
    for client in (node.enable, node.take):
        if not client.wait_for_service(4.0):
            nodes = node.get_fully_qualified_node_names()
            sys.exit(f'{client.service_name}: no such service; nodes in the ROS domain '
                     f'{node.context.get_domain_id()}: {", ".join(nodes)}')
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, node.stop)
    reasons = []
    try:
        reasons.append(node.run())
    finally:
        reasons += [node.call(node.enable, SetBool.Request(data=False)),
                    node.call(node.release, Trigger.Request())]
    sys.exit('\n'.join(filter(None, reasons)) or None)


if __name__ == '__main__':
    main()
