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
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
import math
from typing import Any, TYPE_CHECKING

from .model import Configuration, DIMMING_FLAGS, flag_names, Mode, Status
from ..mavlink.command import Command, Ending, format_seconds, Outcome
from ..mavlink.dialect import MavCmd, MavResult

if TYPE_CHECKING:
    from .light import Light

# s from the acknowledgement to the status that shows the change.
CONFIRMATION_TIMEOUT = 1.0
# s between requests for the status meanwhile, where one or its answer was lost.
ASK_INTERVAL = 0.25
# s; a light that reports progress for longer is not waited for.
PROGRESS_LIMIT = 30.0
# Changes of one kind that may wait for one light.
MAX_WAITING = 32


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
        self._outcome: Outcome | None = None
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

    def _answered(self, outcome: Outcome, now: float) -> None:
        if not outcome.accepted:
            refused = 'refused: ' if outcome.ending is Ending.ANSWERED else ''
            self._finish(Result(
                False, f'{refused}{outcome.verdict} ({outcome.spent(now - self._submitted)})',
                outcome.ending is Ending.ANSWERED and outcome.result in _PERMANENT), now)
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
                f'several lights answer as {self.light.source}'
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
        spent = self._outcome.spent(now - self._submitted)
        return Result(True, f'{self.wish}, {how}: {self._outcome.verdict} ({spent})')

    def _failure(self, what: str, now: float, *, contradicted: bool = False) -> None:
        assert self._outcome is not None
        spent = self._outcome.spent(now - self._submitted)
        self._finish(Result(
            False, f'{self.wish} not confirmed: {self._outcome.verdict}, {what} ({spent})',
            contradicted=contradicted), now)

    def fail(self, message: str, now: float) -> None:
        """End without having been sent."""
        self._finish(Result(False, message), now)

    def _finish(self, result: Result, now: float) -> None:
        if not self.finished:
            self.finished = True
            self._done(result, now)


class Enable(Operation):
    """MAV_CMD_ILLUMINATOR_ON_OFF."""

    def __init__(self, light: Light, on: bool, done: Done, *, now: float) -> None:
        super().__init__(light, done, now=now, limit=now + PROGRESS_LIMIT)
        self.on = on

    def command(self) -> Command:
        """See :meth:`Operation.command`."""
        return Command(self.light.source, MavCmd.ILLUMINATOR_ON_OFF,
                       (float(self.on), float(self.light.instance)))

    def shown_by(self, status: Status) -> bool:
        """See :meth:`Operation.shown_by`."""
        return status.enabled is self.on

    def accepted(self, status: Status | None) -> None:
        """See :meth:`Operation.accepted`."""

    def proof(self, status: Status) -> str:
        """See :meth:`Operation.proof`."""
        return self.dimmed_proof(status) if self.on else super().proof(status)

    @property
    def wish(self) -> str:
        """See :meth:`Operation.wish`."""
        return 'on' if self.on else 'off'

    def found(self, status: Status) -> str:
        """See :meth:`Operation.found`."""
        return {True: 'on', False: 'off', None: 'neither on nor off'}[status.enabled]


