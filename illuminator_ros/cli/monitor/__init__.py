# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The executable ``monitor``: the devices in a ROS graph, as ``top`` shows processes.

``ros_graph`` takes their values from the ROS graph and sends requests, ``app`` is the screen,
``table`` its columns, ``terminal`` the terminal, ``web`` the server for browsers, ``run`` the
command line. Each payload has a view of its own (``ros/monitor_view.py``).
"""

from __future__ import annotations

from collections.abc import Mapping

from ..entry_point import run_program
from ..payloads import PAYLOADS
from ..termination import Termination
from ...payload.payload_type import PayloadType


def main(args: list[str] | None = None, payloads: Mapping[str, PayloadType] = PAYLOADS) -> int:
    """
    Show the devices until ``q`` or a signal; see :mod:`~.run`.

    :param args: the command line without the program's name.
    :param payloads: the payloads whose devices are shown.
    """
    def start(termination: Termination) -> int:
        from .run import run
        return run(args, termination, payloads)

    return run_program('monitor', start)
