# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``python3 -m illuminator_ros.gimbal_manager``: the bridge as the manager of a gimbal."""

import sys

from .cli.bridge import gimbal_manager

if __name__ == '__main__':
    sys.exit(gimbal_manager())
