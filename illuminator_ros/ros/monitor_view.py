# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The view of a payload in the monitor: how its devices are found and shown, and what keys request.

A payload defines one :class:`View`. No I/O, no clock, no screen: texts have styles by name.
The names of ``__all__`` are public.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
import math
from typing import Any, NamedTuple

from std_srvs.srv import Trigger

__all__ = ['Device', 'Key', 'measured', 'number', 'numbers', 'Request', 'Topic', 'trigger',
           'trigger_key', 'View', 'WrongText']

# s without topics and diagnostics of a device until its values are out of date: bridges request a
# status after 2.5 s, and publish diagnostics once a second.
SILENCE = 6.0
# The number of values of a trend.
TREND_SIZE = 60
UNKNOWN = '-'
LEVELS = (('OK', 'green'), ('WARN', 'yellow'), ('ERROR', 'bold red'), ('STALE', 'dim'))
# The states of any device with their styles, and those with values that may be out of date.
LOST, SILENT, GONE, NOT_KNOWN = STATES = ('LOST', 'silent', 'gone', '?')
STATE_STYLES = dict(zip(STATES, ('bold red', 'yellow', 'red', 'dim'), strict=True))
STALE_STATES = (LOST, SILENT, GONE)
# The outcomes of a request with their styles; a message on a topic is SENT, and has no answer.
PENDING, DONE, SENT, FAILED = (
    ('...', 'dim'), ('done', 'green'), ('sent', 'green'), ('FAILED', 'bold red'))
# The outcome of an OFF that was confirmed, of a device that is on all the same.
ON_AGAIN = 'ON AGAIN', 'bold red'
# s for which a row shows an outcome, and a line of the node's log.
NEWS_LIFETIME = 10.0
# The order of attention; the levels from the best to the worst.
DANGEROUS, BROKEN, FINE = range(3)
BY_SEVERITY = (0, 3, 1, 2)

# A text, or a text with its style.
Cell = str | tuple[str, str]
# A line of the details: a label, and its parts.
DetailLine = tuple[str, Sequence[Cell]]


class WrongText(str):
    """Why a typed text has no request for any device, for people."""


class Topic(NamedTuple):
    """
    A topic ``~/name`` that the monitor shows.

    :param type: the message's class.
    :param read: returns the value of a message: a scalar, a text, or a tuple of them.
    :param is_state: whether its QoS is STATE_QOS, so that its last value is kept.
    """

    type: type[object]  # noqa: A003
    read: Callable[[Any], Any] = lambda message: message.data
    is_state: bool = True


class Diagnosis(NamedTuple):
    """A status on /diagnostics; the level is an index of :data:`LEVELS`."""

    level: int
    message: str
    values: Mapping[str, str]


class Request(NamedTuple):
    """
    A request to a device.

    :param text: for the operator.
    :param name: of the service or topic, below the node's name.
    :param type: of the service or topic, untyped: they have no common base.
    :param message: the request of the service, or the message, which has no answer.
    :param values: the values that it requests, by name.
    :param question: the question that the operator must confirm first, since it can hurt people.
    :param is_off: whether it switches something off, and waits for no other request.
    """

    text: str
    name: str
    type: Any  # noqa: A003
    message: Any
    values: Mapping[str, Any] = {}
    question: str = ''
    is_off: bool = False


