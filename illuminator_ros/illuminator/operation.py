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

"""
One change to a light: the command, its acknowledgement, and the status that shows it.

MAV_RESULT_ACCEPTED says that the command is valid and was taken on, not that it is done
(command protocol). So after it the light is asked for its status, and only a status that shows
the change makes the change a success.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
import math
from typing import TYPE_CHECKING

from .error_flags import DIMMING_FLAGS, flag_names
from .model import Status
from ..mavlink.command import Command, CommandResult, CommandStatus, format_seconds
from ..mavlink.messages import MavResult

if TYPE_CHECKING:
    from .light import Light

# s from the acknowledgement to the status that shows the change.
CONFIRMATION_TIMEOUT = 1.0
# s between requests for the status meanwhile, where one or its answer was lost.
ASK_INTERVAL = 0.25


@dataclass(frozen=True)
class Result:
    """
    What became of a change.

    :param success: whether the light accepted it and, if it sends a status, shows it.
    :param message: what happened, for people.
    :param permanent: whether the same request will fail again.
    :param contradicted: whether the light accepted it and then showed something else.
    :param superseded: whether the light accepted it, and a newer one was sent then.
    """

    success: bool
    message: str
    permanent: bool = False
    contradicted: bool = False
    superseded: bool = False


Done = Callable[[Result, float], None]

_PERMANENT = {
    MavResult.DENIED, MavResult.UNSUPPORTED, MavResult.COMMAND_UNSUPPORTED_MAV_FRAME,
    MavResult.COMMAND_LONG_ONLY, MavResult.COMMAND_INT_ONLY}


class Operation(ABC):
    """
    A change on its way.

    :param limit: the time by which it ends whatever happens.
    :param done: called once, with the result and the time.
    """

    def __init__(self, light: Light, done: Done, *, now: float, limit: float) -> None:
        self.light = light
        self.limit = limit
        self.finished = False
        self._done = done
        self._submitted = now
        self._started = math.inf
        self._outcome: CommandResult | None = None
        self._contradiction: Status | None = None
        self._outdated = False
        # Statuses in a row that show the change.
        self._shown = 0
        self._accepted_at = math.inf
        self._confirm_until = math.inf
        self._ask_at = math.inf

    @abstractmethod
    def command(self) -> Command:
        """Return the command to send."""

    @abstractmethod
    def shown_by(self, status: Status) -> bool:
        """Return whether a status shows the change."""

    @abstractmethod
    def accepted(self, status: Status | None) -> None:
        """Note that the light took the change, with the status that shows it if there is one."""

    @property
    @abstractmethod
    def wish(self) -> str:
        """Return what the light is to become, for people."""

    @abstractmethod
    def found(self, status: Status) -> str:
        """Return what the light is instead, for people."""

    def proof(self, status: Status) -> str:
        """Return how far a status that does not contradict shows the change, for people."""
        return 'confirmed by ILLUMINATOR_STATUS'

    def dimmed_proof(self, status: Status) -> str:
        """Return the proof of a change that heat keeps from being seen, for people."""
        dimmed = ' and '.join(flag_names(status.error_flags & DIMMING_FLAGS))
        return Operation.proof(self, status) + (f', but {dimmed}' if dimmed else '')

    @property
    def confirming(self) -> bool:
        """Whether the light has accepted, and the status is awaited."""
        return self._outcome is not None and not self.finished

    def start(self, now: float) -> None:
        """Send the command, unless the light was lost while this has waited."""
        if unreachable := self.light.unreachable(now):
            self.fail(unreachable, now)
        else:
            self._started = now
            self.light.sender.start(self.command(), now, self._answered, limit=self.limit)

    def _answered(self, outcome: CommandResult, now: float) -> None:
        if not outcome.accepted:
            refused = 'refused: ' if outcome.status is CommandStatus.ANSWERED else ''
            self._finish(Result(
                False, f'{refused}{outcome.describe()} ({outcome.timing(now - self._submitted)})',
                outcome.status is CommandStatus.ANSWERED and outcome.result in _PERMANENT), now)
            return
        self._outcome = outcome
        self._accepted_at = now
        self._confirm_until = min(now + CONFIRMATION_TIMEOUT, self.limit)
        # At the next look around, not now: many lights send a status behind the acknowledgement.
        self._ask_at = now

    def _ask(self, now: float) -> None:
        self._ask_at = now + ASK_INTERVAL
        self.light.identification.give_way(now)
        self.light.request_status(now)

    def status(self, status: Status, sent_by: float, now: float) -> None:
        """
        Take a status that is newer than all before.

        :param sent_by: the latest time at which it can have been sent. One that was on its way
            already when the command was sent says nothing of it: by a late acknowledgement of
            an earlier command, it would even confirm what has never been done.
        """
        if not self.confirming:
            return
        if sent_by < self._started:
            self._outdated = True
            return
        if not self.shown_by(status):
            self._contradiction = status
            self._shown = 0
            return
        self._shown += 1
        # Of several lights that report in turn, not only the first must show it.
        if self._shown >= (2 if self.light.sharing.recognised else 1):
            self.accepted(status)
            self._finish(self._success(self.proof(status), now), now)

    def supersede(self, now: float) -> None:
        """End an accepted change without its confirmation: a newer one replaces it."""
        if self.confirming:
            self.accepted(None)
            self._finish(replace(
                self._success('accepted, superseded', now), superseded=True), now)

    def poll(self, now: float) -> None:
        """Ask again, or end."""
        if not self.confirming:
            return
        if now >= self._confirm_until:
            self._unconfirmed(now)
        elif now >= self._ask_at:
            self._ask(now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""
        return min(self._confirm_until, self._ask_at) if self.confirming else math.inf

    def _unconfirmed(self, now: float) -> None:
        if self._contradiction is not None:
            found = ', '.join(filter(None, (
                self.found(self._contradiction),
                *flag_names(self._contradiction.error_flags),
                f'several lights answer as {self.light.address}'
                if self.light.sharing.recognised else '')))
            self._failure(f'but ILLUMINATOR_STATUS shows {found}', now, contradicted=True)
        elif self.light.sends_status:
            waited = format_seconds(now - self._accepted_at)
            later = 'later ' if self._outdated else ''
            self._failure(f'but no {later}ILLUMINATOR_STATUS came within {waited}', now)
        else:
            self.accepted(None)
            self._finish(self._success(
                'accepted, not confirmed (the light sends no ILLUMINATOR_STATUS)', now), now)

    def _success(self, how: str, now: float) -> Result:
        assert self._outcome is not None
        spent = self._outcome.timing(now - self._submitted)
        return Result(True, f'{self.wish}, {how}: {self._outcome.describe()} ({spent})')

    def _failure(self, what: str, now: float, *, contradicted: bool = False) -> None:
        assert self._outcome is not None
        spent = self._outcome.timing(now - self._submitted)
        self._finish(Result(
            False, f'{self.wish} not confirmed: {self._outcome.describe()}, {what} ({spent})',
            contradicted=contradicted), now)

    def fail(self, message: str, now: float) -> None:
        """End without having been sent."""
        self._finish(Result(False, message), now)

    def _finish(self, result: Result, now: float) -> None:
        if not self.finished:
            self.finished = True
            self._done(result, now)
