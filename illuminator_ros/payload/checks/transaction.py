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

"""One command and its acknowledgements."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from ...mavlink.messages import Address, MavResult, result_name

# Acknowledgements kept of one command.
MAX_ACKS = 400


class Finding(NamedTuple):
    """
    A deviation from a requirement.

    :param lines: the lines of the session's log that show it.
    """

    text: str
    lines: list[str]


class Ack(NamedTuple):
    """
    A COMMAND_ACK.

    :param at: when it was received, s.
    :param target: its target fields; 0/0 if the device leaves them empty.
    """

    at: float
    result: int
    progress: int
    target: Address


@dataclass
class Transaction:
    """
    One command with its acknowledgements.

    :param text: the command and its parameters.
    :param expected: whether every device must acknowledge this command.
    :param sent: time of each attempt, s.
    :param lines: the lines of the session's log about this command.
    """

    text: str
    command: int
    expected: bool = True
    sent: list[float] = field(default_factory=list)
    acks: list[Ack] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)

    def acknowledge(self, ack: Ack, line: str) -> None:
        """Record an acknowledgement, with its line of the log."""
        if len(self.acks) < MAX_ACKS:
            self.acks.append(ack)
            self.lines.append(line)

    def acks_since(self, count: int) -> list[Ack]:
        """Return the acknowledgements after the first ``count``."""
        return self.acks[count:]

    @property
    def finals(self) -> list[Ack]:
        """Return the acknowledgements that do not report progress."""
        return [ack for ack in self.acks if ack.result != MavResult.IN_PROGRESS]

    @property
    def result(self) -> int | None:
        """Return the latest result, None if there is none."""
        return self.finals[-1].result if self.finals else None

    @property
    def accepted(self) -> bool:
        """Whether the command was accepted."""
        return self.result == MavResult.ACCEPTED

    @property
    def answer(self) -> str:
        """Return the name of the result."""
        return 'no acknowledgement' if self.result is None else result_name(self.result)

    def finding(self, reason: str = '') -> Finding:
        """Return a finding about this command, by default about its result."""
        return Finding(f'{self.text}: {reason or self.answer}', self.lines)
