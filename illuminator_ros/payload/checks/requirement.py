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

"""Requirements, the checks of a payload, which consist of requirements, and their results."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from .components import Components
from .record import Record
from .session import Session
from ...mavlink.messages import Address, CommandAck, Heartbeat, Message

NOT_AGREED = 'not agreed to; see --yes'


class Specification(NamedTuple):
    """A page that contains requirements."""

    title: str
    url: str


# Pages of the MAVLink guide.
_GUIDE = 'https://mavlink.io/en/'
HEARTBEAT = Specification('heartbeat protocol', _GUIDE + 'services/heartbeat.html')
COMMAND = Specification('command protocol', _GUIDE + 'services/command.html')
MESSAGES = Specification('common message set', _GUIDE + 'messages/common.html')
ROUTING = Specification('routing', _GUIDE + 'guide/routing.html')
SERIALIZATION = Specification('serialization', _GUIDE + 'guide/serialization.html')


class Verdict(Enum):
    """The verdict of a check."""

    PASS = 'PASS'
    FAIL = 'FAIL'
    SKIPPED = 'SKIPPED'


@dataclass(frozen=True)
class Conditions:
    """
    The conditions of a run.

    :param consent: whether the operator has agreed to the checks that need consent.
    :param checksum_errors: returns how many frames with a wrong checksum the link has dropped.
    :param utc: returns the time, s since 1970.
    :param options: the values of the options that only this payload has.
    """

    consent: bool = True
    checksum_errors: Callable[[], int] = lambda: 0
    options: Mapping[str, float] = field(default_factory=dict)
    utc: Callable[[], float] = lambda: 0.0


class Tester(Protocol):
    """
    The part of a payload that operates the device; the argument of each check.

    :ivar session: the session with the device.
    :ivar conditions: the conditions of the run.
    """

    session: Session
    conditions: Conditions

    @property
    def saved(self) -> str:
        """Return the saved state, as text."""

    async def save(self) -> bool:
        """Save the state of the device; return whether the device reports one."""

    async def restore(self) -> list[str]:
        """Restore the saved state; return the names of the values that still differ from it."""


T = TypeVar('T', bound=Tester, contravariant=True)
Check = Callable[[T], Awaitable['str | None']]


@dataclass(frozen=True)
class Requirement(Generic[T]):
    """
    A requirement on a device.

    :param name: its id, as in ``--only``.
    :param title: the required behaviour of the device, as a clause without a subject.
    :param section: of the specification.
    :param check: returns a measurement as text, or None; raises ``Failed`` or ``Skipped``.
    :param changes: whether the check changes the state of the device.
    :param needs_consent: whether the operator must agree to the check, which then also changes
        the state of the device.
    :param presence: whether it fails if no device is found; all other requirements are skipped.
    :param whole_run: whether it is about the messages of the whole run, so that it can be checked
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

    @property
    def place(self) -> str:
        """Return the section of the specification, as text."""
        return f'{self.specification.title}, "{self.section}"'


def requirement(
    name: str, title: str, specification: Specification, section: str, **flags: bool,
) -> Callable[[Check[T]], Requirement[T]]:
    """Return a decorator that makes a :class:`Requirement` of a check, with its flags."""
    changes = flags.pop('changes', False) or flags.get('needs_consent', False)
    return lambda check: Requirement(
        name, title, specification, section, check, changes, **flags)


# For the runner and the reports, which do not use the tester.
AnyRequirement = Requirement[Any]


@dataclass(frozen=True)
class Result:
    """
    The result of a check.

    :param detail: the deviation, the reason for skipping, or a measurement.
    :param exchange: the lines of the log.
    :param seconds: duration of the check.
    :param reached: whether there was a device to check.
    """

    requirement: AnyRequirement
    verdict: Verdict
    detail: str = ''
    exchange: list[str] = field(default_factory=list)
    seconds: float = 0.0
    reached: bool = True


class Option(NamedTuple):
    """An option of the command line that only one payload has: a number with a range."""

    name: str
    metavar: str
    default: float
    low: float
    high: float
    help: str  # noqa: A003


@dataclass(frozen=True)
class PayloadChecks(Generic[T]):
    """
    The checks of one payload, as ``PayloadType.checks`` names them.

    :param payload: its name, as in ``--payload``.
    :param device: the kind of device.
    :param messages: the classes of its messages.
    :param is_device: whether a message identifies its sender as a device of this payload.
    :param evidence: those messages, as text.
    :param tester: returns a tester that operates the device of a session.
    :param describe: returns the text of one of its messages, '' for the message's name.
    :param risk: the actions of the device in the checks that need consent, as a clause.
    :param question: asked before these checks; ``{device}`` and the options are filled in.
    :param options: options of the command line, for :attr:`Conditions.options`.
    :param mavlink_version: the version that the device needs, 1 or 2; None if it takes both.
    :param component: the component id that alone identifies a device, see :class:`Components`.
    :param traces: the changes that remain after the device is restored, as text.
    :param discovery: a message that is requested of all components until a device is found.
    :param part_of: returns the component id of a part of the device, see :class:`Components`.
    """

    payload: str
    device: str
    messages: tuple[type[Message], ...]
    is_device: Callable[[Message], bool]
    evidence: str
    tester: Callable[[Session, Conditions], T]
    requirements: tuple[Requirement[T], ...]
    describe: Callable[[Message], str] = lambda message: ''
    risk: str = ''
    question: str = ''
    options: tuple[Option, ...] = ()
    mavlink_version: int | None = None
    component: int | None = None
    traces: str = ''
    discovery: type[Message] | None = None
    part_of: Callable[[Message], int] = lambda message: 0

    def session(self, address: Address, target: Address | None = None) -> Session:
        """Return a session with a device, from our address."""
        received = (Heartbeat, CommandAck, *self.messages)
        return Session(
            address, received,
            Components(address, self.is_device, target, self.component, self.part_of),
            Record(received, self.describe), self.discovery)


# For the command line, which does not use the tester.
AnyChecks = PayloadChecks[Any]
