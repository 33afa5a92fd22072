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

"""What simulated lights do, in a line each."""

from __future__ import annotations

from collections.abc import Sequence
import contextlib
from dataclasses import dataclass
import shutil
from typing import TextIO

from ...illuminator.device import Device
from ...illuminator.error_flags import flag_names
from ...illuminator.faults import active
from ...illuminator.model import Mode

# K by which the temperature has to change to be worth a plain line.
TEMPERATURE_STEP = 5.0
# Lines of a terminal that are left for the console.
SPARE_LINES = 4


@dataclass(frozen=True)
class Glance:
    """What a light does at a moment, as text for people."""

    name: str
    on: bool
    brightness: str
    strobe: str
    mode: str
    temperature: float
    flags: str
    faults: str

    def __str__(self) -> str:
        """Return the line."""
        parts = [f'{self.name:12}', 'ON ' if self.on else 'off', f'{self.brightness:>5} %',
                 f'{self.strobe:18}', f'{self.temperature:6.1f} degC']
        parts += filter(None, (self.mode, self.flags, self.faults))
        return '  '.join(parts)

    def differs(self, other: Glance | None) -> bool:
        """Return whether it is worth a line after another one."""
        if other is None:
            return True
        return (abs(self.temperature - other.temperature) >= TEMPERATURE_STEP
                or _steady(self) != _steady(other))


def _steady(one: Glance) -> tuple[object, ...]:
    return one.on, one.brightness, one.strobe, one.mode, one.flags, one.faults


def glance(device: Device, now: float) -> Glance:
    """Return what a light does now, whatever it says of itself."""
    status = device.status(now)
    period, duty = status.strobe_period, status.strobe_duty_cycle
    faults = active(device.behaviour, device.properties.normal)
    name = ' '.join(filter(None, (str(device.source), device.properties.name)))
    mode = Mode(status.mode)
    return Glance(
        name, device.enabled, f'{status.brightness:.3g}',
        f'strobe {period:g} s, {duty:g} %' if period else 'no strobe',
        '' if mode is Mode.INTERNAL_CONTROL else mode.label, device.thermal.temperature,
        ', '.join(flag_names(status.error_status)), f'[{", ".join(faults)}]' if faults else '')


class PlainView:
    """Plain lines, for each light when it does something else."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._shown: dict[str, Glance] = {}

    def show(self, glances: Sequence[Glance]) -> None:
        """Take what the lights do now."""
        for one in glances:
            if one.differs(self._shown.get(one.name)):
                self._shown[one.name] = one
                self.say(str(one))

    def say(self, text: str, *, typed: str | None = None) -> None:
        """Write something else, unless it is nothing."""
        if text:
            # The lights go on where nobody reads what they do any more.
            with contextlib.suppress(OSError):
                print(text, file=self._stream, flush=True)


class LiveView:
    """
    A line for each light on a terminal, always up to date, and a line to type in below.

    What is typed stands where the cursor is; that is left where it was.
    """

    PROMPT = '> '

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._lines: list[str] = []
        self._height = 0

    def show(self, glances: Sequence[Glance]) -> None:
        """Take what the lights do now."""
        size = shutil.get_terminal_size()
        room = max(size.lines - SPARE_LINES, 1)
        lines = [str(one) for one in glances[:room]]
        if len(glances) > room:
            lines[-1] = f'... and {len(glances) - room + 1} lights more'
        lines = [line[:size.columns - 1] for line in lines]
        if len(lines) != self._height:
            self._lines = lines
            self.say('')
        elif lines != self._lines:
            self._lines = lines
            # Save the cursor, go up, write each line over the old one, and come back.
            text = ''.join(f'{line}\x1b[K\r\n' for line in lines)
            self._write(f'\x1b7\x1b[{len(lines)}A\r{text}\x1b8')

    def say(self, text: str, *, typed: str | None = None) -> None:
        """
        Write something else, and the lights below it again.

        :param typed: the line that it answers; the cursor then stands below that.
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
