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
