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
