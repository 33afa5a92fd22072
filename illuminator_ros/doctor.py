# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``python3 -m illuminator_ros.doctor``."""

import sys

from .cli.doctor import main

if __name__ == '__main__':
    sys.exit(main())
