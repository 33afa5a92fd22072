# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Outcomes of a check other than that its requirement is met."""

from __future__ import annotations

from collections.abc import Iterable


class DeviceLost(Exception):
    """The device has stopped sending."""


class Skipped(Exception):
    """A requirement cannot be checked; the text gives the reason."""


class Failed(Exception):
    """
    The device does not meet a requirement; the text gives the deviation.

    :ivar lines: the lines of the log that show the deviation, None for all lines of the check.
    """

    def __init__(self, reason: str, lines: list[str] | None = None) -> None:
        super().__init__(reason)
        self.lines = lines


def fail_if(failures: Iterable[Failed | None]) -> None:
    """
    Raise if there are failures.

    :raises Failed: with all of them.
    """
    if found := [one for one in failures if one is not None]:
        raise Failed('; '.join(map(str, found)),
                     [line for one in found for line in one.lines or ()])
