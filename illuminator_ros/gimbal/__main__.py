# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``python3 -m illuminator_ros.gimbal``: the bridge with the payload gimbal."""

import sys

from ..cli.bridge import gimbal

if __name__ == '__main__':
    sys.exit(gimbal())
