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

"""Asking a light again for all that it can tell."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .operation import Done, Result
from ..mavlink.command import CommandResult, format_seconds

if TYPE_CHECKING:
    from .light import Light

# s; two commands one after the other, each with its tries, and the messages after them.
REFRESH_LIMIT = 5.0


class Refresh:
    """
    Asks for COMPONENT_INFORMATION_BASIC and ILLUMINATOR_STATUS.

    It is a success when a status has come: not every light has an identity to tell.
    """

    def __init__(self, light: Light, now: float, done: Done) -> None:
        self.finished = False
        self.until = now + REFRESH_LIMIT
        self._done = done
        self._started = now
        self._identity: str | None = None
        self._status: str | None = None
        light.identification.ask(now, self._identified)
        light.request_status(now, self._answered)

    def status(self, now: float) -> None:
        """Note that a status has come."""
        self._status = ''
        self._check(now)

    def _identified(self, failure: str, now: float) -> None:
        self._identity = failure
        self._check(now)

    def _answered(self, outcome: CommandResult, now: float) -> None:
        if not outcome.accepted and self._status is None:
            self._status = outcome.describe()
            self._check(now)

    def poll(self, now: float) -> None:
        """Give up when it is time."""
        if now >= self.until:
            self._identity = 'nothing came' if self._identity is None else self._identity
            self._status = 'nothing came' if self._status is None else self._status
            self._check(now)

    def _check(self, now: float) -> None:
        if self.finished or self._identity is None or self._status is None:
            return
        self.finished = True
        parts = [f'{name}: {failure or "received"}' for name, failure in (
            ('ILLUMINATOR_STATUS', self._status),
            ('COMPONENT_INFORMATION_BASIC', self._identity))]
        self._done(Result(
            not self._status,
            f'{", ".join(parts)} ({format_seconds(now - self._started)})'), now)
