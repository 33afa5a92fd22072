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

"""A bare receive loop, the least work in Python: it reads data and discards it."""

from __future__ import annotations

import contextlib
import os
import socket
import sys
import tty


def main() -> None:
    """Read from ``udp PORT``, ``tcp PORT`` or ``serial DEVICE`` until SIGINT."""
    kind, where = sys.argv[1:]
    if kind == 'udp':
        listener = socket.socket(type=socket.SOCK_DGRAM)
        listener.bind(('127.0.0.1', int(where)))
        descriptor = listener.detach()
    elif kind == 'tcp':
        descriptor = socket.create_connection(('127.0.0.1', int(where))).detach()
    else:
        descriptor = os.open(where, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(descriptor)
    print('ready', flush=True)
    with contextlib.suppress(KeyboardInterrupt):
        while os.read(descriptor, 4096):
            pass


if __name__ == '__main__':
    main()
