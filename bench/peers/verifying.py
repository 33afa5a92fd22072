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
The least script that verifies: it waits for the acknowledgement and for a status.

It takes the frames of one light without checking them, resends nothing, and answers no other call
while it waits.
"""

from __future__ import annotations

import contextlib
from pathlib import Path
import socket
import sys

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / 'test')]

from illuminator_ros.illuminator.messages import IlluminatorStatus, STATUS_ID  # noqa: E402
from illuminator_ros.mavlink import messages as mav  # noqa: E402
from illuminator_ros.mavlink.dialect import decode, mavlink  # noqa: E402
import rclpy  # noqa: E402
from rclpy.executors import ExternalShutdownException  # noqa: E402
from std_srvs.srv import SetBool  # noqa: E402
from support.frames import frame_of  # noqa: E402

HEADER, CHECKSUM = 10, 2
# Bytes of the longest datagram.
MAX_DATAGRAM = 65536
US = mav.Address(1, 191)
FRAMES = {on: frame_of(mav.CommandLong(
    1, 243, mavlink.MAV_CMD_ILLUMINATOR_ON_OFF, 0, float(on), 0, 0, 0, 0, 0, 0), source=US)
    for on in (False, True)}


def main() -> None:
    """Serve the light that sends to the given UDP port, until SIGINT."""
    light = socket.socket(type=socket.SOCK_DGRAM)
    light.bind(('127.0.0.1', int(sys.argv[1])))
    rclpy.init()
    node = rclpy.create_node('verifying')

    def answer(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        with contextlib.suppress(BlockingIOError):
            while True:
                light.recv(MAX_DATAGRAM, socket.MSG_DONTWAIT)
        light.sendto(FRAMES[request.data], peer)
        accepted = False
        while not response.success:
            data = light.recv(MAX_DATAGRAM)
            while data:
                end = HEADER + data[1]
                id_, payload = data[7] | data[8] << 8 | data[9] << 16, data[HEADER:end]
                if id_ == mav.CommandAck.id:
                    accepted = True
                elif id_ == STATUS_ID and accepted:
                    status = decode(IlluminatorStatus, payload)
                    response.success = status.enable == request.data
                data = data[end + CHECKSUM:]
        return response

    _, peer = light.recvfrom(MAX_DATAGRAM)
    node.create_service(SetBool, '~/enable', answer)
    print('ready', flush=True)
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)


if __name__ == '__main__':
    main()
