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
A bare publisher that datagrams control.

``publish COUNT INTERVAL``: publish the time of publishing COUNT times, INTERVAL s apart.
``relay TIME``: publish TIME at once.
"""

from __future__ import annotations

import contextlib
import socket
import sys
import time

import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64


def main() -> None:
    """Publish until SIGINT; the argument is the UDP port to listen on."""
    rclpy.init()
    node = rclpy.create_node('publisher')
    # The QoS of the bridge's state topics.
    publisher = node.create_publisher(Float64, '~/time', QoSProfile(
        depth=1, reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL))
    control = socket.socket(type=socket.SOCK_DGRAM)
    control.bind(('127.0.0.1', int(sys.argv[1])))
    print('ready', flush=True)
    with contextlib.suppress(KeyboardInterrupt):
        while True:
            what, *numbers = control.recv(100).split()
            if what == b'relay':
                publisher.publish(Float64(data=float(numbers[0])))
                continue
            for _ in range(int(numbers[0])):
                publisher.publish(Float64(data=time.monotonic()))
                time.sleep(float(numbers[1]))


if __name__ == '__main__':
    main()
