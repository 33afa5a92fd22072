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

"""The screen of the monitor, on terminals of every size and kind."""

import io
import re
from typing import Literal

from illuminator_ros.cli.monitor.key_bindings import BINDINGS
from illuminator_ros.cli.monitor.model import Diagnosis, DiscoveredLights, Outcome
from illuminator_ros.cli.monitor.view import bar, columns_for, plain, screen, sparkline, ViewState
import pytest
from rich.console import Console
from rich.screen import Screen

NOW = 1000.0
SIZES = [(200, 50), (132, 24), (80, 24), (60, 12), (40, 8), (20, 6), (12, 3), (5, 2), (1, 1)]


def lights_of(*names: str) -> DiscoveredLights:
    """Return lights that are on and have published all values."""
    lights = DiscoveredLights()
    lights.seen(names, NOW)
    for name in names:
        for topic, value in {
            'connected': True, 'enabled': True, 'brightness': 40.0, 'mode': 'internal_control',
            'strobe_period': 0.5, 'strobe_duty_cycle': 20.0, 'error_flags': 1, 'uptime': 300.0,
        }.items():
            lights.take(name, topic, value, NOW)
        for second in range(10):
            lights.take(name, 'temperature', 30.0 + second, NOW - 20 + 2 * second)
        lights.take(name, 'temperature', 41.5, NOW)
        lights.agreed(name, 90.0)
        lights.diagnosed(name, 'link', Diagnosis(1, '12 % of the frames lost', {
            'loss_percent': '12.3', 'round_trip_p50_ms': '3.2', 'round_trip_p95_ms': '40'}), NOW)
        lights.diagnosed(name, 'lamp', Diagnosis(1, 'dimmed because it is hot', {
            'vendor': 'maker', 'model': 'torch', 'holder': 'safety', 'serial_number': 'T-1'}), NOW)
    return lights


def shown(lights: DiscoveredLights, width: int = 132, height: int = 24, *,
          color: Literal['standard'] | None = None, now: float = NOW,
          selected: str | None = '/bow', **how: bool) -> str:
    """Return the output for a terminal."""
    file = io.StringIO()
    console = Console(file=file, width=width, height=height, force_terminal=bool(color),
                      color_system=color, highlight=False, legacy_windows=False)
    drawn = screen(ViewState(lights.snapshot(), selected, now, **how), width, height)
    # As rich.live.Live draws it.
    console.print(Screen(drawn), end='')
    return file.getvalue()


@pytest.mark.parametrize('text', [
    '/bow', 'ON', '40 %', '0.5 s 20 %', 'internal', '41.5 C', '12 %', '3.2 ms',
    'thermal throttling', 'dimmed because it is hot', 'maker torch', 'no. T-1',
    'agreed: 90 %', 'up 5 min', 'held by safety', '1 light: 1 ON', '30.0 to 41.5'])
def test_screen_shows_each_known_value(text: str) -> None:
    assert text in shown(lights_of('/bow'))


@pytest.mark.parametrize(('width', 'height'), SIZES)
@pytest.mark.parametrize('count', [0, 1, 3, 40])
@pytest.mark.parametrize('show_help', [False, True])
def test_screen_fits_every_terminal(
    width: int, height: int, count: int, show_help: bool,
) -> None:
    names = [f'/vehicle_{number:02}/illuminator' for number in range(count)]

    lines = shown(lights_of(*names), width, height, selected=names[-1] if names else None,
                  show_help=show_help).splitlines()

    assert len(lines) <= height
    assert max(map(len, lines), default=0) <= width


@pytest.mark.parametrize(('width', 'height'), [(132, 24), (80, 24), (60, 12), (40, 8)])
@pytest.mark.parametrize('at', [0, 17, 39])
def test_selected_light_is_on_the_screen(width: int, height: int, at: int) -> None:
    names = [f'/l{number:02}' for number in range(40)]

    assert f'{names[at]} ' in shown(lights_of(*names), width, height, selected=names[at])


def test_narrower_screen_has_a_part_of_the_columns() -> None:
    titles = [[column.title for column in columns_for(width)] for width in range(1, 250)]

    assert titles[0] == ['LIGHT', 'STATE'][:len(titles[0])]
    assert all(set(narrow) <= set(wide)
               for narrow, wide in zip(titles, titles[1:], strict=False))
    assert {'STATE', 'BRIGHT', 'TEMP', 'STROBE', 'ERRORS', 'LOSS'} <= set(titles[79])
    assert {'TREND', 'RTT', 'MODE', 'LAST'} <= set(titles[-1])


