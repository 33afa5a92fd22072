# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The script that a user would write: pymavlink's recv_match in an rclpy node.

It sends the command and reports success as soon as the command is acknowledged. It neither checks
the status nor resends.
"""

from __future__ import annotations

import contextlib
import os
import sys

os.environ['MAVLINK20'] = '1'

from pymavlink import mavutil  # noqa: E402
import rclpy  # noqa: E402
from rclpy.executors import ExternalShutdownException  # noqa: E402
from std_srvs.srv import SetBool  # noqa: E402

ON_OFF = 405


def main() -> None:
    """Serve the light at the given URL until SIGINT."""
    connection = mavutil.mavlink_connection(sys.argv[1], source_system=1, source_component=191)
    rclpy.init()
    node = rclpy.create_node('straightforward')

    def answer(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        connection.mav.command_long_send(1, 243, ON_OFF, 0, float(request.data), 0, 0, 0, 0, 0, 0)
        while True:
            ack = connection.recv_match(type='COMMAND_ACK', blocking=True, timeout=1.0)
            if ack is None or ack.command == ON_OFF:
                break
        response.success = ack is not None and ack.result == 0
        return response

    def beat() -> None:
        connection.mav.heartbeat_send(18, 8, 0, 0, 4)

    connection.wait_heartbeat()
    node.create_timer(1.0, beat)
    node.create_service(SetBool, '~/enable', answer)
    print('ready', flush=True)
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)


if __name__ == '__main__':
    main()
