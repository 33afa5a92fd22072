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

"""Requests one message of a device until it has come, or the device does not send it."""

from __future__ import annotations

from collections.abc import Callable
import math

from .attempt import Target
from ..mavlink.command_sender import CommandResult

# s from the acknowledgement to the message.
MESSAGE_TIMEOUT = 0.5
# How often the message is requested if it is acknowledged and does not come: it may be lost.
MAX_QUESTIONS = 3

Done = Callable[[str, float], None]


class MessageQuery:
    """
    Requests one message of a device. No I/O; times are s.

    :ivar first_asked: the time of the first request, infinity before it.
    :ivar failure: why the device did not send the message, '' if it did or an answer is awaited.
    """

    def __init__(self, target: Target, message_id: int) -> None:
        self.first_asked = math.inf
        self.failure = ''
        self._target = target
        self._message_id = message_id
        self._waiting: list[Done] = []
        # The number of requests that were sent, 0 while none is under way.
        self._questions = 0
        self._message_until = math.inf

    def ask(self, now: float, done: Done | None = None) -> None:
        """Ask; ``done`` is called with '' once the message has come, else with the failure."""
        if done is not None:
            self._waiting.append(done)
        if not self._questions:
            self.first_asked = min(self.first_asked, now)
            self._send(now)

    def _send(self, now: float) -> None:
        self._questions += 1
        self._message_until = math.inf
        self._target.request_message(self._message_id, now, self._answered)

    def _answered(self, result: CommandResult, now: float) -> None:
        if self._questions and result.accepted:
            self._message_until = now + MESSAGE_TIMEOUT
        elif self._questions:
            self.finish(result.describe_failure(), now)

    def finish(self, failure: str, now: float) -> None:
        """End the requests: the message has come, or will not come for the reason given."""
        self._message_until = math.inf
        self._questions = 0
        self.failure = failure
        waiting, self._waiting = self._waiting, []
        for done in waiting:
            done(failure, now)

    def poll(self, now: float) -> None:
        """Ask again for a message that does not come, or give up."""
        if now < self._message_until:
            return
        if self._questions < MAX_QUESTIONS:
            self._send(now)
        else:
            self.finish('acknowledged, but not sent', now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""
        return self._message_until
