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

"""Values of a light's configuration that must be sent though no request has asked for them."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass, field, replace
from enum import IntEnum
import math

from .model import Changes
from ..payload.attempt import Result

# s; rqt_reconfigure gives up after 1.0 s, and the answer must arrive before. The middleware waits
# up to 0.1 s before it sends an answer to a client that it has not discovered yet.
CONFIGURE_LIMIT = 0.78
# s between tries that got no answer.
RESTORE_INTERVAL = 2.0
# s for each try after the first one: no ON waits for it, and the line may be slow.
RETRY_LIMIT = 1.5
# Attempts before giving up on a light that accepts a configuration but does not apply it.
MAX_CONTRADICTIONS = 3


class Requirement(IntEnum):
    """The reason why values must be sent; the highest counts."""

    OTHER_SENDER = 0
    OVERRIDE = 1
    LIMIT = 2
    RESTART = 3


@dataclass
class RequiredValues:
    """
    Values that must be sent, and the attempts to send them. Times are s.

    :param values: by name, empty if there are none.
    :param attempts: how often the light has accepted them but then reported others.
    :param due: when they are sent next.
    :param is_sent: whether a command with them was sent.
    :param has_ended: whether a command with them has ended, or none can be sent.
    :param failure: why the last attempt failed, '' if it did not.
    """

    values: Changes = field(default_factory=dict)
    requirement: Requirement = Requirement.OTHER_SENDER
    due: float = math.inf
    attempts: int = 0
    is_sent: bool = False
    has_ended: bool = False
    failure: str = ''

    @property
    def limit(self) -> float:
        """Return s that the next attempt may take."""
        return RETRY_LIMIT if self.has_ended else CONFIGURE_LIMIT

    @property
    def is_sent_once(self) -> bool:
        """Whether they are dropped when the light has accepted and not applied them."""
        # A RepeatLimit limits further attempts.
        return self.requirement in (Requirement.LIMIT, Requirement.OTHER_SENDER)

    @property
    def delays_on(self) -> bool:
        """Whether an ON waits until a command with them has ended."""
        return (bool(self.values) and not self.has_ended
                and self.requirement is not Requirement.OTHER_SENDER)

    def merged(self, values: Changes, requirement: Requirement, due: float) -> RequiredValues:
        """Return these values and others; only overrides replace values that wait."""
        both = ({**self.values, **values} if requirement is Requirement.OVERRIDE
                else {**values, **self.values})
        return RequiredValues(both, max(requirement, self.requirement), due)

    def without(self, names: Container[str]) -> RequiredValues:
        """Return the values of the other fields."""
        values = {name: value for name, value in self.values.items() if name not in names}
        return replace(self, values=values) if values else RequiredValues()

    def retry(self, due: float) -> None:
        """Send them again: the light is heard, or a command was cancelled."""
        if self.due < math.inf:
            self.due, self.has_ended = due, False

    def is_given_up(self, failed: Result, now: float) -> bool:
        """Take the result of a command that has failed; return whether no other one is sent."""
        if not self.is_sent:
            # The command was for values that these have replaced.
            return False
        if failed.superseded:
            self.due = now
            return False
        self.has_ended = True
        self.failure = failed.message
        self.attempts += failed.contradicted
        return (failed.permanent or self.attempts >= MAX_CONTRADICTIONS
                or bool(self.attempts) and self.is_sent_once)
