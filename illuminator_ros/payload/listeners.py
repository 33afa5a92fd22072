# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Events, which any number of listeners take."""

from __future__ import annotations

from collections.abc import Callable
import logging
from typing import Generic, TypeVar

E = TypeVar('E')

_log = logging.getLogger(__name__)


class Listeners(Generic[E]):
    """The listeners to the events of one source; all are called in the link's thread."""

    def __init__(self) -> None:
        self._listeners: list[Callable[[E], None]] = []

    def subscribe(self, listener: Callable[[E], None]) -> None:
        """Call a listener with each event from now on, after those that subscribed before it."""
        self._listeners.append(listener)

    def emit(self, event: E) -> None:
        """Give an event to each listener, even if others raise an exception."""
        for listener in self._listeners:
            try:
                listener(event)
            except Exception:
                _log.exception('A listener failed on %s; the others were called', event)
