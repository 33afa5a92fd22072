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

"""Who a light is: COMPONENT_INFORMATION_BASIC, asked for when it is found and on request."""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import TYPE_CHECKING

from .identity import Identity
from ..mavlink.command import Command, CommandResult, CommandStatus
from ..mavlink.messages import INFORMATION_ID, MavCmd, result_name

if TYPE_CHECKING:
    from .light import Light

# s from the acknowledgement to the message.
MESSAGE_TIMEOUT = 0.5
# s after which it is asked for again where something more urgent went before.
WAY_TIME = 1.0
# How often a message that was acknowledged and has not come is asked for: it may be lost.
MAX_QUESTIONS = 3
# s after which whoever needs an id for the light takes what there is.
SETTLING_TIME = 2.0

Done = Callable[[str, float], None]


class Identification:
    """
    Asks one light for its identity.

    :ivar identity: what the light said, None before it has.
    :ivar failure: why it said nothing, '' while that is open or it did.
    """

    def __init__(self, light: Light) -> None:
        self._light = light
        self.identity: Identity | None = None
        self.failure = ''
        self._message_until = math.inf
        self._waiting: list[Done] = []
        self._asking = False
        self._questions = 0
        self._first_asked = math.inf
        self._command: Command | None = None
        self._gives_way = False

    def settled(self, now: float) -> bool:
        """Return whether the identity is known, or will not be known soon."""
        return (self.identity is not None or bool(self.failure)
                or now >= self._first_asked + SETTLING_TIME)

    def ask(self, now: float, done: Done | None = None) -> None:
        """Ask; ``done`` is called with '' once the message is there, else with the reason."""
        if done is not None:
            self._waiting.append(done)
        if self._asking:
            return
        self._asking = True
        self._questions = 0
        self._first_asked = min(self._first_asked, now)
        self._send(now)

    def _send(self, now: float) -> None:
        self._questions += 1
        self._message_until = math.inf
        self._command = Command(
            self._light.address, MavCmd.REQUEST_MESSAGE, (float(INFORMATION_ID),))
        self._light.sender.start(self._command, now, self._answered)

    def give_way(self, now: float) -> None:
        """
        Let another message be requested first, and ask again later.

        One request is under way at a time, and a light that does not answer this one would hold
        up the status that somebody waits for.
        """
        if self._command is not None:
            self._gives_way = True
            self._light.sender.cancel(self._command, now)
            self._gives_way = False

    def received(self, identity: Identity, now: float) -> None:
        """Take the message."""
        self.identity = identity
        self._finish('', now)

    def _answered(self, outcome: CommandResult, now: float) -> None:
        if not self._asking:
            return
        if self._gives_way:
            self._questions -= 1
            self._message_until = now + WAY_TIME
            return
        if outcome.accepted:
            self._message_until = now + MESSAGE_TIMEOUT
        elif outcome.status is CommandStatus.ANSWERED and outcome.result is not None:
            self._finish(f'refused: {result_name(outcome.result)}', now)
        else:
            self._finish(outcome.describe(), now)

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
