# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The texts of the monitor, and the output for scripts. No terminal, no clock."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby
import json
import math
import re

from ...ros import monitor_view as shared
from ...ros.monitor_view import Cell, Device, LEVELS


def state(device: Device) -> list[Cell]:
    """Return the state of a device."""
    return [(device.state, {**shared.STATE_STYLES, **device.view.states}.get(device.state, ''))]


def level(device: Device) -> list[Cell]:
    """Return the worst level of a device, marked if the device is dangerous."""
    if device.level is None:
        return [shared.UNKNOWN]
    word, style = LEVELS[device.level]
    return [(f'{word}!', 'bold red') if device.attention == shared.DANGEROUS else (word, style)]


def report(device: Device) -> list[Cell]:
    """Return what the row of a device says: the newest first, then what is wrong, then values."""
    parts: list[list[Cell]] = []
    at = -math.inf
    if device.action is not None:
        text, outcome, answer, at = device.action
        if outcome == shared.PENDING or device.now < at + shared.NEWS_LIFETIME:
            # The details have the answer; a row has what is wrong behind it.
            parts.append([f'{text}: ', outcome, f': {answer}' * (
                bool(answer) and outcome != shared.DONE)])
    news, noted = device.news
    # The line of that request itself would hide what is wrong.
    is_own = bool(parts) and noted < at + 1 and news.endswith('by service')
    if device.now < noted + shared.NEWS_LIFETIME and not is_own:
        # The row has the name.
        parts.append([re.sub(rf'^{device.view.kind} \d+/\d+:? ', '', news)])
    # The diagnosis of its link is last.
    parts += [[text] for text in (device.conflict, device.view.notice(device), *(
        one.message for _, one in sorted(
            device.diagnoses.items(), key=lambda item: item[0] == 'link') if one.level),
        '  '.join(filter(None, device.view.values(device)))) if text]
    return [cell for part in parts for cell in ('; ', *part)][1:]


def details(device: Device) -> Iterable[shared.DetailLine]:
    """Return labels and texts of everything about a device."""
    yield device.name, []
    if device.action is not None:
        text, outcome, answer, at = device.action
        yield 'last', [f'{text}: ', outcome, f': {answer}' * bool(answer),
                       (f' ({shared.age(device.now - at)} ago)', 'dim')]
    for kind, one in device.diagnoses.items():
        held = device.number(kind, 'held_s')
        yield kind, [LEVELS[device.level_of(one)], f': {one.message}', '' if held is None else (
            f'; held by {device.diagnosed(kind, "holder")} for {shared.age(held)}')]
    if device.conflict:
        yield 'nodes', [(device.conflict, 'yellow'), ': give each another name or namespace']
    if notice := device.view.notice(device):
        yield 'note', [notice]
    yield from device.view.details(device)
    if device.now - device.heard_at > 2:
        yield 'silent', [f'nothing heard for {shared.age(device.now - device.heard_at)}']


def off_report(answers: Sequence[tuple[str, Cell, str]]) -> list[Cell]:
    """Return how many devices have confirmed ALL OFF, and the answer of each other one."""
    others = [one for one in answers if one[1] != shared.DONE]
    cells: list[Cell] = [(f'ALL OFF: {len(answers) - len(others)} of {len(answers)} confirmed',
                          'bold')]
    if answers and not others:
        cells.append(': ' + ', '.join(name for name, _, _ in answers))
    for name, outcome, answer in others:
        cells += ['; ', f'{name} ', outcome, f': {answer}' if answer else '']
    return cells


def counts(devices: Iterable[Device]) -> str:
    """Return the number of devices of each kind in each state."""
    found = []
    for _, group in groupby(devices, key=lambda device: device.view.kind):
        some = list(group)
        view, states = some[0].view, [device.state for device in some]
        found.append(f'{len(some)} {view.kind}{"s" * (len(some) > 1)}: ' + ', '.join(
            f'{states.count(word)} {word}' for word in (*view.states, *shared.STATE_STYLES)
            if word in states))
    return '; '.join(found)


def plain(devices: Iterable[Device]) -> list[str]:
    """Return a table without styles and limits, for a file or a pipe."""
    rows = [['DEVICE', 'STATE', 'LEVEL', 'REPORT'], *(
        [device.name, *(''.join(cell if isinstance(cell, str) else cell[0] for cell in cells)
                        for cells in (state(device), level(device), report(device)))]
        for device in devices)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ['  '.join(map(str.ljust, row, widths)).rstrip() for row in rows]


def as_json(devices: Sequence[Device]) -> str:
    """Return all known values as JSON."""
    return json.dumps([{
        'name': device.name, 'kind': device.view.kind, 'state': device.state,
        'values': device.values, 'diagnostics': {
            kind: {'level': LEVELS[one.level][0], 'message': one.message, 'values': one.values}
            for kind, one in device.diagnoses.items()}}
        for device in devices], allow_nan=False, indent=2)
