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

"""The screen and the table, as rich draws them from the model. No ROS, no terminal."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
import math

from rich import box
from rich.console import Group, RenderableType
from rich.layout import Layout
from rich.table import Table
from rich.text import Text

from .key_bindings import BINDINGS
from .model import Action, Diagnosis, Light, Outcome, State

STATE_STYLES = {State.ON: 'bold green', State.OFF: '', State.UNKNOWN: 'dim',
                State.LOST: 'bold red', State.SILENT: 'yellow', State.GONE: 'red'}
OUTCOME_STYLES = {Outcome.PENDING: 'dim', Outcome.DONE: 'green', Outcome.FAILED: 'bold red'}
LEVELS = (('OK', 'green'), ('WARN', 'yellow'), ('ERROR', 'bold red'), ('STALE', 'dim'))
UNKNOWN = '-'
BLOCKS = '▁▂▃▄▅▆▇█'
ASCII_BLOCKS = '_.-=+*%#'
# K; a smaller difference is drawn as a flat line.
SMALLEST_SPAN = 4.0
# degC; a greater value is clipped.
HIGHEST = 1e6
BAR_WIDTH = 10
TREND_WIDTH = 12
DETAIL_TREND_WIDTH = 60
# The least height of the details of the selected light, lines.
DETAIL_HEIGHT = 4
FOOTER = 'space on/off  +/- brightness  s strobe  r refresh  a all off  ? help  q quit'
NO_LIGHTS = 'no lights in this ROS graph yet; is a bridge running, with this ROS_DOMAIN_ID?'


def bar(value: float | None, width: int, *, ascii_only: bool = False) -> str:
    """Return a bar for a share, %."""
    if value is None or not math.isfinite(value):
        return ' ' * width
    full, empty = '#-' if ascii_only else '█░'
    filled = min(max(round(value / 100 * width), 1 if value > 0 else 0), width)
    return full * filled + empty * (width - filled)


def sparkline(values: Sequence[float | None], *, ascii_only: bool = False) -> str:
    """Return a character for each value, a space for None."""
    blocks = ASCII_BLOCKS if ascii_only else BLOCKS
    # Published temperatures are not checked, and their difference must be finite.
    values = [None if value is None else min(max(value, -HIGHEST), HIGHEST) for value in values]
    known = [value for value in values if value is not None]
    if not known:
        return ' ' * len(values)
    low, high = min(known), max(known)
    missing = max(SMALLEST_SPAN - (high - low), 0.0)
    low, span = low - missing / 2, high - low + missing
    return ''.join(' ' if value is None else
                   blocks[min(int((value - low) / span * len(blocks)), len(blocks) - 1)]
                   for value in values)


def brightness(value: float | None) -> str:
    """Return a brightness, %."""
    return UNKNOWN if value is None else f'{value:.3g} %'


def strobe(period: float | None, duty: float | None) -> str:
    """Return a strobe of a period, s, and a duty cycle, %."""
    if period is None:
        return UNKNOWN
    if not period:
        return 'steady'
    return f'{period:.3g} s' + ('' if duty is None else f' {duty:.3g} %')


def mode(value: str | None) -> str:
    """Return a mode, short."""
    return (value or UNKNOWN).partition('_')[0]


def temperature(value: float | None) -> str:
    """Return a temperature, degC."""
    return UNKNOWN if value is None else f'{value:.1f} C'


def measured(diagnosis: Diagnosis | None, key: str) -> str:
    """Return a value of the diagnostics with the unit of its key: ``_percent`` or ``_ms``."""
    value = diagnosis.number(key) if diagnosis else None
    unit = '%' if key.endswith('percent') else 'ms'
    return UNKNOWN if value is None else f'{value:{".2g" if value < 10 else ".0f"}} {unit}'


def link_quality(link: Diagnosis) -> str:
    """Return loss and round trip times of a link."""
    return (f'{measured(link, "loss_percent")} lost, round trip '
            f'{measured(link, "round_trip_p50_ms")}, 95 % of them within '
            f'{measured(link, "round_trip_p95_ms")}')


def age(seconds: float) -> str:
    """Return a length of time in one unit."""
    for unit, size in (('d', 86400), ('h', 3600), ('min', 60)):
        if seconds >= 2 * size:
            return f'{seconds / size:.0f} {unit}'
    return f'{max(seconds, 0):.0f} s'


@dataclass(frozen=True)
class ViewState:
    """
    The input of the screen.

    :param selected: the name of the selected light, None for none.
    :param now: the time, s.
    :param ascii_only: whether the terminal shows ASCII only.
    """

    lights: Sequence[Light]
    selected: str | None
    now: float
    show_help: bool = False
    ascii_only: bool = False


@dataclass(frozen=True)
class Column:
    """
    A column of the table.

    :param width: characters.
    :param rank: the column with the highest rank is left out first if the screen is narrow.
    :param grows: whether it takes the remaining width.
    :param plain: whether the table for a file or a pipe has it.
    """

    title: str
    width: int
    rank: int
    cell: Callable[[Light, ViewState], Text]
    grows: bool = False
    plain: bool = True


def _state(light: Light, view: ViewState) -> Text:
    state = light.state(view.now)
    return Text(state.value, STATE_STYLES[state])


def _brightness_bar(light: Light, view: ViewState) -> Text:
    value = light.value('brightness')
    style = 'yellow' if light.state(view.now) is State.ON else 'dim'
    return Text(bar(value, BAR_WIDTH, ascii_only=view.ascii_only), style)


def _trend(light: Light, view: ViewState) -> Text:
    values = light.temperatures.last(TREND_WIDTH, view.now)
    return Text(sparkline(values, ascii_only=view.ascii_only), 'cyan')


def _last(light: Light, view: ViewState) -> Text:
    return _action(light.action) if light.action else Text('')


def _action(action: Action) -> Text:
    text = Text(f'{action.text}: ')
    text.append(action.outcome.value, OUTCOME_STYLES[action.outcome])
    if action.answer:
        text.append(f': {action.answer}')
    return text


def _plain(cell: Callable[[Light], str], style: str = '') -> Callable[[Light, ViewState], Text]:
    return lambda light, view: Text(cell(light), style)


COLUMNS = (
    Column('LIGHT', 14, 0, _plain(lambda light: light.name)),
    Column('STATE', 6, 0, _state),
    Column('', BAR_WIDTH, 4, _brightness_bar, plain=False),
    Column('BRIGHT', 6, 1, _plain(lambda light: brightness(light.value('brightness')))),
    Column('STROBE', 11, 5, _plain(lambda light: strobe(
        light.value('strobe_period'), light.value('strobe_duty_cycle')))),
    Column('MODE', 8, 8, _plain(lambda light: mode(light.value('mode')))),
    Column('TEMP', 8, 2, _plain(lambda light: temperature(light.value('temperature')))),
    Column('TREND', TREND_WIDTH, 9, _trend, plain=False),
    Column('LOSS', 5, 6, _plain(lambda light: measured(light.link, 'loss_percent'))),
    Column('RTT', 7, 7, _plain(lambda light: measured(light.link, 'round_trip_p50_ms'))),
    Column('ERRORS', 10, 3, _plain(lambda light: ', '.join(light.flags), 'yellow'), grows=True),
    Column('LAST', 24, 10, _last, grows=True),
)
TITLES = [column.title for column in COLUMNS]


def columns_for(width: int, longest: int = 0) -> list[Column]:
    """
    Return the columns that fit in a width, with a space between them.

    :param longest: characters of the longest name; it gets a third of the width at most.
    """
    chosen: list[Column] = []
    names = replace(COLUMNS[0], width=max(COLUMNS[0].width, min(longest, width // 3)))
    for column in sorted((names, *COLUMNS[1:]), key=lambda column: column.rank):
        if sum(one.width + 1 for one in [*chosen, column]) > width and column.rank:
            break
        chosen.append(column)
    return sorted(chosen, key=lambda column: TITLES.index(column.title))


def table(view: ViewState, width: int, height: int) -> Table:
    """Return a row for each light, or as many as fit around the selected one."""
    shown = columns_for(width, max((len(light.name) for light in view.lights), default=0))
    drawn = Table(box=None, expand=True, pad_edge=False, padding=(0, 1, 0, 0),
                  header_style='bold')
    if not any(column.grows for column in shown):
        shown[0] = replace(shown[0], grows=True)
    for column in shown:
        # A very narrow terminal shows the name only, cut off.
        drawn.add_column(column.title, no_wrap=True, overflow='ellipsis',
                         min_width=min(column.width, max(width - 8, 1)),
                         max_width=None if column.grows else column.width,
                         ratio=column.width if column.grows else None)
    for light in window(view.lights, view.selected, max(height - 1, 1)):
        drawn.add_row(*(column.cell(light, view) for column in shown),
                      style=_row_style(light, view))
    return drawn


def _row_style(light: Light, view: ViewState) -> str:
    # The values of a lost light are out of date.
    stale = light.state(view.now) in (State.LOST, State.SILENT, State.GONE)
    return ('dim ' if stale else '') + ('reverse' if light.name == view.selected else '')


def window(lights: Sequence[Light], selected: str | None, height: int) -> Sequence[Light]:
    """Return as many lights as there are lines, including the selected one."""
    at = next((at for at, light in enumerate(lights) if light.name == selected), 0)
    first = max(0, min(at - height // 2, len(lights) - height))
    return lights[first:first + height]


def title(view: ViewState) -> Text:
    """Return the first line: the number of lights in each state."""
    states = [light.state(view.now) for light in view.lights]
    parts = [f'{states.count(state)} {state.value}' for state in State if state in states]
    plural = '' if len(states) == 1 else 's'
    return Text(f'{len(states)} light{plural}' + (f': {", ".join(parts)}' if parts else ''),
                'bold', no_wrap=True, overflow='ellipsis')


def details(light: Light, view: ViewState) -> RenderableType:
    """Return the details of a light."""
    rows = Table.grid(padding=(0, 1), expand=True)
    rows.add_column(style='bold', no_wrap=True)
    rows.add_column(ratio=1)
    if light.action is not None:
        answered = _action(light.action)
        answered.append(f' ({age(view.now - light.action.at)} ago)', 'dim')
        rows.add_row('last', answered)
    for kind, one in (('lamp', light.lamp), ('link', light.link)):
        if one is not None:
            word, style = LEVELS[min(one.level, len(LEVELS) - 1)]
            text = Text(word, style)
            text.append(f': {one.message}' + (f'; {link_quality(one)}' if kind == 'link' else ''),
                        'default')
            rows.add_row(kind, text)
    rows.add_row('light', Text(_facts(light, view)))
    values = light.temperatures.last(DETAIL_TREND_WIDTH, view.now)
    known = [value for value in values if value is not None]
    if known:
        rows.add_row('temp', Text.assemble(
            f'{temperature(light.value("temperature"))} ',
            (sparkline(values, ascii_only=view.ascii_only).lstrip(), 'cyan'),
            f' {min(known):.1f} to {max(known):.1f} in 2 min'))
    return rows


def _facts(light: Light, view: ViewState) -> str:
    identity = ' '.join(light.lamp.values.get(key, '') for key in ('vendor', 'model')
                        ) if light.lamp else ''
    serial = light.lamp.values.get('serial_number', '') if light.lamp else ''
    shines = brightness(light.value('brightness'))
    agreed = light.setpoint
    if agreed is not None and agreed != light.value('brightness'):
        shines += f' (agreed: {agreed:g} %)'
    up = light.value('uptime')
    holder = light.lamp.values.get('holder', '') if light.lamp else ''
    silence = light.silence(view.now)
    return ', '.join(filter(None, (
        identity.strip(), serial and f'no. {serial}', shines,
        strobe(light.value('strobe_period'), light.value('strobe_duty_cycle')),
        str(light.value('mode') or ''), holder and f'held by {holder}',
        '' if up is None else f'up {age(up)}',
        f'nothing heard for {age(silence)}' if silence > 2 else '')))


def help_text() -> Table:
    """Return the meaning of each key."""
    drawn = Table(box=box.SIMPLE, show_header=False, pad_edge=False)
    drawn.add_column(style='bold')
    drawn.add_column()
    for keys, text, _ in BINDINGS:
        drawn.add_row('  '.join(keys), text)
    return drawn


def screen(view: ViewState, width: int, height: int) -> RenderableType:
    """Return the screen for a terminal of this size."""
    footer = Text(FOOTER, 'dim', no_wrap=True, overflow='ellipsis')
    if view.show_help:
        return _stacked(height, (help_text(), None), (Text('any key goes back', 'dim'), 1))
    if not view.lights:
        return _stacked(height, (title(view), 1), (Text(NO_LIGHTS), None), (footer, 1))
    selected = next((light for light in view.lights if light.name == view.selected), None)
    rows = len(view.lights) + 1
    room = height - 2
    if selected is None or room < DETAIL_HEIGHT + 3:
        return _stacked(height, (title(view), 1), (table(view, width, room), None), (footer, 1))
    # The table gets at least half of the screen, and the lines that the details do not need.
    rows = min(rows, max(room - DETAIL_HEIGHT - 7, room // 2))
    heading = Text(f'\n{selected.name}', 'bold', no_wrap=True, overflow='ellipsis')
    return _stacked(height, (title(view), 1), (table(view, width, rows), rows),
                    (Group(heading, details(selected, view)), None), (footer, 1))


def _stacked(height: int, *parts: tuple[RenderableType, int | None]) -> RenderableType:
    """Return parts one above the other, each with its lines; None is the rest."""
    if height < 4:
        # Only the main part fits, the one without a fixed height.
        return next(part for part, lines in parts if lines is None)
    layout = Layout()
    layout.split_column(*(Layout(part, size=lines) if lines else Layout(part)
                          for part, lines in parts))
    return layout


def plain(view: ViewState) -> RenderableType:
    """Return a table without colours, bars and limits, for a file or a pipe."""
    if not view.lights:
        return Text('no lights')
    drawn = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style='')
    shown = [column for column in COLUMNS[:-1] if column.plain]
    for column in shown:
        drawn.add_column(column.title, no_wrap=True)
    drawn.add_column('DIAGNOSTICS', no_wrap=True)
    for light in view.lights:
        found = [f'{LEVELS[min(one.level, 3)][0]}: {one.message}'
                 for one in (light.lamp, light.link) if one and one.level]
        drawn.add_row(*(Text(column.cell(light, view).plain or '-') for column in shown),
                      Text('; '.join(found) or ('OK' if light.lamp or light.link else '-')))
    return drawn
