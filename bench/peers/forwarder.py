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

"""A bare UDP forwarder: datagrams to the first port go to the second one."""

from __future__ import annotations

import contextlib
import socket
import sys


def main() -> None:
    """Forward until SIGINT."""
    with socket.socket(type=socket.SOCK_DGRAM) as line:
        line.bind(('127.0.0.1', int(sys.argv[1])))
        target = '127.0.0.1', int(sys.argv[2])
        print('ready', flush=True)
        with contextlib.suppress(KeyboardInterrupt):
            while True:
                line.sendto(line.recv(2048), target)


if __name__ == '__main__':
    main()
