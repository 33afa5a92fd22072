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

"""Whether a link counts as open, and telling others when that changes."""

from __future__ import annotations

from collections.abc import Callable

from .link_state import LinkEvent

# Different reasons for not opening that are told apart before the first opening.
MAX_REASONS = 16


class Standing:
    """
    How a link stands with others.

    :param label: what it is called while there is no transport.
    :param tell: takes each event.
    :ivar since: when it was opened or lost, s.
    :ivar reason: why it is not open, '' where it is.
    :ivar openings: how often it was opened.
    """

    def __init__(self, label: str, tell: Callable[[LinkEvent], None], now: float) -> None:
        self.label = label
        self.since = now
        self.reason = 'not opened yet'
        self.openings = 0
        self._tell = tell
        self._reasons: set[str] = set()

    def opened(self, name: str, now: float) -> None:
        """Note that it is open over a transport that leads somewhere, as far as is known."""
        self.since, self.reason = now, ''
        self.openings += 1
        self._tell(LinkEvent(True, name))

    def failed(self, reason: str) -> None:
        """Note that it could not be opened."""
        self.reason = reason
        # Once it has been open, its loss was one line in the log and its return will be another.
        if reason not in self._reasons and len(self._reasons) < MAX_REASONS and not self.openings:
            self._reasons.add(reason)
            self._tell(LinkEvent(False, self.label, reason))

    def lost(self, name: str, reason: str, now: float) -> None:
        """Note that the transport is lost; one that did not count as open has failed to open."""
        if self.reason:
            self.failed(reason)
        else:
            self.since, self.reason = now, reason
            self._tell(LinkEvent(False, name, reason, was_open=True))

    def stopped(self, now: float) -> None:
        """Note that it is closed for good, of which nobody is told."""
        self.since, self.reason = now, 'stopped'
