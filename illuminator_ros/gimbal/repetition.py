# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Messages of topics that ask for what the message before asked for."""

from __future__ import annotations

from collections.abc import Hashable
import math

# s between equal messages that are sent though no status shows what they ask for.
EQUAL_INTERVAL = 1.0


class Repetition:
    """
    Tells which messages of topics ask for nothing new, so that a held key does not fill the line.

    No I/O; times are s.
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Send the next message in any case: something else was asked for, or may be the case."""
        self._before: Hashable = None
        self._sent_at = -math.inf

    def is_needless(self, wish: Hashable, now: float, *, is_shown: bool, moves: bool) -> bool:
        """
        Take a message; return whether it need not be sent.

        :param wish: what it asks for.
        :param is_shown: whether the newest status shows that.
        :param moves: whether the device moves, or may move.
        """
        if wish == self._before and not moves and (
                is_shown or now < self._sent_at + EQUAL_INTERVAL):
            return True
        self._before, self._sent_at = wish, now
        return False
