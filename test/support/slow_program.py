# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Run a module of this package by the clock of :mod:`support.slow`."""

from __future__ import annotations

from functools import partial
from importlib import import_module
from runpy import run_module
import signal
import sys
from typing import Any

from illuminator_ros.cli.termination import ENDING

# Program -> the module that constructs its objects with a clock: links, or a monitor.
PLACES = {'illuminator_ros.bridge': 'illuminator_ros.ros.bridge',
          'illuminator_ros.gimbal': 'illuminator_ros.ros.bridge',
          'illuminator_ros.rededge': 'illuminator_ros.ros.bridge',
          'illuminator_ros.simulator': 'illuminator_ros.cli.simulator.run',
          'illuminator_ros.monitor': 'illuminator_ros.cli.monitor.run'}


def main(module: str) -> None:
    """Run a module with the rest of the command line."""
    # Block signals before the imports, as the module does: threads that start during the imports
    # must not take them.
    signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)
    from support.slow import CLOCK, SlowLink
    from support.waiting import PATIENCE
    place: Any = import_module(PLACES[module])
    if hasattr(place, 'Link'):
        place.Link = SlowLink
    if hasattr(place, 'Graph'):
        place.Graph = partial(place.Graph, clock=CLOCK)
    # An orderly end may take longer on a busy machine.
    import_module('illuminator_ros.cli.termination').LIMIT = PATIENCE  # type: ignore[attr-defined]
    if hasattr(place, 'OFF_LIMIT'):
        place.OFF_LIMIT = PATIENCE / 5
    # Timers of rclpy, which use the clock of this machine.
    for name, seconds in (('TICK', 0.2), ('GRAPH_INTERVAL', 0.5)):
        if hasattr(place, name):
            setattr(place, name, seconds)
    run_module(module, run_name='__main__')


if __name__ == '__main__':
    main(sys.argv.pop(1))
