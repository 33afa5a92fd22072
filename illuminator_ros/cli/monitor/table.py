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

"""The list of devices in columns, and the output for scripts. No terminal, no clock."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import functools
from itertools import groupby
import json
import re
from typing import TypeVar

from ...ros.monitor_view import (
    Cell,
    Column,
    DANGEROUS,
    Device,
    Diagnosis,
    DONE,
    LEVELS,
    measured,
    NEWS_LIFETIME,
    PENDING,
    STATE_STYLES,
    UNKNOWN,
    View,
)

D = TypeVar('D', bound=Device)


def state(device: Device) -> Cell:
    """Return the state of a device with its style."""
    return device.state, {**STATE_STYLES, **device.view.states}.get(device.state, '')


def level(device: Device) -> Cell:
    """Return the worst level of a device with its style, marked if the device is dangerous."""
    if device.level is None:
        return UNKNOWN
    word, style = LEVELS[device.level]
    return (f'{word}!', 'bold red') if device.attention == DANGEROUS else (word, style)


def link(device: Device, key: str) -> str:
    """Return a value of the link with the unit of its key: ``_percent`` or ``_ms``."""
    return measured(device.number('link', key), '%' if key.endswith('percent') else 'ms', '.2g')


def last(device: Device) -> list[Cell]:
    """Return the last request to a device, and its answer."""
    if device.action is None:
        return []
    text, outcome, answer, _ = device.action
    return [f'{text}: ', outcome, f': {answer}' if answer else '']


def report(device: Device) -> list[Cell]:
    """Return what the row of a device says: the newest first, then what is wrong, then values."""
    parts: list[list[Cell]] = []
    if device.action is not None and (
            device.action[1] == PENDING or device.now < device.action[3] + NEWS_LIFETIME):
        # The details have the answer; a row has what is wrong behind it.
        parts.append(last(device)[:2] if device.action[1] == DONE else last(device))
    news, at = device.news
    if device.now < at + NEWS_LIFETIME:
        # The row has the name.
        parts.append([re.sub(rf'^{device.view.kind} \d+/\d+:? ', '', news)])
    parts += [[one.message] for one in problems(device)]
    if notice := device.view.notice(device):
        parts.append([notice])
    values = (column.cell(device) for column in device.view.columns)
    parts.append(['  '.join(one if isinstance(one, str) else one[0] for one in values)])
    return [cell for part in parts for cell in ('; ', *part)][1:]


def off_report(answers: Sequence[tuple[str, Cell, str]]) -> list[Cell]:
    """Return how many devices have confirmed ALL OFF, and the answer of each other one."""
    others = [(name, outcome, answer) for name, outcome, answer in answers if outcome != DONE]
    cells: list[Cell] = [(f'ALL OFF: {len(answers) - len(others)} of {len(answers)} confirmed',
                          'bold')]
    if not others:
        cells.append(': ' + ', '.join(name for name, _, _ in answers))
    for name, outcome, answer in others:
        cells += ['; ', f'{name} ', outcome, f': {answer}' if answer else '']
    return cells


def columns(view: View, name_width: int = 0) -> list[Column]:
    """Return the columns of a kind of device, the most important first."""
    return [
        Column(view.kind.upper(), name_width, lambda device: device.name),
        Column('STATE', 6, state),
        *view.columns, Column('SOURCE', 8, lambda device: device.values.get('source', '')),
        Column('LOSS', 6, functools.partial(link, key='loss_percent')),
        Column('RTT', 7, functools.partial(link, key='round_trip_ms'))]


def by_kind(devices: Iterable[D]) -> list[list[D]]:
    """Return devices, which are sorted by kind, as a list for each kind."""
    return [list(some) for _, some in groupby(devices, key=lambda device: device.view.kind)]


def counts(devices: Sequence[Device]) -> str:
    """Return the number of devices of one kind in each state."""
    view, states = devices[0].view, [device.state for device in devices]
    found = (f'{states.count(word)} {word}' for word in (*view.states, *STATE_STYLES)
             if word in states)
    return f'{len(devices)} {view.kind}{"s" * (len(devices) > 1)}: {", ".join(found)}'


def problems(device: Device) -> list[Diagnosis]:
    """Return the diagnoses of a device that have a finding, the diagnosis of its link last."""
    return [one for _, one in sorted(
        device.diagnoses.items(), key=lambda item: item[0] == 'link') if one.level]


def findings(device: Device) -> str:
    """Return what the diagnostics of a device report."""
    found = [f'{LEVELS[one.level][0]}: {one.message}' for one in problems(device)]
    return '; '.join(found) or (UNKNOWN if device.level is None else LEVELS[device.level][0])


def plain(devices: Sequence[Device]) -> list[str]:
    """Return a table for each kind, without styles and limits, for a file or a pipe."""
    lines: list[str] = []
    for some in by_kind(devices):
        shown = [*columns(some[0].view), Column('DIAGNOSTICS', 0, findings)]
        cells = [[one.cell(device) for one in shown] for device in some]
        rows = [[one.title for one in shown], *(
            [(one if isinstance(one, str) else one[0]) or UNKNOWN for one in row]
            for row in cells)]
        widths = [max(map(len, cells)) for cells in zip(*rows, strict=True)]
        lines += [''] * bool(lines) + [
            '  '.join(map(str.ljust, row, widths)).rstrip() for row in rows]
    return lines


def as_json(devices: Sequence[Device]) -> str:
    """Return all known values as JSON."""
    return json.dumps([{
        'name': device.name, 'kind': device.view.kind, 'state': device.state,
        'values': device.values, 'diagnostics': {
            kind: {'level': LEVELS[one.level][0], 'message': one.message, 'values': one.values}
            for kind, one in device.diagnoses.items()}}
        for device in devices], allow_nan=False, indent=2)
