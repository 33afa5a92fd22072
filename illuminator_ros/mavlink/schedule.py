# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The schedule of a link: when its parts want to be called again; no I/O."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import contextlib
import functools
import math

Call = Callable[[float], None]


def call_each(functions: Sequence[Callable[..., None]], *arguments: object) -> None:
    """Call functions in their order; raise the exception of one once all have been called."""
    with contextlib.ExitStack() as calls:
        # The stack calls the last one first.
        for function in reversed(functions):
            calls.callback(function, *arguments)


class Schedule:
    """
    The functions that want to be called with the time, and when: each once. Times are s.

    A function that is called early does nothing, and says again when it wants to be called.
    """

    def __init__(self) -> None:
        self._times: dict[Call, float] = {}

    @property
    def due(self) -> float:
        """Return when the next call is due; infinity for never."""
        return min(self._times.values(), default=math.inf)

    def at(self, call: Call, time: float) -> None:
        """Have a function called at a time, and not at the one before; infinity for never."""
        if time < math.inf:
            self._times[call] = time
        else:
            self._times.pop(call, None)

    def by(self, call: Call, time: float) -> None:
        """Have a function called at a time, or at the one before if that is earlier."""
        if time < self._times.get(call, math.inf):
            self._times[call] = time

    def run(self, now: float) -> None:
        """
        Call the functions that are due, in the order of their times.

        :raises Exception: of one of them, once all have been called; it is called again.
        """
        due = sorted((call for call, time in self._times.items() if time <= now),
                     key=self._times.__getitem__)
        call_each([functools.partial(self._call, one) for one in due], now)

    def _call(self, call: Call, now: float) -> None:
        # One that was called before may have changed its time.
        if self._times.get(call, math.inf) > now:
            return
        del self._times[call]
        try:
            call(now)
        except Exception:
            # It could not say when it wants to be called again.
            self.by(call, now)
            raise
