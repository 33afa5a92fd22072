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

"""The checks of one payload, as ``PayloadType.checks`` names them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Generic, NamedTuple

from .describe import describe
from .requirement import Conditions, Requirement, T
from .session import Session
from ...mavlink.messages import Address, Message

NOT_AGREED = 'not agreed to; see --yes'


class Option(NamedTuple):
    """An option of the command line that only this payload has: a number with a range."""

    name: str
    metavar: str
    default: float
    low: float
    high: float
    help: str  # noqa: A003


@dataclass(frozen=True)
class PayloadChecks(Generic[T]):
    """
    The checks of one payload.

    :param payload: its name, as in ``--payload``.
    :param device: the kind of device.
    :param messages: the classes of its messages.
    :param is_device: whether a message identifies its sender as a device of this payload.
    :param evidence: those messages, as text.
    :param tester: returns a tester that operates the device of a session.
    :param describe: text of a message.
    :param identity: what is known of the device, '' if nothing.
    :param risk: what the device does in the checks that need consent, as a clause.
    :param question: asked before them; ``{device}`` and the options are filled in.
    :param options: options of the command line, for :attr:`Conditions.options`.
    """

    payload: str
    device: str
    messages: tuple[type[Message], ...]
    is_device: Callable[[Message], bool]
    evidence: str
    tester: Callable[[Session, Conditions], T]
    requirements: tuple[Requirement[T], ...]
    describe: Callable[[Message], str] = describe
    identity: Callable[[Session], str] = lambda session: ''
    risk: str = ''
    question: str = ''
    options: tuple[Option, ...] = ()

    def session(self, address: Address, target: Address | None = None) -> Session:
        """Return a session with a device, from our address."""
        return Session(address, self.messages, is_device=self.is_device, describe=self.describe,
                       target=target)

    def ask(self, device: Address, options: Mapping[str, float]) -> str:
        """Return the question for consent."""
        return self.question.format(device=device, **options)

    @property
    def no_consent(self) -> str:
        """Return why a check is skipped without consent."""
        return f'the {self.device} would {self.risk}: {NOT_AGREED}'
