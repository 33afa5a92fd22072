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

"""What a terminal sends when keys are pressed, and what each key does."""

from __future__ import annotations

# ECMA-48 and xterm: what cursor and editing keys send behind the escape.
_SEQUENCES = {
    '[A': 'up', '[B': 'down', '[C': 'right', '[D': 'left', 'OA': 'up', 'OB': 'down',
    'OC': 'right', 'OD': 'left', '[H': 'home', '[F': 'end', 'OH': 'home', 'OF': 'end',
    '[1~': 'home', '[4~': 'end', '[7~': 'home', '[8~': 'end', '[5~': 'page up',
    '[6~': 'page down',
}
_CHARACTERS = {'\r': 'enter', '\n': 'enter', ' ': 'space', '\x03': 'ctrl-c', '\x04': 'ctrl-d',
               '\x1a': 'ctrl-z', '\x1c': 'ctrl-\\'}

# What a key does, for people, in the order of the help; the first spelling is the one shown.
HELP: tuple[tuple[tuple[str, ...], str], ...] = (
    (('up', 'down', 'k', 'j', 'home', 'end', 'page up', 'page down'), 'select a light'),
    (('space', 'enter'), 'switch it on or off'),
    (('+', '=', 'right'), 'brighter by 10 %'),
    (('-', '_', 'left'), 'darker by 10 %'),
    (('.', '>'), 'brighter by 1 %'),
    ((',', '<'), 'darker by 1 %'),
    (('s',), 'strobe, or no strobe (flashing light can cause seizures)'),
    (('r',), 'ask for identity and status again'),
    (('a',), 'ALL lights off'),
    (('c',), 'clear lights that are gone'),
    (('?', 'h'), 'this help'),
    (('q', 'ctrl-c', 'ctrl-d', 'ctrl-\\'), 'quit'),
    (('ctrl-z',), 'stop; fg goes on'),
)


class KeyDecoder:
    """Makes keys of what a terminal sends, which may come in any pieces."""

    def __init__(self) -> None:
        self._rest = b''

    @property
    def waiting(self) -> bool:
        """Whether an escape has come that may be the beginning of something longer."""
        return bool(self._rest)

    def feed(self, data: bytes) -> list[str]:
        """Return the keys; b'' says that nothing more has come for a while."""
        text = (self._rest + data).decode('utf-8', errors='replace')
        self._rest = b''
        keys = []
        while text:
            if text[0] != '\x1b':
                keys.append(_CHARACTERS.get(text[0], text[0]))
                text = text[1:]
                continue
            length = _sequence_length(text)
            if length == 0 and data:
                self._rest = text.encode()
                break
            keys.append(_SEQUENCES.get(text[1:length], 'escape') if length else 'escape')
            text = text[length or len(text):]
        return keys


def _sequence_length(text: str) -> int:
    """Return how long the escape sequence is that a text begins with, 0 if it is incomplete."""
    if len(text) < 2:
        return 0
    if text[1] == 'O':
        return 3 if len(text) >= 3 else 0
    if text[1] != '[':
        return 1
    for at, character in enumerate(text[2:], 2):
        if '@' <= character <= '~':
            return at + 1
    return 0
