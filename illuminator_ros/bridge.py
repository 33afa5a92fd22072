# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``python3 -m illuminator_ros.bridge``: the bridge between ROS and payloads."""

import sys

from .cli.bridge import main

if __name__ == '__main__':
    sys.exit(main())
