# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Waiting for results of other threads, without sleeping."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import threading
import time
from typing import Generic, TypeVar

T = TypeVar('T')

# s; longer than any wait of a passing test on a busy machine.
PATIENCE = 30.0


class Log(Generic[T]):
    """A list to which other threads append; a test can wait for its entries."""

    def __init__(self) -> None:
        self._entries: list[T] = []
        self._changed = threading.Condition()

    def append(self, entry: T) -> None:
        """Add an entry."""
        with self._changed:
            self._entries.append(entry)
            self._changed.notify_all()

    def clear(self) -> None:
        """Forget all entries."""
        with self._changed:
            self._entries.clear()

    def __iter__(self) -> Iterator[T]:
        with self._changed:
            return iter(list(self._entries))

    def __len__(self) -> int:
        return len(self._entries)

    def __getitem__(self, index: int) -> T:
        return self._entries[index]

    def wait_for(
        self, wanted: Callable[[T], object], *, count: int = 1, since: int = 0,
        within: float = PATIENCE,
    ) -> T:
        """Return the count-th wanted entry from a position on."""
        def found() -> list[T]:
            return [entry for entry in self._entries[since:] if wanted(entry)]

        with self._changed:
            if not self._changed.wait_for(lambda: len(found()) >= count, within):
                raise AssertionError(f'not within {within} s; there is {self._entries[-20:]}')
            return found()[count - 1]


def eventually(
    condition: Callable[[], T], what: str = 'the condition', within: float = PATIENCE,
) -> T:
    """Wait for a condition that no event announces, and return its value."""
    until = time.monotonic() + within
    pause = threading.Event()
    while not (value := condition()):
        assert time.monotonic() < until, f'not within {within} s: {what}'
        pause.wait(0.005)
    return value
