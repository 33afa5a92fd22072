# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The executable ``discover``: finds the port of a device. It sends nothing; no ROS."""

from __future__ import annotations

from ..entry_point import end_on_signals, escape_output, explained


def main(args: list[str] | None = None) -> int:
    """
    Listen on all ports, print what is heard, and return the exit status.

    :param args: the command line without the program's name, by default from ``sys.argv``.
    """
    end_on_signals()
    escape_output()

    def start() -> int:
        from .run import run
        return run(args)

    return explained('discover', start)
