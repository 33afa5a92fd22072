# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A bare subscriber of rates, which sends each to a UDP port of the loopback interface."""

from __future__ import annotations

import contextlib
import socket
import struct
import sys

from geometry_msgs.msg import Vector3Stamped
import rclpy
from rclpy.qos import QoSProfile, ReliabilityPolicy


def main() -> None:
    """Send until SIGINT; the argument is the UDP port to send to."""
    rclpy.init()
    node = rclpy.create_node('subscriber')
    sender = socket.socket(type=socket.SOCK_DGRAM)
    sender.connect(('127.0.0.1', int(sys.argv[1])))

    def forward(message: Vector3Stamped) -> None:
        vector = message.vector
        sender.send(struct.pack('<3f', vector.x, vector.y, vector.z))

    node.create_subscription(Vector3Stamped, '~/cmd/rate', forward, QoSProfile(
        depth=10, reliability=ReliabilityPolicy.BEST_EFFORT))
    print('ready', flush=True)
    with contextlib.suppress(KeyboardInterrupt):
        rclpy.spin(node)


if __name__ == '__main__':
    main()
