# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The executable ``conformance``: checks a device against its MAVLink protocols, without ROS."""

from __future__ import annotations

from collections.abc import Mapping

from ..entry_point import end_on_signals, escape_output, explained
from ..payloads import PAYLOADS
from ...payload.payload_type import PayloadType


def main(
    args: list[str] | None = None, payloads: Mapping[str, PayloadType] = PAYLOADS,
) -> int:
    """
    Check a device, and return the exit status.

    :param args: the command line without the program's name, by default from ``sys.argv``.
    :param payloads: the kinds of payloads that ``--payload`` may name.
    """
    end_on_signals()
    escape_output()

    def start() -> int:
        from .run import run
        return run(args, payloads)

    return explained('conformance', start)
