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

"""One command, and what became of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ...mavlink.messages import MavResult, result_name

# What is wrong, and the lines of the exchange that show it.
Finding = tuple[str, list[str]]


@dataclass
class Transaction:
    """
    One command and what it was answered with.

    :param sent: when, s, for each try.
    :param acks: what was acknowledged, and when.
    :param expected: whether it counts as a command that every light has to answer.
    :param not_shown: the fields in which the status does not show the change that was accepted.
    :param disagreement: what is wrong then, None if nothing is.
    """

    text: str
    command: int
    expected: bool = True
    sent: list[float] = field(default_factory=list)
    acks: list[tuple[float, Any]] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    not_shown: list[str] = field(default_factory=list)
    disagreement: Finding | None = None

    @property
    def finals(self) -> list[tuple[float, Any]]:
        """Return the acknowledgements that are not reports of progress."""
        return [(at, ack) for at, ack in self.acks if ack.result != MavResult.IN_PROGRESS]

    @property
    def result(self) -> int | None:
        """Return the last result, None if there is none."""
        return self.finals[-1][1].result if self.finals else None

    @property
    def accepted(self) -> bool:
        """Whether the command was accepted."""
        return self.result == MavResult.ACCEPTED

    @property
    def answer(self) -> str:
        """Return the result, for people."""
        return 'no acknowledgement' if self.result is None else result_name(self.result)

    def finding(self, what: str = '') -> Finding:
        """Return what is wrong with the answer, and the lines that show it."""
        return f'{self.text}: {what or self.answer}', self.lines

    def unmet(self, *names: str) -> Finding | None:
        """
        Return why a change has not been made, None if it has, or no status says otherwise.

        :param names: the fields of the status that matter here.
        """
        if not self.accepted:
            return self.finding()
        return self.disagreement if set(names) & set(self.not_shown) else None
