# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

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
