# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Requirements, the checks of a payload, which consist of requirements, and their results."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Generic, NamedTuple, TypeVar

from .session import Session
from .specifications import Specification

NOT_AGREED = 'not agreed to; see --yes'
T = TypeVar('T', bound=Session, contravariant=True)
Check = Callable[[T], Awaitable['str | None']]


class CheckVerdict(Enum):
    """The verdict of a check."""

    PASS = 'PASS'
    FAIL = 'FAIL'
    SKIPPED = 'SKIPPED'


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


# For the runner and the reports, which do not use the session.
AnyRequirement = Requirement[Any]


@dataclass(frozen=True)
class CheckResult:
    """
    The result of a check.

    :param detail: the deviation, the reason for skipping, or a measurement.
    :param exchange: the lines of the log.
    :param seconds: duration of the check.
    :param reached: whether there was a device to check.
    """

    requirement: AnyRequirement
    verdict: CheckVerdict
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
    :param session: a session with such a device.
    :param evidence: the messages that identify a device, as text.
    :param risk: the actions of the device in the checks that need consent, as a clause.
    :param question: asked before these checks; ``{device}`` and the options are filled in.
    :param options: options of the command line, for :class:`Conditions`.
    :param mavlink_version: the version that the device needs, 1 or 2; None if it takes both.
    :param traces: the changes that remain after the device is restored, as text.
    """

    payload: str
    device: str
    session: type[T]
    evidence: str
    requirements: tuple[Requirement[T], ...]
    risk: str = ''
    question: str = ''
    options: tuple[Option, ...] = ()
    mavlink_version: int | None = None
    traces: str = ''


# For the command line, which does not use the operations of a session.
AnyChecks = PayloadChecks[Any]
