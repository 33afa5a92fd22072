# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``python3 -m illuminator_ros.rededge``: the bridge with the payload rededge."""

import sys

from ..cli.bridge import rededge

if __name__ == '__main__':
    sys.exit(rededge())
