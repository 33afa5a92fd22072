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

"""What is shown of simulated lights."""

import io
import os
import re
import shutil

from illuminator_ros.cli.simulator.view import LiveView, look, PlainView
from illuminator_ros.illuminator.faults import FAULTS
from illuminator_ros.illuminator.simulated import describe
from illuminator_ros.illuminator.simulated_properties import (
    IlluminatorBehaviour,
    IlluminatorProperties,
)
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.payload.simulated import SimulatedComponent
import pytest


def simulated(**properties):
    return SimulatedComponent(describe(IlluminatorProperties(**properties)), 0.0)


@pytest.fixture
def device():
    return simulated(address=Address(1, 243), name='bow')


def press(component, now, **changes):
    component.apply(component.device.press(now, **changes), now)


class Terminal(io.StringIO):
    """A terminal as far as the view uses one: what stands on the screen."""

    def screen(self):
        rows, row, column, saved = {}, 0, 0, (0, 0)
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
def terminal(monkeypatch):
    monkeypatch.setattr(shutil, 'get_terminal_size', lambda: os.terminal_size((80, 10)))
    return Terminal()


def test_a_line_has_all_that_a_light_does(device):
    press(device, 0.0, enabled=True, brightness=60.0, strobe_period=0.5, strobe_duty_cycle=25.0,
                 mode='external_sync')
    device.device.lamp.heat_to(85.0, 0.0)
    device.behave(FAULTS.add(device.behaviour, 'drop'), 0.0)
    line = str(look(device, 0.1))
    assert re.split(r'  +', line) == [
        '1/243 bow', 'ON', '30 %', 'strobe 0.5 s, 25 %', '85.0 degC', 'external_sync',
        'thermal throttling', '[drop]']


def test_the_line_shows_what_is_and_not_what_a_light_says(device):
    device.behave(FAULTS.add(IlluminatorBehaviour(), 'thermistor'), 0.0)
    device.device.lamp.heat_to(70.0, 0.0)
    assert '70.0 degC' in str(look(device, 0.0))


class TestPlainView:

    def test_a_line_comes_when_a_light_does_something_else(self, device):
        stream = io.StringIO()
        view = PlainView(stream)
        for now in range(5):
            view.show([look(device, float(now))])
        press(device, 5.0, enabled=True)
        for now in range(5, 8):
            view.show([look(device, float(now))])
        off, on = stream.getvalue().splitlines()
        assert ('off' in off, 'ON' in on) == (True, True)

    def test_a_temperature_is_worth_a_line_every_few_degrees(self, device):
        stream = io.StringIO()
        view = PlainView(stream)
        for temperature in range(30, 51):
            device.device.lamp.heat_to(float(temperature), 0.0)
            view.show([look(device, 0.0)])
        assert len(stream.getvalue().splitlines()) == 5

    def test_nothing_is_not_written(self):
        stream = io.StringIO()
        PlainView(stream).say('')
        assert stream.getvalue() == ''

    def test_it_is_plain(self, device):
        stream = io.StringIO()
        PlainView(stream).show([look(device, 0.0)])
        assert '\x1b' not in stream.getvalue()


class TestLiveView:

    def test_a_light_has_one_line_that_is_always_up_to_date(self, device, terminal):
        view = LiveView(terminal)
        for temperature in (30.0, 31.0, 32.0):
            device.device.lamp.heat_to(temperature, 0.0)
            view.show([look(device, 0.0)])
        line, prompt = terminal.screen()
        assert '32.0 degC' in line
        assert prompt == '> '

    def test_a_light_that_dims_itself_is_seen_to_in_80_columns(self, device, terminal):
        press(device, 0.0, enabled=True)
        device.device.lamp.heat_to(85.0, 0.0)
        LiveView(terminal).show([look(device, 0.0)])
        assert terminal.screen()[0].endswith('  thermal throttling')

    def test_what_is_being_typed_stays(self, device, terminal):
        view = LiveView(terminal)
        view.show([look(device, 0.0)])
        terminal.write('brightn')
        device.device.lamp.heat_to(50.0, 0.0)
        view.show([look(device, 0.0)])
        terminal.write('ess')
        line, prompt = terminal.screen()
        assert '50.0 degC' in line
        assert prompt == '> brightness'

    def test_an_answer_stands_under_what_it_answers_and_the_lights_under_that(
            self, device, terminal):
        view = LiveView(terminal)
        view.show([look(device, 0.0)])
        terminal.write('faults\r\n')
        view.say('1/243: no fault', typed='faults')
        typed, answer, line, prompt = terminal.screen()
        assert (typed, answer, prompt) == ('> faults', '1/243: no fault', '> ')
        assert line.startswith('1/243 bow')

    def test_an_event_leaves_no_old_lines_behind(self, device, terminal):
        view = LiveView(terminal)
        view.show([look(device, 0.0)])
        view.say('link open: somewhere')
        event, line, _ = terminal.screen()
        assert event == 'link open: somewhere'
        assert line.startswith('1/243 bow')

    def test_nothing_is_written_where_nothing_has_changed(self, device, terminal):
        view = LiveView(terminal)
        view.show([look(device, 0.0)])
        before = terminal.getvalue()
        view.show([look(device, 0.0)])
        assert terminal.getvalue() == before

    def test_more_lights_than_lines_are_counted(self, terminal):
        lights = [simulated(address=Address(1, n)) for n in range(1, 21)]
        LiveView(terminal).show([look(one, 0.0) for one in lights])
        screen = terminal.screen()
        assert len(screen) == 7
        assert screen[5] == '... and 15 lights more'

    def test_lines_are_no_longer_than_the_terminal_is_wide(self, device, terminal):
        device.behave(FAULTS.add(FAULTS.add(device.behaviour, 'cold-throttling'),
                                 'no-terminator'), 0.0)
        LiveView(terminal).show([look(device, 0.0)])
        assert max(map(len, terminal.screen())) == 79
