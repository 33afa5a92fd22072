# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A searchlight: on at low brightness, dimmer when it reports a problem, off at the end."""

import math
import signal
import sys
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Float32
from std_srvs.srv import SetBool

# Change these: the node of the light, its brightness usually and with a problem, %, and how long
# to wait for the light to show it first, s.
LIGHT = 'illuminator'
BRIGHTNESS, DIMMED = 40.0, 10.0
TIMEOUT = 10.0

STATE = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Searchlight(Node):

    def __init__(self) -> None:
        super().__init__('searchlight')
        self.wanted, self.reported, self.is_stopped = BRIGHTNESS, math.inf, False
        self.findings: dict[str, str] = {}
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
            if node == self.resolve_topic_name(LIGHT):
                is_fine = status.level == DiagnosticStatus.OK
                self.findings[status.name] = '' if is_fine else status.message
                if status.name.endswith(': lamp'):
                    self.wanted = BRIGHTNESS if is_fine else DIMMED

    def stop(self, *signal_and_frame: object) -> None:
        self.is_stopped = True

    def run(self) -> str:
        """Return why the light cannot be used, '' after a signal."""
        deadline = time.monotonic() + TIMEOUT
        while self.reported > BRIGHTNESS + 0.5:
            rclpy.spin_once(self, timeout_sec=0.1)
            if self.is_stopped:
                return ''
            if time.monotonic() > deadline:
                known = math.isfinite(self.reported)
                return '; '.join([
                    f'no brightness of {BRIGHTNESS:g} % within {TIMEOUT:g} s: the light reports '
                    + (f'{self.reported:g} %' if known else 'none'),
                    *filter(None, self.findings.values())])
        if failure := self.switch(True):
            return failure
        while not self.is_stopped:
            rclpy.spin_once(self)
        return ''

    def switch(self, on: bool) -> str:
        """Return why it failed, '' if it succeeded."""
        # The answer to the first call of a program may be lost.
        for _ in range(3):
            answer = self.enable.call_async(SetBool.Request(data=on))
            rclpy.spin_until_future_complete(self, answer, timeout_sec=4.0)
            if result := answer.result():
                break
        if result and result.success:
            return ''
        return f'{"on" if on else "off"} failed: {result.message if result else "no answer"}'


def main() -> None:
    # By default Ctrl-C ends ROS, and the light could not be switched off any more.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    light = Searchlight()
    if not light.enable.wait_for_service(4.0):
        nodes = light.get_fully_qualified_node_names()
        sys.exit(f'{light.enable.service_name}: no such service; nodes in the ROS domain '
                 f'{light.context.get_domain_id()}: {", ".join(nodes)}')
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, light.stop)
    failures = []
    try:
        failures.append(light.run())
    finally:
        failures.append(light.switch(False))
    sys.exit('\n'.join(filter(None, failures)) or 0)


if __name__ == '__main__':
    main()
