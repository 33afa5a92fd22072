# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The executable ``set``: sets values of one device, and waits until each is confirmed."""

from __future__ import annotations

from ..entry_point import run_program
from ..termination import Termination


def main(args: list[str] | None = None) -> int:
    """
    Set values and return the exit status; see :mod:`~.run`.

    :param args: the command line without the program's name.
    """
    def start(termination: Termination) -> int:
        from .run import run
        return run(args, termination)

    return run_program('set', start)
