# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Run ``doctor`` as users do, without the ports of this machine, which other tests use."""

import sys

from illuminator_ros.cli.discover import run
from illuminator_ros.cli.doctor import main
from illuminator_ros.mavlink.transport import ports

if __name__ == '__main__':
    run.UDP_PORTS = ()  # type: ignore[assignment]
    ports.serial_ports = dict  # type: ignore[assignment]
    sys.exit(main())
