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

"""What whoever sits at the terminal does: which light is selected, what a key means."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from .actions import Ask, dim, FINE_STEP, refresh, STEP, strobe, switch, switch_off
from .keys import HELP
from .model import Light, State

PAGE = 10
QUIT, STOP, ALL_OFF, CLEAR, SHOW_HELP = 'q', 'ctrl-z', 'a', 'c', '?'
# The first spelling of each key.
_SAME = {spelling: keys[0] for keys, _ in HELP for spelling in keys}
_MOVES = {'up': -1, 'k': -1, 'down': 1, 'j': 1, 'page up': -PAGE, 'page down': PAGE,
          'home': -10**6, 'end': 10**6}
_REQUESTS: dict[str, Ask] = {
    'space': switch, '+': lambda light: dim(light, STEP), '-': lambda light: dim(light, -STEP),
    '.': lambda light: dim(light, FINE_STEP), ',': lambda light: dim(light, -FINE_STEP),
    's': strobe, 'r': refresh,
}


class Lights(Protocol):
    """What the keys act on."""

    def submit(self, name: str, ask: Ask) -> None:
        """Ask something of a light."""

    def clear_gone(self) -> None:
        """Forget the lights that are gone."""


class Operator:
    """
    What is selected and shown, and what keys do to it. No I/O.

    :ivar selected: the name of a light, None while there is none.
    :ivar stop: whether the job is to be stopped, until the shell continues it.
    """

    def __init__(self, lights: Lights) -> None:
        self._lights = lights
        self.selected: str | None = None
        self.show_help = False
        self.quit = False
        self.stop = False

    def look(self, lights: Sequence[Light]) -> None:
        """Take what lights there are: the selection stays, or goes to the nearest one."""
        names = [light.name for light in lights]
        if self.selected not in names:
            before = [name for name in names if name < (self.selected or '')]
            self.selected = before[-1] if before else next(iter(names), None)

    def press(self, key: str, lights: Sequence[Light], now: float) -> None:
        """Do what a key means."""
        self.look(lights)
        meaning = _SAME.get(key)
        if meaning == QUIT:
            self.quit = True
        elif meaning == STOP:
            self.stop = True
        elif self.show_help:
            self.show_help = False
        elif key in _MOVES:
            self._move(_MOVES[key], [light.name for light in lights])
        elif meaning == SHOW_HELP:
            self.show_help = True
        elif meaning == CLEAR:
            self._lights.clear_gone()
        elif meaning == ALL_OFF:
            for light in lights:
                if light.state(now) is not State.GONE:
                    self._lights.submit(light.name, switch_off)
        elif meaning in _REQUESTS and self.selected is not None:
            self._lights.submit(self.selected, _REQUESTS[meaning])

    def _move(self, by: int, names: list[str]) -> None:
        if self.selected in names:
            at = names.index(self.selected) + by
            self.selected = names[min(max(at, 0), len(names) - 1)]
