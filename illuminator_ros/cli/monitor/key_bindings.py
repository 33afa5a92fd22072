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

"""Keys of the terminal, their meaning, and the requests that they make. No ROS, no I/O."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import auto, Enum
import functools
import re
from typing import Any

from .model import Light, State

# Brightness steps, %; strobe for a light that has none, s and %.
STEP, FINE_STEP = 10.0, 1.0
STROBE_PERIOD, STROBE_DUTY_CYCLE = 1.0, 50.0
PAGE = 10
# A character, or cursor and editing keys (ECMA-48, xterm); an escape alone is a key, too.
_KEY = re.compile('\x1b(?:O.|\\[[^@-~]*[@-~]|(?=[^O[]))|[^\x1b]', re.DOTALL)
_NAMES = {
    '\r': 'enter', '\n': 'enter', ' ': 'space', '\x03': 'ctrl-c', '\x04': 'ctrl-d',
    '\x1a': 'ctrl-z', '\x1c': 'ctrl-\\',
    **{f'\x1b{prefix}{end}': name for prefix in '[O' for end, name in {
        'A': 'up', 'B': 'down', 'C': 'right', 'D': 'left', 'H': 'home', 'F': 'end'}.items()},
    **{f'\x1b[{number}~': name for number, name in {
        1: 'home', 4: 'end', 7: 'home', 8: 'end', 5: 'page up', 6: 'page down'}.items()},
}


class KeyDecoder:
    """Decodes keys from the bytes of a terminal, in pieces of any size."""

    def __init__(self) -> None:
        self._rest = b''

    @property
    def waiting(self) -> bool:
        """Whether the last bytes may be the beginning of an escape sequence."""
        return bool(self._rest)

    def feed(self, data: bytes) -> list[str]:
        """Return the keys; b'' means that no more bytes have come for a while."""
        text = (self._rest + data).decode('utf-8', errors='replace')
        self._rest = b''
        keys = []
        while match := _KEY.match(text):
            key = match.group()
            keys.append(_NAMES.get(key, 'escape' if key[0] == '\x1b' else key))
            text = text[len(key):]
        if text and data:
            self._rest = text.encode()
        elif text:
            keys.append('escape')
        return keys


class Service(Enum):
    """The service of a light that a request calls."""

    ENABLE = 'enable'
    REFRESH = 'refresh'
    SET = 'set_parameters_atomically'
    GET = 'get_parameters'


@dataclass(frozen=True)
class Request:
    """
    A request to a light.

    :param text: the text for the operator, '' for none.
    :param value: for ENABLE a bool, for SET the parameters by their names, for GET the names.
    """

    service: Service
    text: str
    value: Any = None


# Makes a request at the time of sending, not of the key press, so that earlier keys count; returns
# None if too little is known of the light.
Ask = Callable[[Light], Request | None]


def switch(light: Light, on: bool | None = None) -> Request:
    """Switch a light on or off; None is the opposite of its state, on if that is unknown."""
    wanted = not light.wanted.get('enabled', light.value('enabled')) if on is None else on
    return Request(Service.ENABLE, 'on' if wanted else 'off', wanted)


switch_off = functools.partial(switch, on=False)


def dim(light: Light, step: float) -> Request | None:
    """Change the brightness by a step, %, from the requested, agreed or reported one."""
    known = (light.wanted.get('brightness'), light.setpoint, light.value('brightness'))
    start = next((value for value in known if value is not None), None)
    if start is None:
        return None
    target = min(max(round(start + step, 1), 0.0), 100.0)
    return Request(Service.SET, f'brightness {target:g} %', {'brightness': target})


def strobe(light: Light) -> Request:
    """Let a light strobe with its last duty cycle, or end its strobe."""
    if light.wanted.get('strobe_period', light.value('strobe_period')):
        return Request(Service.SET, 'no strobe', {'strobe_period': 0.0})
    duty = light.value('strobe_duty_cycle') or STROBE_DUTY_CYCLE
    return Request(Service.SET, f'strobe {STROBE_PERIOD:g} s, {duty:g} %',
                   {'strobe_period': STROBE_PERIOD, 'strobe_duty_cycle': round(duty, 3)})


def refresh(light: Light) -> Request:
    """Request identity and status of a light again."""
    return Request(Service.REFRESH, 'refresh')


class Command(Enum):
    """The meaning of a key that is not a request to the selected light."""

    SELECT = auto()
    ALL_OFF = auto()
    CLEAR = auto()
    HELP = auto()
    QUIT = auto()
    STOP = auto()


# Keys, text and meaning, in the order of the help.
BINDINGS: tuple[tuple[tuple[str, ...], str, Ask | Command], ...] = (
    (('up', 'down', 'k', 'j', 'home', 'end', 'page up', 'page down'), 'select a light',
     Command.SELECT),
    (('space', 'enter'), 'switch it on or off', switch),
    (('+', '=', 'right'), 'brighter by 10 %', functools.partial(dim, step=STEP)),
    (('-', '_', 'left'), 'darker by 10 %', functools.partial(dim, step=-STEP)),
    (('.', '>'), 'brighter by 1 %', functools.partial(dim, step=FINE_STEP)),
    ((',', '<'), 'darker by 1 %', functools.partial(dim, step=-FINE_STEP)),
    (('s',), 'strobe, or no strobe (flashing light can cause seizures)', strobe),
    (('r',), 'ask for identity and status again', refresh),
    (('a',), 'ALL lights off', Command.ALL_OFF),
    (('c',), 'clear lights that are gone', Command.CLEAR),
    (('?', 'h'), 'this help', Command.HELP),
    (('q', 'ctrl-c', 'ctrl-d', 'ctrl-\\'), 'quit', Command.QUIT),
    (('ctrl-z',), 'stop; fg continues', Command.STOP),
)
_MEANINGS = {key: meaning for keys, _, meaning in BINDINGS for key in keys}
_MOVES = {'up': -1, 'k': -1, 'down': 1, 'j': 1, 'page up': -PAGE, 'page down': PAGE,
          'home': -10**6, 'end': 10**6}


class KeyBindings:
    """
    The state that keys change.

    :param submit: sends a request to a light, given its name.
    :param clear_gone: removes the lights that are gone.
    :ivar selected: the name of a light, None while there is none.
    :ivar stop: whether the job must stop until the shell continues it.
    """

    def __init__(
        self, submit: Callable[[str, Ask], None], clear_gone: Callable[[], None],
    ) -> None:
        self._submit = submit
        self._clear_gone = clear_gone
        self.selected: str | None = None
        self.show_help = False
        self.quit = False
        self.stop = False

    def end(self) -> None:
        """End the monitor; callable from any thread."""
        self.quit = True

    def resume(self) -> None:
        """Record that the shell has continued the job."""
        self.stop = False

    def update(self, lights: Sequence[Light]) -> None:
        """Keep the selection while its light is listed, else select the light before it."""
        names = [light.name for light in lights]
        if self.selected not in names:
            before = [name for name in names if name < (self.selected or '')]
            self.selected = before[-1] if before else next(iter(names), None)

    def press(self, key: str, lights: Sequence[Light], now: float) -> None:
        """Act on a key."""
        self.update(lights)
        meaning = _MEANINGS.get(key)
        if meaning is Command.QUIT:
            self.end()
        elif meaning is Command.STOP:
            self.stop = True
        elif meaning is Command.ALL_OFF:
            # The help names this key, so it must act there, too.
            self.show_help = False
            for light in lights:
                if light.state(now) is not State.GONE:
                    self._submit(light.name, switch_off)
        elif self.show_help or meaning is Command.HELP:
            self.show_help = not self.show_help
        elif meaning is Command.CLEAR:
            self._clear_gone()
        elif self.selected is None or meaning is None:
            return
        elif isinstance(meaning, Command):
            names = [light.name for light in lights]
            at = names.index(self.selected) + _MOVES[key]
            self.selected = names[min(max(at, 0), len(names) - 1)]
        else:
            self._submit(self.selected, meaning)
