# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Run ``discover`` as users do, without the UDP ports of this machine, which other tests use."""

import sys

from illuminator_ros.cli.discover import main, run

if __name__ == '__main__':
    run.UDP_PORTS = ()  # type: ignore[assignment]
    run.serial_ports = dict  # type: ignore[attr-defined, assignment]
    sys.exit(main())
