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

"""What the beam of a light looks like: its shape, its colour, its blinking. No ROS in here."""

from __future__ import annotations

from dataclasses import dataclass, replace
import math
from typing import Any

from ..illuminator.model import Mode, Status

Point = tuple[float, float, float]

# Triangles of a cone: enough to look round.
SIDES = 24
# Opacity at 100 % brightness: what stands in the beam is to be seen.
MAX_ALPHA = 0.5
# s; a strobe that is faster is drawn steady, as bright as it is on average: viewers draw 30 to 60
# pictures a second, and would show such a one as an irregular flicker.
SHORTEST_PERIOD = 0.1
# s for which a strobe is drawn lit, and dark, at least: between two pictures nobody would see it.
SHORTEST_FLASH = 0.05


def cone(length: float, angle: float, sides: int = SIDES) -> list[Point]:
    """
    Return the corners of the triangles, three for each, that a cone around +x consists of.

    Its apex is the origin. Seen from outside the corners run counter-clockwise. It has no lid:
    light does not end there.

    :param length: along x, m.
    :param angle: the full opening angle, rad, less than pi.
    """
    radius = length * math.tan(angle / 2)
    rim = [(length, radius * math.cos(turn), radius * math.sin(turn))
           for turn in (2 * math.pi * side / sides for side in range(sides))]
    corners: list[Point] = []
    for side in range(sides):
        corners += (0.0, 0.0, 0.0), rim[(side + 1) % sides], rim[side]
    return corners


@dataclass(frozen=True, slots=True)
class Look:
    """
    How the beam is drawn at a moment.

    :param alpha: opacity; 0 is no beam.
    :param error: whether the light reports an error.
    """

    alpha: float = 0.0
    error: bool = False


@dataclass(frozen=True, slots=True)
class _Shine:
    """What the light does, as far as it was believable; percent and s."""

    on: bool = False
    brightness: float = 100.0
    period: float = 0.0
    duty: float = 0.0
    internal: bool = True
    error: bool = False

    def updated(self, status: Status) -> _Shine:
        reported: dict[str, Any] = {
            'on': status.enabled, 'brightness': status.brightness,
            'period': status.strobe_period, 'duty': status.strobe_duty_cycle}
        return replace(
            self, **{name: value for name, value in reported.items() if value is not None},
            internal=status.mode is not Mode.EXTERNAL_SYNC, error=bool(status.error_flags))

    @property
    def strobes(self) -> bool:
        # Under external sync the light strobes as somebody else says, nobody knows how.
        return self.internal and self.period > 0 and 0 < self.duty < 100


class Beam:
    """
    The beam of one light, which follows its statuses and blinks with its strobe.

    Period and duty cycle are the light's; the moment at which it flashes is not known. No I/O;
    time is passed in.
    """

    def __init__(self) -> None:
        self._shine = _Shine()
        self._strobes_since = 0.0

    def take(self, status: Status, now: float) -> bool:
        """Take a status of the light; return whether the beam is another one now."""
        before, self._shine = self._shine, self._shine.updated(status)
        if self._rhythm(before) != self._rhythm(self._shine):
            self._strobes_since = now
        return self._shine != before

    def lose(self) -> None:
        """Note that it is not known any more what the light does."""
        self._shine = replace(self._shine, on=False)

    def look(self, now: float) -> Look:
        """Return how it is drawn."""
        shine = self._shine
        if not shine.on:
            return Look()
        alpha = MAX_ALPHA * shine.brightness / 100
        if self._blinks and self._phase(now) >= self._lit:
            alpha = 0.0
        elif shine.strobes and not self._blinks:
            alpha *= shine.duty / 100
        return Look(alpha, shine.error) if alpha else Look()

    def changes_in(self, now: float) -> float:
        """Return the s until it looks otherwise, infinity if it does not by itself."""
        if not self._blinks:
            return math.inf
        phase = self._phase(now)
        return (self._lit if phase < self._lit else self._shine.period) - phase

    @staticmethod
    def _rhythm(shine: _Shine) -> tuple[object, ...]:
        return shine.on, shine.strobes, shine.period, shine.duty

    @property
    def _blinks(self) -> bool:
        shine = self._shine
        return shine.on and shine.strobes and shine.period >= SHORTEST_PERIOD

    @property
    def _lit(self) -> float:
        """Return the s of each period in which it is drawn."""
        period = self._shine.period
        return min(max(period * self._shine.duty / 100, SHORTEST_FLASH), period - SHORTEST_FLASH)

    def _phase(self, now: float) -> float:
        """Return the s since the beginning of the newest flash."""
        return (now - self._strobes_since) % self._shine.period
