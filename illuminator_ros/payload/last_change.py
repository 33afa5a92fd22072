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

"""The last change of a device before the process ends, which is repeated until it is shown."""

from __future__ import annotations

import math
from typing import Generic, TypeVar

from .attempt import (
    Change,
    Done,
    Evidence,
    PERMANENT_RESULTS,
    Result,
    StatusReport,
    Target,
    Verdict,
)
from ..mavlink.command_sender import CommandResult, format_seconds

# s between commands that are not confirmed, and from a status that is too old to the request for
# the next one.
INTERVAL = 0.1
ASK_INTERVAL = 0.005

S = TypeVar('S')


class LastChange(Generic[S]):
    """
    A change that is made again whenever the device does not have it. No I/O; times are s.

    Unlike an :class:`~.attempt.Attempt` it needs no acknowledgement: no later command of ours can
    undo it. Only a status that was sent after the first try shows it.

    :param report: called with a failure that is not permanent when a command is sent or has
        failed, and with a success or a permanent failure when no other command is necessary.
    :param counts_from: the time until which an earlier command may still reach the device and undo
        the change: only a later status shows it.
    """

    def __init__(
        self, target: Target, change: Change[S], report: Done, *, counts_from: float = -math.inf,
    ) -> None:
        self._target = target
        self._change = change
        self._report = report
        self._counts_from = counts_from
        self._begun_at = math.inf
        self._evidence = Evidence(target, change)
        self._send_due = self._ask_due = -math.inf
        self._is_under_way = self._is_confirmed = False
        self._reason = ''

    def _again(self, reason: str, now: float) -> None:
        self._reason = reason
        self._report(Result(False, reason), now)

    def _answered(self, outcome: CommandResult, now: float) -> None:
        self._is_under_way = False
        if self._is_confirmed:
            return
        if outcome.refused and outcome.result in PERMANENT_RESULTS:
            self._send_due = self._ask_due = math.inf
            self._report(Result(
                False, f'{outcome.describe_failure()} ({outcome.timing()})', permanent=True), now)
        elif outcome.accepted:
            self._ask_due = now
            self._again(f'{self._change.goal} not confirmed: {outcome}', now)
        else:
            self._again(f'{outcome.describe_failure()} ({outcome.timing()})', now)

    def reported(self, report: StatusReport[S], now: float) -> None:
        """Take a status that is newer than all before."""
        verdict = self._evidence.judge(report, now, is_accepted=False)
        if verdict is Verdict.OUTDATED:
            self._ask_due = min(self._ask_due, now + ASK_INTERVAL)
        elif verdict is Verdict.CONTRADICTED and self._is_confirmed:
            self._is_confirmed = False
            self._send_due = now
            self._again(self._evidence.contradiction, now)
        elif verdict is Verdict.SHOWN and not self._is_confirmed:
            self._is_confirmed = True
            self._send_due = self._ask_due = math.inf
            self._report(Result(True, (
                f'{self._change.goal}, {self._change.evidence(report.status)} '
                f'({format_seconds(now - self._begun_at)})')), now)

    def poll(self, now: float) -> None:
        """Send the command or ask for a status, if that is due; the device must be connected."""
        if now >= self._send_due:
            self._send_due = now + INTERVAL
            if self._begun_at == math.inf:
                self._begun_at = now
                self._evidence.sent_at = max(now, self._counts_from)
            if not self._is_under_way:
                self._is_under_way = True
                self._again(self._reason, now)
                self._target.start(
                    self._target.command(self._change), now, self._answered, overtake=True)
        if now >= self._ask_due:
            self._ask_due = now + INTERVAL
            self._target.request_status(now)

    def next_deadline(self) -> float:
        """Return when :meth:`poll` has something to do."""
        return min(self._send_due, self._ask_due)