class Configure(Operation):
    """
    MAV_CMD_DO_ILLUMINATOR_CONFIGURE, with all four fields.

    :param changes: checked values by name; the other fields are those agreed when it is sent.
    :param stream: whether it is one of a stream of setpoints, which a newer one replaces.
    """

    def __init__(
        self, light: Light, changes: Mapping[str, Any], done: Done, *, now: float, limit: float,
        stream: bool = False,
    ) -> None:
        super().__init__(light, done, now=now, limit=limit)
        self.changes = changes
        self.stream = stream
        self.wanted = light.agreement.with_changes(changes)

    def start(self, now: float) -> None:
        """See :meth:`Operation.start`."""
        # What went before in the queue may have changed the other fields.
        self.wanted = self.light.agreement.with_changes(self.changes)
        super().start(now)

    def command(self) -> Command:
        """See :meth:`Operation.command`."""
        return Command(
            self.light.source, MavCmd.DO_ILLUMINATOR_CONFIGURE,
            (*self.wanted.params(), float(self.light.instance)))

    def shown_by(self, status: Status) -> bool:
        """See :meth:`Operation.shown_by`."""
        return not unexplained(
            self.wanted, status.configuration(self.wanted), status.error_flags, step=True)

    def proof(self, status: Status) -> str:
        """See :meth:`Operation.proof`."""
        reported = status.configuration(self.wanted)
        hidden = [name for name in self.wanted.differences(reported) if name in self.changes]
        if not hidden:
            return super().proof(status)
        if status.error_flags & DIMMING_FLAGS:
            return self.dimmed_proof(status)
        return f'accepted (ILLUMINATOR_STATUS shows {reported.describe(hidden)})'

    def accepted(self, status: Status | None) -> None:
        """See :meth:`Operation.accepted`."""
        self.light.agreement.agree(self.wanted, status)

    @property
    def wish(self) -> str:
        """See :meth:`Operation.wish`."""
        return self.wanted.describe(list(self.changes))

    def found(self, status: Status) -> str:
        """See :meth:`Operation.found`."""
        reported = status.configuration(self.wanted)
        return reported.describe(
            unexplained(self.wanted, reported, status.error_flags, step=True))


def unexplained(
    agreed: Configuration, reported: Configuration, flags: int, *, step: bool,
    external: bool = True,
) -> list[str]:
    """
    Return the fields in which a light differs from its agreed configuration without reason.

    There are two good reasons: it dims itself because it is hot, and under external sync its
    output follows another signal.

    :param external: whether external sync is to count as a reason.
    :param step: whether the light's own rounding is passed over.
    """
    names = agreed.differences(reported, step=step)
    # A light that does not say which mode it is in does not contradict.
    if reported.mode is Mode.UNKNOWN or step and agreed.mode is Mode.UNKNOWN:
        names = [name for name in names if name != 'mode']
    if flags & DIMMING_FLAGS and reported.brightness < agreed.brightness:
        names = [name for name in names if name != 'brightness']
    if external and agreed.mode is reported.mode is Mode.EXTERNAL_SYNC:
        names = []
    return names


class OperationQueue:
    """Changes of one kind to one light: one is on its way, the others wait."""

    def __init__(self) -> None:
        self._operations: deque[Operation] = deque()

    @property
    def current(self) -> Operation | None:
        """Return the change that is on its way."""
        return self._operations[0] if self._operations else None

    def submit(self, operation: Operation, now: float) -> None:
        """Start a change, or put it behind the others."""
        if len(self._operations) >= MAX_WAITING:
            operation.fail(f'{MAX_WAITING} requests are waiting for light '
                           f'{operation.light.source} already', now)
            return
        self._operations.append(operation)
        if len(self._operations) == 1:
            operation.start(now)
            self.poll(now)

    def cancel(self, now: float) -> None:
        """End all changes, whether under way or waiting."""
        for operation in list(self._operations):
            operation.fail('cancelled', now)
        self._operations.clear()

    def poll(self, now: float) -> None:
        """Do what is due, and start what has waited."""
        for waiting in list(self._operations)[1:]:
            if now >= waiting.limit:
                waiting.fail('not sent: earlier requests took too long', now)
        if self._operations:
            self._operations[0].poll(now)
        while self._operations and self._operations[0].finished:
            self._operations.popleft()
            while self._operations and self._operations[0].finished:
                self._operations.popleft()
            if self._operations:
                self._operations[0].start(now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""
        if not self._operations:
            return math.inf
        first = self._operations[0]
        waiting = min((op.limit for op in list(self._operations)[1:]), default=math.inf)
        return -math.inf if first.finished else min(first.next_deadline(), waiting)
