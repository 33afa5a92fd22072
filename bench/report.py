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

"""Rows and the machine as text, Markdown and JSON."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from importlib import metadata
import os
from pathlib import Path
import platform
import re
import subprocess
import time
from typing import Any

from .rows import Figures, Row, Target, VALUE

PACKAGES = ('pymavlink', 'fastcrc', 'pyserial', 'ros-rclpy', 'ros-rmw-fastrtps-cpp',
            'ros-fastrtps')
HEADER = ('| what | bridge | beside | ratio | target |', '|---|---|---|---|---|')


def machine() -> dict[str, Any]:
    """Return the machine and the versions that the figures depend on."""
    models = [line.partition(':')[2].strip() for line in Path('/proc/cpuinfo').read_text()
              .splitlines() if line.startswith('model name')]
    versions = {}
    for name in PACKAGES:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            versions[name] = 'unknown'
    commit = subprocess.run(['git', 'describe', '--always', '--dirty'], text=True,
                            capture_output=True, cwd=Path(__file__).parent).stdout.strip()
    return {
        'cpu': models[0] if models else platform.machine(), 'cores': os.cpu_count(),
        'kernel': platform.release(), 'python': platform.python_version(),
        'ros': os.environ.get('ROS_DISTRO', 'jazzy, from wheels'),
        'rmw': os.environ.get('RMW_IMPLEMENTATION', 'rmw_fastrtps_cpp'),
        'packages': versions, 'commit': commit or 'unknown', 'load': os.getloadavg()[0],
        'time': time.strftime('%Y-%m-%d %H:%M:%S %z')}


def number(value: float) -> str:
    """Return a figure with three digits, or more if it is large."""
    if abs(value) >= 1000:
        return f'{value:,.0f}'
    if abs(value) >= 100:
        return f'{value:.0f}'
    return f'{value:.3g}'


def figures(values: Figures, unit: str = '') -> str:
    """Return one figure, or quantiles separated by slashes."""
    text = ' / '.join(number(value) for value in values.values())
    return f'{text} {unit}'.strip()


def spread(row: Row) -> str:
    """Return the ranges of the ratios over repeated runs, in brackets."""
    ranges = (f'{number(low)} to {number(high)}' for low, high in row.spread.values())
    return f' ({" / ".join(ranges)})' if row.spread else ''


def judged(target: Target) -> str:
    """Return a target and whether it is met."""
    return f'{target.text}: {"met" if target.met else "MISSED"}'


def lines(row: Row) -> list[str]:
    """Return a row for a terminal."""
    names = '' if VALUE in row.ours else f' ({", ".join(row.ours)})'
    result = [f'{row.what}{names}: {figures(row.ours, row.unit)}']
    if row.note:
        result[0] += f'; {row.note}'
    result += [f'    {name}: {figures(values, row.unit)}' for name, values in row.peers.items()]
    if row.ratios:
        result.append(f'    ratio: {figures(row.ratios)}{spread(row)}')
    for target in row.targets:
        shown = f'{number(target.value)}, limit {number(target.limit)}'
        result.append(f'    {judged(target)} ({shown})')
    return result


def markdown(rows: Iterable[Row], about: dict[str, Any]) -> str:
    """Return the table that doc/performance.md holds, with the machine."""
    versions = ', '.join(f'{name} {version}' for name, version in about['packages'].items())
    result = [
        f'{about["cpu"]}, {about["cores"]} cores, Linux {about["kernel"]}, Python '
        f'{about["python"]}, {about["rmw"]}, {versions}; commit {about["commit"]}; load '
        f'{about["load"]:.1f} before.', '', *HEADER]
    for row in rows:
        beside = '<br>'.join(f'{name}: {figures(values, row.unit)}'
                             for name, values in row.peers.items())
        about_row = [', '.join(row.ours)] if 'max' in row.ours else []
        about_row += [row.note] if row.note else []
        what = row.what + (f' ({"; ".join(about_row)})' if about_row else '')
        result.append(f'| {what} | {figures(row.ours, row.unit)} | {beside} | '
                      f'{figures(row.ratios)}{spread(row)} | '
                      f'{"<br>".join(map(judged, row.targets))} |')
    # Markdown strikes out text between two tildes.
    result = [re.sub(r'~/\w+', r'`\g<0>`', line) for line in result]
    return '\n'.join(result).replace(' |  |', ' | |').replace('|  |', '| |')


def as_json(rows: Iterable[Row], about: dict[str, Any], took: dict[str, float]) -> dict[str, Any]:
    """Return the run; ``took``: s for each subject."""
    listed = []
    for row in rows:
        values = asdict(row)
        values['ratios'] = row.ratios
        values['targets'] = [{**asdict(target), 'met': target.met} for target in row.targets]
        listed.append(values)
    return {'machine': about, 'took': took, 'rows': listed}


def from_json(values: dict[str, Any]) -> list[Row]:
    """Return the rows of a stored run."""
    result = []
    for listed in values['rows']:
        given = {name: value for name, value in listed.items() if name != 'ratios'}
        given['targets'] = [
            Target(target['text'], target['value'], target['limit'])
            for target in listed['targets']]
        given['spread'] = {name: (low, high) for name, (low, high) in listed['spread'].items()}
        result.append(Row(**given))
    return result
