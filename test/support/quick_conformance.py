# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Run ``conformance`` as users do, but listen for other lights for a shorter time."""

import sys

from illuminator_ros.cli.conformance import main, run

if __name__ == '__main__':
    # s; the lights of the tests send a heartbeat each second. A target is one of several.
    run.LISTEN_TIME = 1.5 if '--target' in sys.argv else 0.1
    sys.exit(main())
