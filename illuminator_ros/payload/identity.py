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

"""The identity of a component: COMPONENT_INFORMATION_BASIC."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math

from .attempt import Target
from ..mavlink.command_sender import CommandResult
from ..mavlink.dialect import raw
from ..mavlink.messages import ComponentInformationBasic

# s from the acknowledgement to the message.
MESSAGE_TIMEOUT = 0.5
# How often the message is requested if it is acknowledged and does not come: it may be lost.
MAX_QUESTIONS = 3
# s from the first request until the identity counts as unknown.
SETTLING_TIME = 2.0

Done = Callable[[str, float], None]


@dataclass(frozen=True, slots=True)
class Identity:
    """A COMPONENT_INFORMATION_BASIC; a field that the component leaves empty is ''."""

    vendor: str = ''
    model: str = ''
    software_version: str = ''
    hardware_version: str = ''
    serial_number: str = ''

    @classmethod
    def from_message(cls, message: ComponentInformationBasic) -> Identity:
        """Read a message; a full field has no terminator, and some fields are not printable."""
        return cls(*(text(raw(message, field)) for field in (
            'vendor_name', 'model_name', 'software_version', 'hardware_version',
            'serial_number')))


def text(field: bytes) -> str:
    """Return the printable text of a char field, up to its terminator if it has one."""
    shown = field.partition(b'\0')[0].decode('utf-8', errors='replace')
    return ''.join(c if c.isprintable() else '?' for c in shown).strip()


class IdentityQuery:
    """
    Asks one component for its identity.

    :ivar identity: None before the component has sent it.
    :ivar failure: why the component did not send it, '' if it did or an answer is awaited.
    """

    def __init__(self, target: Target) -> None:
        self._target = target
        self.identity: Identity | None = None
        self.failure = ''
        self._message_until = math.inf
        self._waiting: list[Done] = []
        self._asking = False
        self._questions = 0
        self._first_asked = math.inf

    def is_settled(self, now: float) -> bool:
        """Return whether the identity is known, or will not be known soon."""
        return (self.identity is not None or bool(self.failure)
                or now >= self._first_asked + SETTLING_TIME)

    def ask(self, now: float, done: Done | None = None) -> None:
        """Ask; ``done`` is called with '' once the message has come, else with the failure."""
        if done is not None:
            self._waiting.append(done)
        if not self._asking:
            self._asking = True
            self._questions = 0
            self._first_asked = min(self._first_asked, now)
            self._send(now)

    def _send(self, now: float) -> None:
        self._questions += 1
        self._message_until = math.inf
        self._target.request_message(ComponentInformationBasic.id, now, self._answered)

    def take(self, identity: Identity, now: float) -> None:
        """Take the message."""
        self.identity = identity
        self._finish('', now)

    def _answered(self, result: CommandResult, now: float) -> None:
        if not self._asking:
            return
        if result.accepted:
            self._message_until = now + MESSAGE_TIMEOUT
        else:
            self._finish(result.describe_failure(), now)

    def poll(self, now: float) -> None:
        """Ask again for a message that does not come, or give up."""
        if now < self._message_until:
            return
        if self._questions < MAX_QUESTIONS:
            self._send(now)
        else:
            self._finish('acknowledged, but not sent', now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""
        return self._message_until

    def _finish(self, failure: str, now: float) -> None:
        self._message_until = math.inf
        self._asking = False
        self.failure = failure
        waiting, self._waiting = self._waiting, []
        for done in waiting:
            done(failure, now)
