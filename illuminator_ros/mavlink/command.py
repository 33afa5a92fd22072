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

"""A MAVLink command, and what became of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from .messages import Address, MavResult, result_name


class CommandStatus(Enum):
    """How a command ended. Each ends in exactly one of these."""

    ANSWERED = 'answered'
    NO_ANSWER = 'no answer'
    PROGRESS_STOPPED = 'progress stopped'
    OUT_OF_TIME = 'out of time'
    LINK_LOST = 'link lost'
    CANCELLED = 'cancelled'
    REFUSED_LOCALLY = 'refused locally'


@dataclass(frozen=True)
class Command:
    """
    A command to one component.

    :param command: a MAV_CMD.
    :param params: param1 to param7; what is not given is 0, which the commands used here define
        as "not used".
    """

    target: Address
    command: int
    params: tuple[float, ...] = ()

    @property
    def key(self) -> tuple[Address, int]:
        """Return what an acknowledgement can tell apart."""
        return self.target, self.command


@dataclass(frozen=True)
class CommandResult:
    """
    The one outcome of a command.

    :param result: the last MAV_RESULT heard, None if there was none.
    :param tries: how often it was sent.
    :param elapsed: s, from the first sending.
    :param progress: %, the last that was reported, None where unknown.
    """

    ending: CommandStatus
    result: int | None = None
    tries: int = 0
    elapsed: float = 0.0
    progress: int | None = None
    result_param2: int = 0

    @property
    def accepted(self) -> bool:
        """Whether the target acknowledged with MAV_RESULT_ACCEPTED."""
        return self.ending is CommandStatus.ANSWERED and self.result == MavResult.ACCEPTED

    @property
    def verdict(self) -> str:
        """Return what happened, for people, with the name of the MAV_RESULT."""
        if self.ending is CommandStatus.ANSWERED and self.result is not None:
            return result_name(self.result)
        last = '' if self.result is None else f', last answer {result_name(self.result)}'
        if self.progress is not None:
            last += f' at {self.progress} %'
        return f'{_ENDINGS[self.ending]}{last}'

    def spent(self, elapsed: float | None = None) -> str:
        """Return the number of tries and the time taken, or another time (s)."""
        time = format_seconds(self.elapsed if elapsed is None else elapsed)
        return f'{plural(self.tries, "try", "tries")}, {time}'

    def __str__(self) -> str:
        return f'{self.verdict} ({self.spent()})'


_ENDINGS = {
    CommandStatus.NO_ANSWER: 'no acknowledgement',
    CommandStatus.PROGRESS_STOPPED: 'no final acknowledgement',
    CommandStatus.OUT_OF_TIME: 'not finished in time',
    CommandStatus.LINK_LOST: 'the link was lost',
    CommandStatus.CANCELLED: 'cancelled',
    CommandStatus.REFUSED_LOCALLY: 'too many commands are waiting for this component',
}


def plural(number: int, one: str, many: str) -> str:
    """Return ``1 try`` or ``3 tries``."""
    return f'{number} {one if number == 1 else many}'


def format_seconds(seconds: float) -> str:
    """Return a duration for people: ms below a second, else s."""
    return f'{seconds * 1000:.0f} ms' if seconds < 0.9995 else f'{seconds:.2f} s'


Done = Callable[[CommandResult, float], None]
