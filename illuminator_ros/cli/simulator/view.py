# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The views of simulated components: plain lines, or a live view on a terminal."""

from __future__ import annotations

from collections.abc import Sequence
import contextlib
import shutil
from typing import TextIO

from ...simulation.simulated import Snapshot

# Lines of a terminal that are left for the console.
SPARE_LINES = 4


class PlainView:
    """Plain lines, one for each change of a component."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._shown: dict[int, Snapshot] = {}

    def show(self, components: Sequence[Snapshot]) -> None:
        """Show the present state of the components."""
        for number, one in enumerate(components):
            if one.differs(self._shown.get(number)):
                self._shown[number] = one
                self.say(one.text)

    def say(self, text: str, *, typed: str | None = None) -> None:
        """Write a text that is not empty, such as an event or an answer."""
        if text:
            # A closed output must not end the simulation.
            with contextlib.suppress(OSError):
                print(text, file=self._stream, flush=True)


class LiveView:
    """
    A current line for each component on a terminal, and a line for commands below.

    The cursor stays in the line that a person types.
    """

    PROMPT = '> '

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._lines: list[str] = []
        self._height = 0

    def show(self, components: Sequence[Snapshot]) -> None:
        """Show the present state of the components."""
        size = shutil.get_terminal_size()
        room = max(size.lines - SPARE_LINES, 1)
        lines = [one.text for one in components[:room]]
        if len(components) > room:
            lines[-1] = f'... and {len(components) - room + 1} more'
        lines = [line[:size.columns - 1] for line in lines]
        if len(lines) != self._height:
            self._lines = lines
            self.say('')
        elif lines != self._lines:
            self._lines = lines
            # Save the cursor, go up, overwrite each line, and restore the cursor.
            text = ''.join(f'{line}\x1b[K\r\n' for line in lines)
            self._write(f'\x1b7\x1b[{len(lines)}A\r{text}\x1b8')

    def say(self, text: str, *, typed: str | None = None) -> None:
        """
        Write a text, and the components below it again.

        :param typed: the line that it answers; the cursor is then below that line.
        """
        answered = '' if typed is None else f'{self.PROMPT}{typed}\r\n'
        text = text.replace('\n', '\r\n')
        up = self._height + (typed is not None)
        self._write((f'\x1b[{up}A' if up else '') + f'\r\x1b[J{answered}'
                    + (f'{text}\r\n' if text else ''))
        self._draw()

    def _draw(self) -> None:
        self._height = len(self._lines)
        if self._lines:
            self._write(''.join(f'{line}\x1b[K\r\n' for line in self._lines) + self.PROMPT)

    def _write(self, text: str) -> None:
        with contextlib.suppress(OSError):
            self._stream.write(text)
            self._stream.flush()
