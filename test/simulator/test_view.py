# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The views of simulated lights: plain lines, and a live view on a terminal."""

import io
import os
import re
import shutil
from typing import Any

from illuminator_ros.cli.simulator.view import LiveView, PlainView
from illuminator_ros.illuminator.simulated import SimulatedIlluminator
from illuminator_ros.illuminator.simulated_properties import (
    FAULTS,
    IlluminatorBehaviour,
    IlluminatorProperties,
)
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.simulation.simulated import SimulatedComponent
import pytest

Light = SimulatedComponent[SimulatedIlluminator]


def simulated(**properties: Any) -> Light:
    return SimulatedComponent(SimulatedIlluminator(IlluminatorProperties(**properties)), 0.0)


@pytest.fixture
def device() -> Light:
    return simulated(address=Address(1, 243), name='bow')


def press(component: Light, now: float, **changes: Any) -> None:
    component.apply(component.device.press(now, **changes), now)


class Terminal(io.StringIO):
    """The screen of a terminal, as far as the view uses one."""

    def screen(self) -> list[str]:
        rows: dict[int, str] = {}
        row, column, saved = 0, 0, (0, 0)
        for token in re.findall(r'\x1b7|\x1b8|\x1b\[\d*[AKJ]|[^\x1b]', self.getvalue()):
            if token == '\x1b7':
                saved = row, column
            elif token == '\x1b8':
                row, column = saved
            elif token.startswith('\x1b'):
                if token[-1] == 'A':
                    row -= int(token[2:-1])
                    continue
                rows[row] = rows.get(row, '')[:column]
                if token[-1] == 'J':
                    rows = {one: text for one, text in rows.items() if one <= row}
            elif token == '\r':
                column = 0
            elif token == '\n':
                row += 1
            else:
                line = rows.get(row, '').ljust(column)
                rows[row] = line[:column] + token + line[column + 1:]
                column += 1
        return [rows.get(one, '') for one in range(max(rows) + 1)]


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    monkeypatch.setattr(shutil, 'get_terminal_size', lambda: os.terminal_size((80, 10)))
    return Terminal()


@pytest.fixture
def live(terminal: Terminal, device: Light) -> LiveView:
    view = LiveView(terminal)
    view.show([device.snapshot(0.0)])
    return view


def test_a_line_has_the_actual_state_the_flags_and_the_faults(device: Light) -> None:
    press(device, 0.0, enabled=True, brightness=60.0, strobe_period=0.5, strobe_duty_cycle=25.0,
          mode='external_sync')
    device.device.heat_to(85.0, 0.0)
    device.behave(FAULTS.add(device.behaviour, 'drop'), 0.0)
    assert re.split(r'  +', device.snapshot(0.1).text) == [
        '1/243 bow', 'ON', '30 %', 'strobe 0.5 s, 25 %', '85.0 degC', 'external_sync',
        'thermal throttling', '[drop]']
    device.behave(FAULTS.add(IlluminatorBehaviour(), 'thermistor'), 0.0)
    assert '85.0 degC' in device.snapshot(0.1).text


def test_a_plain_line_is_written_when_the_state_changes(device: Light) -> None:
    stream = io.StringIO()
    view = PlainView(stream)
    for enabled in (False, False, True, True):
        press(device, 0.0, enabled=enabled)
        view.show([device.snapshot(0.0)])
    view.say('')
    off, on = stream.getvalue().splitlines()
    assert ('off' in off, 'ON' in on, '\x1b' in stream.getvalue()) == (True, True, False)


def test_the_live_view_updates_the_line_and_keeps_what_is_typed(
        device: Light, terminal: Terminal, live: LiveView) -> None:
    terminal.write('brightn')
    device.device.heat_to(50.0, 0.0)
    live.show([device.snapshot(0.0)])
    terminal.write('ess')
    line, prompt = terminal.screen()
    assert ('50.0 degC' in line, prompt) == (True, '> brightness')
    before = terminal.getvalue()
    live.show([device.snapshot(0.0)])
    assert terminal.getvalue() == before


def test_the_live_view_has_an_answer_below_its_line_and_an_event_above_the_lights(
        terminal: Terminal, live: LiveView) -> None:
    terminal.write('faults\r\n')
    live.say('1/243: no fault', typed='faults')
    live.say('link open: somewhere')
    typed, answer, event, line, prompt = terminal.screen()
    assert (typed, answer, event, prompt) == (
        '> faults', '1/243: no fault', 'link open: somewhere', '> ')
    assert line.startswith('1/243 bow')


def test_the_live_view_fits_the_terminal(device: Light, terminal: Terminal) -> None:
    press(device, 0.0, enabled=True)
    device.device.heat_to(85.0, 0.0)
    lights = [device, *(simulated(address=Address(1, n)) for n in range(1, 20))]
    LiveView(terminal).show([one.snapshot(0.0) for one in lights])
    screen = terminal.screen()
    assert screen[0].endswith('  thermal throttling')
    assert (len(screen), screen[5]) == (7, '... and 15 more')
    device.behave(FAULTS.add(FAULTS.add(device.behaviour, 'cold-throttling'),
                             'no-terminator'), 0.0)
    LiveView(terminal).show([device.snapshot(0.0)])
    assert max(map(len, terminal.screen())) == 79
