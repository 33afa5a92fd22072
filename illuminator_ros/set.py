# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``python3 -m illuminator_ros.set``: sets values of a device."""

import sys

from .cli.set import main

if __name__ == '__main__':
    sys.exit(main())
