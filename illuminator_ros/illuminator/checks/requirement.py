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

"""What a requirement is, and what becomes of it."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from .bench import Bench


class Failed(Exception):
    """
    The light does not meet a requirement; the text says in what.

    :ivar evidence: the lines of the exchange that show it, None for all that the check saw.
    """

    def __init__(self, reason: str, evidence: list[str] | None = None) -> None:
        super().__init__(reason)
        self.evidence = evidence


def fail_if(findings: Sequence[tuple[str, list[str]] | None]) -> None:
    """Raise if there is something wrong."""
    wrong = [one for one in findings if one is not None]
    if wrong:
        raise Failed('; '.join(text for text, _ in wrong),
                     [line for _, lines in wrong for line in lines])


class Skipped(Exception):
    """A requirement cannot be checked here; the text says why."""


class Verdict(Enum):
    """What a check says."""

    PASS = 'PASS'
    FAIL = 'FAIL'
    SKIPPED = 'SKIPPED'


@dataclass(frozen=True)
class Specification:
    """A page of the MAVLink guide."""

    title: str
    url: str


_GUIDE = 'https://mavlink.io/en/'
HEARTBEAT = Specification('heartbeat protocol', _GUIDE + 'services/heartbeat.html')
COMMAND = Specification('command protocol', _GUIDE + 'services/command.html')
ILLUMINATOR = Specification('illuminator protocol', _GUIDE + 'services/illuminator.html')
MESSAGES = Specification('common message set', _GUIDE + 'messages/common.html')
ROUTING = Specification('routing', _GUIDE + 'guide/routing.html')
SERIALIZATION = Specification('serialization', _GUIDE + 'guide/serialization.html')

Check: TypeAlias = 'Callable[[Bench], Awaitable[str | None]]'


@dataclass(frozen=True)
class Requirement:
    """
    One thing that a light has to do.

    :param section: of the specification.
    :param changes: whether checking it changes the light.
    :param dazzles: whether it makes the light strobe, or shine at 100 %.
    :param check: looks whether it is so and returns what was measured, for people; raises
        :class:`Failed` or :class:`Skipped`.
    """

    name: str
    title: str
    specification: Specification
    section: str
    changes: bool
    dazzles: bool
    check: Check


@dataclass
class Result:
    """
    What became of a requirement.

    :param detail: what is wrong, why it was skipped, or what was measured.
    :param exchange: what was sent and what came, a line each.
    :param reached: whether there was a light to check when its turn came.
    """

    requirement: Requirement
    verdict: Verdict
    detail: str = ''
    exchange: list[str] = field(default_factory=list)
    seconds: float = 0.0
    reached: bool = True


# In the order in which they are checked.
REQUIREMENTS: list[Requirement] = []


def requirement(
    name: str, title: str, specification: Specification, section: str, *,
    changes: bool = False, dazzles: bool = False,
) -> Callable[[Check], Check]:
    """Return a decorator that enters a check in :data:`REQUIREMENTS`."""
    def enter(check: Check) -> Check:
        assert all(other.name != name for other in REQUIREMENTS), name
        REQUIREMENTS.append(Requirement(
            name, title, specification, section, changes or dazzles, dazzles, check))
        return check
    return enter
