# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A searchlight: on at low brightness, dimmer when it reports a problem, off at the end."""

import math
import signal
import sys

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Float32
from std_srvs.srv import SetBool

# Change these: the node of the light, and its brightness usually and with a problem, %.
LIGHT = '/illuminator'
BRIGHTNESS, DIMMED = 40.0, 10.0

STATE = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Searchlight(Node):

    def __init__(self) -> None:
        super().__init__('searchlight')
        self.wanted, self.reported, self.is_stopped = BRIGHTNESS, math.inf, False
        self.enable = self.create_client(SetBool, f'{LIGHT}/enable')
        self.setpoint = self.create_publisher(Float32, f'{LIGHT}/cmd/brightness', 10)
        self.create_subscription(Float32, f'{LIGHT}/brightness', self.take_brightness, STATE)
        self.create_subscription(DiagnosticArray, '/diagnostics', self.take_diagnostics, 10)
        # Repeated, so that off_after_silence of the bridge ends the light with this program.
        self.create_timer(0.5, lambda: self.setpoint.publish(Float32(data=self.wanted)))

    def take_brightness(self, message: Float32) -> None:
        self.reported = message.data

    def take_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            node = {one.key: one.value for one in status.values}.get('node')
            if node == LIGHT and status.name.endswith(': lamp'):
                self.wanted = DIMMED if status.level > DiagnosticStatus.OK else BRIGHTNESS

    def stop(self, *signal_and_frame: object) -> None:
        self.is_stopped = True

    def turn(self) -> None:
        rclpy.spin_once(self)
        if self.is_stopped:
            sys.exit()

    def switch(self, on: bool) -> None:
        # The answer to the first call of a program may be lost.
        for _ in range(3):
            answer = self.enable.call_async(SetBool.Request(data=on))
            rclpy.spin_until_future_complete(self, answer, timeout_sec=4.0)
            if result := answer.result():
                break
        if not result or not result.success:
            reason = result.message if result else 'no answer'
            sys.exit(f'{"on" if on else "off"} failed: {reason}')


def main() -> None:
    # By default Ctrl-C ends ROS, and the light could not be switched off any more.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    light = Searchlight()
    if not light.enable.wait_for_service(4.0):
        sys.exit(f'{light.enable.service_name}: no such service; nodes in the ROS domain '
                 f'{light.context.get_domain_id()}: {", ".join(light.get_node_names())}')
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, light.stop)
    try:
        while light.reported > BRIGHTNESS + 0.5:
            light.turn()
        light.switch(True)
        while True:
            light.turn()
    finally:
        light.switch(False)


if __name__ == '__main__':
    main()