def test_help_lists_each_key() -> None:
    text = shown(lights_of('/bow'), show_help=True)

    assert all(key in text for keys, _, _ in BINDINGS for key in keys)


def test_unknown_values_are_dashes_and_no_lights_a_sentence() -> None:
    assert 'no lights in this ROS graph yet' in shown(DiscoveredLights())
    lights = DiscoveredLights()
    lights.seen(['/bow'], NOW)

    [row] = [line for line in shown(lights).splitlines() if ' ? ' in line][1:2]

    assert row.split() == ['/bow', '?', '-', '-', '-', '-', '-', '-']


@pytest.mark.parametrize(('seconds', 'there', 'word'), [
    (0, True, 'ON'), (30, True, 'silent'), (0, False, 'gone')])
def test_state_is_a_word_and_not_only_a_colour(seconds: int, there: bool, word: str) -> None:
    lights = lights_of('/bow', '/stern')
    lights.seen(['/bow', '/stern'] if there else ['/stern'], NOW)

    text = shown(lights, now=NOW + seconds)

    assert re.search(rf'^/bow +{word} ', text, re.M)
    assert there or '2 lights: 1 ON, 1 gone' in text


@pytest.mark.parametrize(('width', 'height'), [(132, 24), (80, 24), (60, 20)])
def test_refusal_is_shown_with_its_reason(width: int, height: int) -> None:
    lights = lights_of('/bow')
    lights.acted('/bow', 'brightness 90 %', Outcome.FAILED,
                 'refused: MAV_RESULT_DENIED (1 try, 3 ms)', NOW - 3)

    text = ' '.join(shown(lights, width, height).split())

    assert 'brightness 90 %: FAILED: refused: MAV_RESULT_DENIED (1 try, 3 ms) (3 s ago)' in text


def test_colours_mark_a_failure_and_markup_in_a_message_is_text() -> None:
    lights = lights_of('/bow')
    lights.acted('/bow', '[bold]x[/bold]', Outcome.FAILED, '[red]no[/red]', NOW)

    assert '[bold]x[/bold]: FAILED: [red]no[/red]' in shown(lights)
    assert '\x1b[1;31mFAILED' in shown(lights, color='standard')


@pytest.mark.parametrize('ascii_only', [False, True])
def test_ascii_terminal_gets_ascii_only(ascii_only: bool) -> None:
    assert shown(lights_of('/bow', '/stern'), ascii_only=ascii_only).isascii() is ascii_only


def table(lights: DiscoveredLights) -> list[list[str]]:
    """Return the cells of the table for a pipe."""
    console = Console(file=io.StringIO(), width=400, record=True, color_system=None)
    console.print(plain(ViewState(lights.snapshot(), None, NOW)))
    return [re.split(' {2,}', line.rstrip()) for line in console.export_text().splitlines()]


def test_table_has_a_heading_and_a_row_for_each_light() -> None:
    heading, *rows = table(lights_of('/stern', '/bow'))

    assert heading == ['LIGHT', 'STATE', 'BRIGHT', 'STROBE', 'MODE', 'TEMP', 'LOSS', 'RTT',
                       'ERRORS', 'DIAGNOSTICS']
    assert rows == [
        [name, 'ON', '40 %', '0.5 s 20 %', 'internal', '41.5 C', '12 %', '3.2 ms',
         'thermal throttling', 'WARN: dimmed because it is hot; WARN: 12 % of the frames lost']
        for name in ('/bow', '/stern')]


@pytest.mark.parametrize(('value', 'drawn'), [
    (0.0, '----'), (0.1, '#---'), (50.0, '##--'), (100.0, '####'), (None, '    '),
    (float('nan'), '    '), (900.0, '####')])
def test_bar_is_as_long_as_the_share(value: float | None, drawn: str) -> None:
    assert bar(value, 4, ascii_only=True) == drawn


@pytest.mark.parametrize(('values', 'drawn'), [
    ([20.0, 25.0, 30.0, None, 40.0], '▁▃▅ █'),
    # A tenth of a degree is not a peak.
    ([25.0, 25.1, 25.0], '▄▅▄'),
    ([None, None], '  '),
    ([-1.7e308, 1.7e308], '▁█')])
def test_sparkline_spans_lowest_to_highest_value(
    values: list[float | None], drawn: str,
) -> None:
    assert sparkline(values) == drawn
