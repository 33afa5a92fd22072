# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

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
