# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A search: a light on a gimbal shines in one direction after the other, then goes off."""

import math
import signal
import sys
import time

from geometry_msgs.msg import Vector3, Vector3Stamped
import rclpy
from rclpy.client import Client
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Bool, Float32, Header, String
from std_srvs.srv import SetBool, Trigger

# Change these: the nodes, the brightness, %, the directions (degrees down, degrees left), and s
# at each of them.
LIGHT, GIMBAL = 'illuminator', 'gimbal'
BRIGHTNESS = 40.0
PATTERN = [(20, 40), (20, 0), (20, -40), (40, -40), (40, 0), (40, 40)]
DWELL = 2.0

FRAME = 'base_link_stabilized'
STATE = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Search(Node):

    def __init__(self) -> None:
        super().__init__('search_pattern')
        self.in_control, self.angles, self.is_stopped = False, Vector3Stamped(), False
        self.is_connected, self.controller = False, 'unknown'
        self.enable = self.create_client(SetBool, f'{LIGHT}/enable')
        self.take = self.create_client(Trigger, f'{GIMBAL}/take_control')
        self.release = self.create_client(Trigger, f'{GIMBAL}/release_control')
        self.setpoint = self.create_publisher(Vector3Stamped, f'{GIMBAL}/cmd/angles', 10)
        self.brightness = self.create_publisher(Float32, f'{LIGHT}/cmd/brightness', 10)
        # Repeated, so that off_after_silence of the bridge ends the light with this program.
        self.create_timer(0.5, lambda: self.brightness.publish(Float32(data=BRIGHTNESS)))
        self.create_subscription(Vector3Stamped, f'{GIMBAL}/angles', self.take_angles, 10)
        self.create_subscription(Bool, f'{GIMBAL}/in_control', self.take_control, STATE)
        self.create_subscription(Bool, f'{GIMBAL}/connected', self.take_connected, STATE)
        self.create_subscription(String, f'{GIMBAL}/controller', self.take_controller, STATE)

    def take_angles(self, message: Vector3Stamped) -> None:
        self.angles = message

    def take_control(self, message: Bool) -> None:
        self.in_control = message.data

    def take_connected(self, message: Bool) -> None:
        self.is_connected = message.data

    def take_controller(self, message: String) -> None:
        self.controller = message.data

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

    def demand(self, client: Client, request: object) -> None:
        if reason := self.call(client, request):
            sys.exit(reason)

    def spin_for(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            rclpy.spin_once(self, timeout_sec=0.1)
            if self.is_stopped:
                sys.exit()
            if not (self.in_control and self.is_connected):
                # The other topics come a moment later.
                for _ in range(5):
                    rclpy.spin_once(self, timeout_sec=0.1)
                sys.exit(f'control of the gimbal is lost: {self.controller}' if self.is_connected
                         else 'the gimbal is lost')

    def look(self, down: float, left: float) -> None:
        wanted = Vector3(y=math.radians(down), z=math.radians(left))
        for _ in range(20):
            self.setpoint.publish(Vector3Stamped(header=Header(frame_id=FRAME), vector=wanted))
            self.spin_for(0.5)
            at = self.angles.vector
            # A gimbal may report its yaw in another frame; then only the pitch can be compared.
            yaw_error = at.z - wanted.z if self.angles.header.frame_id == FRAME else 0.0
            if max(abs(at.y - wanted.y), abs(yaw_error)) < math.radians(2):
                return
        sys.exit(f'the gimbal does not reach {down} degrees down, {left} left')

    def run(self) -> None:
        self.demand(self.take, Trigger.Request())
        end = time.monotonic() + 4.0
        while not (self.in_control and self.is_connected):
            if self.is_stopped or time.monotonic() > end:
                sys.exit(None if self.is_stopped else 'the gimbal shows no control')
            rclpy.spin_once(self, timeout_sec=0.1)
        self.look(*PATTERN[0])
        self.demand(self.enable, SetBool.Request(data=True))
        for direction in PATTERN:
            self.look(*direction)
            self.spin_for(DWELL)


def main() -> None:
    # By default Ctrl-C ends ROS, and the light could not be switched off any more.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    search = Search()
    for client in (search.enable, search.take):
        if not client.wait_for_service(4.0):
            nodes = search.get_fully_qualified_node_names()
            sys.exit(f'{client.service_name}: no such service; nodes in the ROS domain '
                     f'{search.context.get_domain_id()}: {", ".join(nodes)}')
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, search.stop)
    reasons = []
    try:
        search.run()
    except SystemExit as end:
        reasons.append(str(end.code or ''))
    finally:
        reasons += [search.call(search.enable, SetBool.Request(data=False)),
                    search.call(search.release, Trigger.Request())]
    sys.exit('\n'.join(filter(None, reasons)) or None)


if __name__ == '__main__':
    main()
