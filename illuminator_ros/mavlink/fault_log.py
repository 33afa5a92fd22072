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

"""Exceptions that must not end a thread: logged at a limited rate, and followed by a pause."""

from __future__ import annotations

from collections.abc import Callable
import logging
import math

# s; the pause of a loop after an exception, and the shortest time between log lines.
FAULT_PAUSE = 0.1
FAULT_LOG_INTERVAL = 1.0

_log = logging.getLogger(__name__)


class FaultLog:
    """
    Logs exceptions of the functions that a loop calls.

    :ivar pause: the shortest next wait of the loop, s, so that a lasting fault does not use up
        the processor.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self.pause = 0.0
        self._clock = clock
        self._due = -math.inf

    def call(self, function: Callable[..., None], *arguments: object) -> None:
        """Call a function; log its exception."""
        try:
            function(*arguments)
        except Exception:
            self.pause = FAULT_PAUSE
            self.log()

    def log(self) -> None:
        """Log the exception that is handled."""
        if self._clock() >= self._due:
            self._due = self._clock() + FAULT_LOG_INTERVAL
            _log.exception('internal error in the link')
