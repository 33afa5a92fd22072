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

"""Requirements and their results."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Generic, Protocol, TypeVar

from .session import Session
from .transaction import Finding


class Failed(Exception):
    """
    The device does not meet a requirement; the text gives the deviation.

    :ivar lines: the lines of the log that show it, None for all of the check.
    """

    def __init__(self, reason: str, lines: list[str] | None = None) -> None:
        super().__init__(reason)
        self.lines = lines


class Skipped(Exception):
    """A requirement cannot be checked here; the text gives the reason."""


def fail_if(findings: Iterable[Finding | None]) -> None:
    """
    Raise if there are findings.

    :raises Failed: with all of them.
    """
    if found := [one for one in findings if one is not None]:
        raise Failed('; '.join(one.text for one in found),
                     [line for one in found for line in one.lines])


class Verdict(Enum):
    """The verdict of a check."""

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
MESSAGES = Specification('common message set', _GUIDE + 'messages/common.html')
ROUTING = Specification('routing', _GUIDE + 'guide/routing.html')
SERIALIZATION = Specification('serialization', _GUIDE + 'guide/serialization.html')


@dataclass(frozen=True)
class Conditions:
    """
    The conditions of a run.

    :param consent: whether the operator has agreed to the checks that need consent.
    :param checksum_errors: returns how many frames with a wrong checksum the link has dropped.
    :param options: values of the payload's own options.
    """

    consent: bool = True
    checksum_errors: Callable[[], int] = lambda: 0
    options: Mapping[str, float] = field(default_factory=dict)


class Tester(Protocol):
    """The part of a payload that operates the device; a check gets it."""

    @property
    def session(self) -> Session:
        """Return the session with the device."""

    @property
    def conditions(self) -> Conditions:
        """Return the conditions of the run."""

    @property
    def saved(self) -> str:
        """Return the saved state, as text."""

    async def save(self) -> bool:
        """Save the state of the device; return whether the device reports one."""

    async def restore(self) -> list[str]:
        """Restore the saved state; return the names of what differs from it."""


T = TypeVar('T', bound=Tester, contravariant=True)
Check = Callable[[T], Awaitable['str | None']]


@dataclass(frozen=True)
class Requirement(Generic[T]):
    """
    A requirement on a device.

    :param name: its id, as in ``--only``.
    :param title: what the device does, as a clause without subject.
    :param section: of the specification.
    :param check: returns a measurement as text, or None; raises :class:`Failed` or
        :class:`Skipped`.
    :param changes: whether the check changes the state of the device.
    :param needs_consent: whether the operator must agree to the check.
    :param presence: whether it fails where no device is found; all others are skipped.
    :param whole_run: whether it judges the messages of the whole run, so that it can be checked
        after the device was lost.
    """

    name: str
    title: str
    specification: Specification
    section: str
    check: Check[T]
    changes: bool = False
    needs_consent: bool = False
    presence: bool = False
    whole_run: bool = False


def requirement(
    name: str, title: str, specification: Specification, section: str, *, changes: bool = False,
    needs_consent: bool = False, presence: bool = False, whole_run: bool = False,
) -> Callable[[Check[T]], Requirement[T]]:
    """Return a decorator that makes a check a :class:`Requirement`."""
    def decorate(check: Check[T]) -> Requirement[T]:
        return Requirement(name, title, specification, section, check, changes or needs_consent,
                           needs_consent, presence, whole_run)
    return decorate


@dataclass
class Result:
    """
    The result of a check.

    :param detail: the deviation, the reason for skipping, or a measurement.
    :param exchange: the lines of the log.
    :param seconds: duration of the check.
    :param reached: whether there was a device to check.
    """

    requirement: Requirement[Any]
    verdict: Verdict
    detail: str = ''
    exchange: list[str] = field(default_factory=list)
    seconds: float = 0.0
    reached: bool = True


def periods(times: Sequence[float]) -> list[float]:
    """Return the differences of consecutive times."""
    return [later - earlier for earlier, later in zip(times, times[1:], strict=False)]


def median(values: Sequence[float]) -> float:
    """Return the median, the upper one of two."""
    return sorted(values)[len(values) // 2]
