# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The serial numbers that one address has sent: several within a minute are several lights."""

from __future__ import annotations

import math

# s for which a serial number counts, and between the requests while several do.
LIFETIME, INTERVAL = 60.0, 10.0
# So many are kept: a faulty light may send ever new ones.
MAX_SERIALS = 8


class SerialNumbers:
    """
    Shows whether several lights share an address. No I/O; times are s.

    Each of them answers the same request, so the identity is asked for again while several count.
    No outcome of a request depends on it.
    """

    def __init__(self) -> None:
        # When each was received last, the oldest first.
        self._received: dict[str, float] = {}
        self._asked_at = -math.inf

    def note(self, serial: str, now: float) -> None:
        """Note a serial number, '' where the light has none."""
        self._forget(now)
        if serial:
            self._received.pop(serial, None)
            self._received[serial] = now
            if len(self._received) > MAX_SERIALS:
                del self._received[next(iter(self._received))]

    def shared(self, now: float) -> tuple[str, ...]:
        """Return the serial numbers that count, empty unless there are several."""
        found = tuple(sorted(
            one for one, at in self._received.items() if now < at + LIFETIME))
        return found if len(found) > 1 else ()

    def clear(self) -> None:
        """Forget all: the light is lost, and another one may take its place."""
        self._received.clear()

    def _forget(self, now: float) -> None:
        for one in [one for one, at in self._received.items() if now >= at + LIFETIME]:
            del self._received[one]

    def is_due(self, now: float) -> bool:
        """Return whether the identity must be asked for now, and note that it is."""
        if now < self.due:
            return False
        self._forget(now)
        self._asked_at = now
        return True

    @property
    def due(self) -> float:
        """Return when :meth:`is_due` is true next, infinity if never."""
        return self._asked_at + INTERVAL if len(self._received) > 1 else math.inf
