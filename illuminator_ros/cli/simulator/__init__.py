# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The executable ``simulator``: MAVLink devices without hardware, and without ROS."""

from __future__ import annotations

from collections.abc import Mapping
import sys

from ..entry_point import run_program
from ..payloads import PAYLOADS
from ..termination import Termination
from ...payload.payload_type import PayloadType


def main(
    args: list[str] | None = None, payloads: Mapping[str, PayloadType] = PAYLOADS,
) -> int:
    """
    Run the simulator until a signal; see :mod:`~.run`.

    :param args: the command line without the program's name.
    :param payloads: the kinds of payloads that ``--payload`` may name.
    """
    # The live view needs the terminal itself; only the view waits while the terminal is stopped.
    # The exit status after --help depends on whether the text was written.
    texts = {'-h', '--help', '--version'}.intersection(sys.argv[1:] if args is None else args)
    live = sys.stdout is not None and sys.stdout.isatty()

    def start(termination: Termination) -> int:
        termination.queue_output(*([2] if live or texts else [1, 2]))
        from .run import run
        return run(args, termination, payloads)

    return run_program('simulator', start)
