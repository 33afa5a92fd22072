# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``python3 -m illuminator_ros.monitor``: a terminal view of lights."""

import sys

from .cli.monitor import main

if __name__ == '__main__':
    sys.exit(main())
