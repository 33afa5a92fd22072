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
Several lights behind one address, told by statuses that contradict each other in turn.

ILLUMINATOR_STATUS does not say which light it is of: ArduSub sends one for each of its lights
from the autopilot's address, and two lights may have been given the same ids.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

from .comparison import unexplained
from .error_flags import DIMMING_FLAGS
from .model import Mode, NOTHING, Status
from .uptime import WRAP_MS

# Changes back to what was before, by which several lights are told: the sixth status of
# A B A B A B is the fourth. Somebody who switches a light on, off and on again makes one.
ENOUGH = 4
# Evidence does not grow beyond this, so the verdict ends soon after the contradiction does.
MOST = 6
# What a status takes away that agrees with the one before. Of two lights in turn one in ten may
# get lost; one light may be flashed by somebody so that each third status differs.
REPETITION = 2
# What is remembered: statuses, and of those what they show, one for each light.
MAX_RECENT = 8
MAX_SEEN = 4
# s between two starting times that are those of two lights: a line's delay varies by less.
CLOCK_STEP = 1.5

T = TypeVar('T')


class Alternation(Generic[T]):
    """
    How much speaks for a value that is that of several things in turn.

    One thing that changes goes on to something new, or goes back once; it does not go back and
    forth with each sample.

    :param same: tells whether two values are of one thing.
    :ivar evidence: changes back to a value seen before, less :data:`REPETITION` for each that
        repeats the last one; 0 to :data:`MOST`.
    """

    def __init__(self, same: Callable[[T, T], bool]) -> None:
        self._same = same
        # With the last value at the end.
        self._seen: list[T] = []
        self.evidence = 0

    def add(self, value: T) -> bool:
        """Take a value and return whether it repeats the last one."""
        for index, seen in enumerate(reversed(self._seen)):
            if self._same(seen, value):
                self.evidence += 1 if index else -REPETITION
                self.evidence = min(max(self.evidence, 0), MOST)
                del self._seen[-1 - index]
                self._seen.append(value)
                return not index
        self._seen = [*self._seen[1 - MAX_SEEN:], value]
        return len(self._seen) == 1

    def clear(self) -> None:
        """Forget all."""
        self._seen.clear()
        self.evidence = 0


class Sharing:
    """
    Whether one address is shared by several lights, as far as their statuses tell.

    Lights are told apart by what they show and by when they were started. Two that show the
    same are not told apart, and need not be.

    :ivar recognised: whether it is.
    :ivar settled: whether the newest status can be followed: it does not go back to what was
        shown before, or it has been repeated.
    """

    def __init__(self) -> None:
        self.recognised = False
        self.settled = True
        self._states = Alternation(_same_state)
        self._starts = Alternation(_same_start)
        self._recent: deque[Status] = deque(maxlen=MAX_RECENT)

    def take(self, status: Status, now: float, *, commanded: bool) -> None:
        """
        Take a status, late ones too.

        :param commanded: whether a command of ours may have changed the light.
        """
        uptime = status.uptime_ms
        has_clock = any(one.uptime_ms != uptime for one in self._recent)
        if has_clock and any(one.uptime_ms == uptime and one == status for one in self._recent):
            # The same frame, by another way.
            return
        if has_clock or not self._recent:
            self._starts.add(now * 1000.0 - uptime)
        self._recent.append(status)
        if not commanded:
            repeated = self._states.add(status)
            self.settled = repeated or not self._states.evidence
        elif not self.recognised:
            # What we change ourselves back and forth is no evidence.
            self._states.clear()
            self.settled = True
        evidence = max(self._states.evidence, self._starts.evidence)
        self.recognised = evidence >= (1 if self.recognised else ENOUGH)

    def clear(self) -> None:
        """Forget all: the light is lost."""
        self.recognised = False
        self.settled = True
        self._states.clear()
        self._starts.clear()
        self._recent.clear()


def _same_state(one: Status, other: Status) -> bool:
    """Return whether a light may show both without having been changed."""
    if _shown(one) == _shown(other):
        return True
    if one.mode is other.mode is Mode.EXTERNAL_SYNC:
        # Its output follows another signal.
        return True
    hot = (one.error_flags | other.error_flags) & DIMMING_FLAGS
    if not hot and None not in (one.enabled, other.enabled) and one.enabled != other.enabled:
        return False
    if not one.complete or not other.complete:
        return True
    first, second = one.configuration(NOTHING), other.configuration(NOTHING)
    names = unexplained(first, second, 0, step=True)
    return not [name for name in names if not (hot and name == 'brightness')]


def _shown(status: Status) -> tuple[object, ...]:
    return (status.enabled, status.mode, status.brightness, status.strobe_period,
            status.strobe_duty_cycle)


def _same_start(one: float, other: float) -> bool:
    """Compare two starting times, ms, of clocks that wrap."""
    difference = (one - other + WRAP_MS / 2) % WRAP_MS - WRAP_MS / 2
    return abs(difference) < CLOCK_STEP * 1000.0