@dataclass(eq=False)
class Device:
    """
    The known state of a device.

    :param name: of its node, with namespace.
    :param now: when the values were taken, s.
    :param source: of commands, which the operator has chosen; '' for the plain interface.
    :ivar nodes: how many nodes have this name, which share its values and answers.
    :ivar heard_at: when the device was last heard, s.
    :ivar values: by topic; None is a number that cannot be.
    :ivar changed_at: when each topic changed, s, absent before its first change.
    :ivar wanted: values that were requested, and until when they count as such, s.
    :ivar action: the last request, its outcome, the answer, and when that was noted, s.
    :ivar off: outcome and answer of the last OFF, None before the first.
    :ivar news: the last line of its node's log, and when it came, s.
    """

    name: str
    view: View
    now: float
    source: str = ''
    nodes: int = 1
    heard_at: float = -math.inf
    is_gone: bool = False
    values: dict[str, Any] = field(default_factory=dict)
    changed_at: dict[str, float] = field(default_factory=dict)
    wanted: dict[str, tuple[Any, float]] = field(default_factory=dict)
    trend: deque[float | None] = field(default_factory=lambda: deque(maxlen=TREND_SIZE))
    diagnoses: dict[str, Diagnosis] = field(default_factory=dict)
    action: tuple[str, tuple[str, str], str, float] | None = None
    off: tuple[tuple[str, str], str] | None = None
    news: tuple[str, float] = '', -math.inf

    @property
    def level(self) -> int | None:
        """Return its worst level, an index of :data:`LEVELS`, None if it has not sent one."""
        levels = map(self.level_of, self.diagnoses.values())
        own = (1,) if self.nodes > 1 else ()
        return max((*levels, *own), key=BY_SEVERITY.index, default=3 if self.is_stale else None)

    def level_of(self, one: Diagnosis) -> int:
        """Return a level, STALE for an OK that may be out of date."""
        return one.level or 3 * self.is_stale

    @property
    def is_stale(self) -> bool:
        """Return whether its values may be out of date."""
        return self.state in STALE_STATES

    @property
    def attention(self) -> int:
        """Return its place in the order of attention."""
        return DANGEROUS if self.view.is_dangerous(self) else BROKEN if self.level else FINE

    @property
    def state(self) -> str:
        """Return its state in a word."""
        if self.is_gone:
            return GONE
        if self.now - self.heard_at > SILENCE:
            return SILENT
        return LOST if self.values.get('connected') is False else self.view.state(self)

    @property
    def conflict(self) -> str:
        """Return that several nodes have its name, for people, '' if one has."""
        return f'{self.nodes} nodes with this name' if self.nodes > 1 else ''

    @property
    def prefix(self) -> str:
        """Return the prefix of the names of commands: the operator's source, if it has sources."""
        return f'{self.source}/' if self.source and 'source' in self.values else ''

    def note(self, text: str, outcome: tuple[str, str], answer: str = '') -> None:
        """Note the outcome of a request."""
        self.action = text, outcome, answer, self.now

    def wants(self, name: str, known: Any) -> Any:
        """Return a value that was requested lately, else the known one."""
        value, until = self.wanted.get(name, (None, -math.inf))
        return value if self.now < until else known

    def diagnosed(self, kind: str, key: str) -> str:
        """Return a value of the diagnostics, '' if there is none."""
        return self.diagnoses[kind].values.get(key, '') if kind in self.diagnoses else ''

    def number(self, kind: str, key: str) -> float | None:
        """Return a finite number of the diagnostics, None if there is none."""
        try:
            return finite(float(self.diagnosed(kind, key)))
        except ValueError:
            return None

    def since(self, topic: str) -> str:
        """Return for how long a topic has had its value, '' if that is not known."""
        return age(self.now - self.changed_at[topic]) if topic in self.changed_at else ''


# Makes the request for a device and a typed text, or says why there is none, for people.
Maker = Callable[[Device, str], Request | str]


class Key(NamedTuple):
    """
    Keys with one meaning.

    :param text: the meaning, in a few words, which is on its button.
    :param prompt: what the operator types first, '' for nothing.
    :param has_button: whether fingers have a button for it, too.
    """

    keys: tuple[str, ...]
    text: str
    request: Maker
    prompt: str = ''
    has_button: bool = True


