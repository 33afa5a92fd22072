# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""pymavlink's receive loop; at its end it prints the number of received frames."""

from __future__ import annotations

import os
import sys

os.environ['MAVLINK20'] = '1'

from pymavlink import mavutil  # noqa: E402


def main() -> None:
    """Receive from a pymavlink connection string until SIGINT; a device needs a baud rate."""
    device, *baud = sys.argv[1].split(',')
    connection = mavutil.mavlink_connection(device, *(int(rate) for rate in baud))
    count = 0
    print('ready', flush=True)
    try:
        while True:
            if connection.recv_match(blocking=True) is not None:
                count += 1
    except KeyboardInterrupt:
        print(f'frames {count}', flush=True)


if __name__ == '__main__':
    main()
