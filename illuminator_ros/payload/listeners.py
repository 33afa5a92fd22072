# Copyright 2026 The illuminator_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

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
