# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A bare publisher: a datagram has it publish the time COUNT times, INTERVAL s apart."""

from __future__ import annotations

import contextlib
import socket
import sys
import time

import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Float64


def main() -> None:
    """Publish until SIGINT; the argument is the UDP port to listen on."""
    rclpy.init()
    node = rclpy.create_node('publisher')
    # The QoS of the bridge's state topics.
    publisher = node.create_publisher(
        Float64, '~/time', QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    control = socket.socket(type=socket.SOCK_DGRAM)
    control.bind(('127.0.0.1', int(sys.argv[1])))
    print('ready', flush=True)
    with contextlib.suppress(KeyboardInterrupt):
        while True:
            count, interval = control.recv(100).split()
            for _ in range(int(count)):
                publisher.publish(Float64(data=time.monotonic()))
                time.sleep(float(interval))


if __name__ == '__main__':
    main()
