# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The least work in rclpy: a node with a SetBool server that does nothing."""

from __future__ import annotations

import contextlib
import sys

import rclpy
from rclpy.executors import ExternalShutdownException
from std_srvs.srv import SetBool


def main() -> None:
    """Serve until SIGINT."""
    rclpy.init()
    node = rclpy.create_node(sys.argv[1] if len(sys.argv) > 1 else 'empty')

    def answer(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success = True
        return response

    node.create_service(SetBool, '~/enable', answer)
    print('ready', flush=True)
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)


if __name__ == '__main__':
    main()
