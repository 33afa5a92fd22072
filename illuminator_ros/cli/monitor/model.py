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

"""The lights in a ROS graph. No ROS, no clock: time is an argument."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping
import contextlib
import copy
from dataclasses import dataclass, field
from enum import Enum
import math
import threading
from typing import Any

from ...illuminator.model import flag_names

# s without topics and diagnostics of a light until its values are out of date: bridges request a
# status after 2.5 s, and publish diagnostics once a second.
SILENCE = 6.0
# s between two temperatures of a trend, and their number.
TREND_STEP = 2.0
TREND_SIZE = 60
# Every node can publish topics like those of a light.
MAX_LIGHTS = 256


# Values by name, untyped: switches, numbers and texts.
Values = dict[str, Any]


class State(Enum):
    """The state of a light."""

    ON = 'ON'
    OFF = 'off'
    UNKNOWN = '?'
    LOST = 'LOST'
    SILENT = 'silent'
    GONE = 'gone'


class Trend:
    """The newest value in each of the last time steps, None for a step without one."""

    def __init__(self, step: float = TREND_STEP, size: int = TREND_SIZE) -> None:
        self._step = step
        self._values: deque[tuple[int, float]] = deque(maxlen=size)
        self._size = size

    def add(self, value: float, now: float) -> None:
        """Take a value."""
        at = math.floor(now / self._step)
        if self._values and self._values[-1][0] == at:
            self._values.pop()
        self._values.append((at, value))

    def last(self, count: int, now: float) -> list[float | None]:
        """Return the values of the last ``count`` steps, the newest last."""
        known = dict(self._values)
        end = math.floor(now / self._step)
        return [known.get(at) for at in range(end - min(count, self._size) + 1, end + 1)]


@dataclass(frozen=True)
class Diagnosis:
    """A status on /diagnostics: 0 is OK, 1 WARN, 2 ERROR, 3 STALE."""

    level: int
    message: str
    values: Mapping[str, str]

    def number(self, key: str) -> float | None:
        """Return a value that is a finite number, else None."""
        try:
            value = float(self.values[key])
        except (KeyError, ValueError):
            return None
        return value if math.isfinite(value) else None


class Outcome(Enum):
    """The outcome of a request."""

    PENDING = '...'
    DONE = 'done'
    FAILED = 'FAILED'


@dataclass(frozen=True)
class Action:
    """
    The last request from this monitor to a light.

    :param text: the request, for people.
    :param answer: of the service, or why there is none; '' while it is pending.
    :param at: when the outcome was noted, s.
    """

    text: str
    outcome: Outcome
    answer: str
    at: float


@dataclass
class Light:
    """
    One light; None is an unknown value.

    :param name: of its node, with namespace.
    :param heard_at: the time of its last topic or diagnostics, s.
    :ivar setpoint: its parameter brightness, %; a hot light shines less.
    :ivar wanted: the values of requests without an answer: parameters, ``enabled``.
    :ivar values: its last values by topic.
    """

    name: str
    heard_at: float
    gone_at: float | None = None
    values: Values = field(default_factory=dict)
    setpoint: float | None = None
    wanted: Values = field(default_factory=dict)
    temperatures: Trend = field(default_factory=Trend)
    link: Diagnosis | None = None
    lamp: Diagnosis | None = None
    action: Action | None = None

    def state(self, now: float) -> State:
        """Return its state."""
        if self.gone_at is not None:
            return State.GONE
        if self.silence(now) > SILENCE:
            return State.SILENT
        if self.values.get('connected') is False:
            return State.LOST
        return {True: State.ON, False: State.OFF, None: State.UNKNOWN}[self.values.get('enabled')]

    def silence(self, now: float) -> float:
        """Return the time since its last topic or diagnostics, s."""
        return now - self.heard_at

    def value(self, name: str) -> Any:
        """Return the last value of a topic, None if there was none."""
        return self.values.get(name)

    @property
    def flags(self) -> list[str]:
        """Return the names of its error flags."""
        return flag_names(self.values.get('error_flags') or 0)


class DiscoveredLights:
    """All lights that were discovered, by name; callable from any thread."""

    def __init__(self) -> None:
        self._lights: dict[str, Light] = {}
        self._lock = threading.Lock()

    def snapshot(self) -> list[Light]:
        """Return copies of the lights, sorted by their names."""
        with self._lock:
            return copy.deepcopy([self._lights[name] for name in sorted(self._lights)])

    @contextlib.contextmanager
    def light(self, name: str) -> Iterator[Light]:
        """Yield a light to read or change; changes of an unknown one are discarded."""
        with self._lock:
            yield self._lights.get(name) or Light(name, 0.0)

    def seen(self, names: Iterable[str], now: float) -> list[str]:
        """Take the names of the lights in the graph; return the new ones."""
        present = set(names)
        with self._lock:
            for light in self._lights.values():
                if light.name not in present:
                    light.gone_at = now if light.gone_at is None else light.gone_at
                elif light.gone_at is not None:
                    # Another bridge may serve it now, with another setpoint.
                    light.gone_at = light.setpoint = None
            new = sorted(present - set(self._lights))[:MAX_LIGHTS - len(self._lights)]
            self._lights |= {name: Light(name, now) for name in new}
        return new

    def clear_gone(self) -> list[str]:
        """Remove the lights that left the graph, and return their names."""
        with self._lock:
            gone = [light.name for light in self._lights.values() if light.gone_at is not None]
            for name in gone:
                del self._lights[name]
        return gone

    def take(self, name: str, topic: str, value: object, now: float) -> None:
        """Take a value that a light has published."""
        with self.light(name) as light:
            light.heard_at = now
            light.values[topic] = printable(value) if isinstance(value, str) else value
            if (topic == 'temperature' and isinstance(value, float) and math.isfinite(value)):
                light.temperatures.add(value, now)

    def agreed(self, name: str, brightness: float) -> None:
        """Take the parameter brightness of a light, %."""
        with self.light(name) as light:
            light.setpoint = brightness

    def diagnosed(self, name: str, kind: str, diagnosis: Diagnosis, now: float) -> None:
        """
        Take a diagnosis.

        :param kind: ``link`` or ``lamp``; others are ignored.
        """
        clean = Diagnosis(diagnosis.level, printable(diagnosis.message), {
            printable(key): printable(value) for key, value in diagnosis.values.items()})
        with self.light(name) as light:
            light.heard_at = now
            if kind == 'link':
                light.link = clean
            elif kind == 'lamp':
                light.lamp = clean

    def acted(self, name: str, text: str, outcome: Outcome, answer: str, now: float) -> None:
        """Take the outcome of a request to a light."""
        with self.light(name) as light:
            light.action = Action(text, outcome, printable(answer), now)


def printable(text: str) -> str:
    """Return a text without characters that control a terminal."""
    return ''.join(c if c.isprintable() else ' ' for c in text)
