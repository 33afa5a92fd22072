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

"""The sources of the commands to one device, by rank: which of them holds it."""

from __future__ import annotations

import math
from typing import NamedTuple

from .arbitration import Arbiter, Cause, HolderChanged, Policy

# The source of a request that names none.
DEFAULT = 'default'
# The reasons why a source no longer holds a device.
_REASONS = {
    Cause.CLAIM: ', which has taken it from {}',
    Cause.RELEASE: ': {} has released it',
    Cause.SILENCE: ': {} was silent for source_timeout',
}


class SourceSettings(NamedTuple):
    """
    The sources of commands.

    :param names: the highest first; :data:`DEFAULT` is one of them.
    :param timeout: s of silence after which a source no longer holds a device; infinity for never.
    """

    names: tuple[str, ...]
    timeout: float = math.inf


class Sources(Arbiter[str]):
    """
    Decides which source holds a device. No I/O.

    :param settings: None if commands have no sources, so that none holds the device.
    :ivar are_ranked: whether one of them may hold the device.
    """

    def __init__(self, settings: SourceSettings | None) -> None:
        self.are_ranked = settings is not None
        ranked = settings or SourceSettings((DEFAULT,))
        super().__init__(
            Policy.PRIORITY, ranked.names.index, lease=ranked.timeout, remembers=True)

    def claim(self, source: str, now: float) -> HolderChanged[str] | None:
        """See :meth:`Arbiter.claim`."""
        return super().claim(source, now) if self.are_ranked else None

    def refusal(self, source: str) -> str:
        """Return why a source may not command the device, '' if it may."""
        may = source == self.holder or not self.are_ranked
        return '' if may else f'held by {self.holder or "no source"}'

    def refusal_of_claim(self, source: str) -> str:
        """Return why a claim of a source would be refused, '' if it would not."""
        return '' if self.may_hold(source) else self.refusal(source)

    @property
    def shown_holder(self) -> str | None:
        """Return the holder for snapshots: '' for none, None if commands have no sources."""
        return self.holder or '' if self.are_ranked else None


def describe(change: HolderChanged[str]) -> str:
    """Describe a change of the holder of a device and its cause, for people."""
    reason = _REASONS[change.cause].format(change.before) if change.before else ''
    return f'is held by {change.after or "no source"}{reason}'