@dataclass(frozen=True)
class View:
    """
    How the monitor shows the devices of one payload.

    :param kind: of device, such as ``light``.
    :param topics: by name; a node that publishes those of ``signature`` is such a device.
    :param values: returns the values in its row, the most important first.
    :param details: returns the lines below the list.
    :param steering: keys that act only after the operator has begun to steer.
    :param states: the words of :meth:`state` with their styles, in the order of the counts.
    :param state: returns the state of a connected device.
    :param trend: returns a value to keep for the trend, None if there is none.
    :param is_dangerous: whether a device can hurt people and does not do as it should.
    :param notice: returns what is going to happen by itself, for people, '' for nothing.
    :param off: the request for "all off".
    :param settings: the names that the program "set" takes, in the order in which it acts.
    :param shows: whether a device shows a value that was requested by a message.
    """

    kind: str
    topics: Mapping[str, Topic]
    signature: Sequence[str]
    values: Callable[[Device], Iterable[str]]
    details: Callable[[Device], Iterable[DetailLine]]
    keys: Sequence[Key]
    steering: Sequence[Key] = ()
    states: Mapping[str, str] = field(default_factory=lambda: {'ok': 'green'})
    state: Callable[[Device], str] = lambda device: 'ok' if device.values else NOT_KNOWN
    trend: Callable[[Device], float | None] | None = None
    is_dangerous: Callable[[Device], bool] = lambda device: False
    notice: Callable[[Device], str] = lambda device: ''
    off: Callable[[Device], Request] | None = None
    settings: Mapping[str, Maker] = field(default_factory=dict)
    shows: Callable[[Device, str, Any], bool] = lambda device, name, value: (
        device.values.get(name) == value)


def trigger(name: str, question: str = '') -> Request:
    """Return a request to a service of std_srvs/Trigger."""
    return Request(name.replace('_', ' '), name, Trigger, Trigger.Request(), question=question)


def trigger_key(key: str, text: str, name: str) -> Key:
    """Return a key that calls a service of std_srvs/Trigger."""
    return Key((key,), text, lambda device, typed: trigger(name))


def release_source(device: Device, typed: str) -> Request | str:
    """Give a device back to the other sources of commands."""
    return ('it has no sources of commands' if 'source' not in device.values else
            trigger(f'{device.source or "default"}/release'))


def if_true(make: Maker) -> Maker:
    """Return a maker for a setting whose only value is true."""
    return lambda device, typed: make(device, '') if typed == 'true' else WrongText(
        f'{typed!r} is not true')


def trigger_settings(*names: str) -> dict[str, Maker]:
    """Return settings that call services of std_srvs/Trigger."""
    return {name: if_true(lambda device, typed, name=name: trigger(name))  # type: ignore[misc]
            for name in names}


RELEASE_SOURCE = Key(('u',), 'give back', release_source)


def finite(number: float) -> float | None:
    """Return a number, None for one that no quantity of a device can be."""
    return number if abs(number) < 1e9 else None


def numbers(typed: str, count: int) -> list[float]:
    """Return finite numbers that were typed, empty if there are not so many."""
    try:
        found = [float(word) for word in typed.replace(',', ' ').split()]
    except ValueError:
        return []
    return found if len(found) == count and all(map(math.isfinite, found)) else []


def number(typed: str, unit: str, lowest: float, highest: float) -> float | WrongText:
    """Return a number that was typed with or without its unit, or why it is none."""
    [value] = numbers(typed.strip().removesuffix(unit), 1) or [math.nan]
    return value if lowest <= value <= highest else WrongText(
        f'{typed!r} is not a number of {unit} from {lowest:g}'
        + (f' to {highest:g}' if math.isfinite(highest) else ''))


def measured(value: float | None, unit: str, form: str = '.3g') -> str:
    """Return a number with its unit."""
    return UNKNOWN if value is None else f'{value:{form}} {unit}'


def age(seconds: float) -> str:
    """Return a length of time in one unit."""
    for unit, size in (('d', 86400), ('h', 3600), ('min', 60)):
        if seconds >= 2 * size:
            return f'{seconds / size:.3g} {unit}'
    return f'{max(seconds, 0):.0f} s'
