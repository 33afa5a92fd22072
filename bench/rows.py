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

"""The result of a measurement: our figures, those of peers, and targets."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
import itertools
import statistics

# Statistic -> value; the key of a single figure is VALUE.
Figures = dict[str, float]
VALUE = 'value'
QUANTILES = {'p50': 0.5, 'p95': 0.95, 'p99': 0.99}


@dataclass(frozen=True)
class Target:
    """
    A value that must not exceed a limit.

    :param text: the target in words.
    """

    text: str
    value: float
    limit: float

    @property
    def met(self) -> bool:
        """Whether the value is within the limit."""
        return self.value <= self.limit


@dataclass(frozen=True)
class Row:
    """
    One measurement.

    :param peers: the figures of others, measured in the same run; ratios are to the first.
    :param spread: the least and the greatest ratio of repeated runs.
    """

    what: str
    unit: str
    ours: Figures
    peers: Mapping[str, Figures] = field(default_factory=dict)
    targets: Sequence[Target] = ()
    note: str = ''
    spread: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def ratios(self) -> Figures:
        """Ours divided by the first peer's."""
        for peer in self.peers.values():
            return {name: value / peer[name] for name, value in self.ours.items()
                    if peer.get(name)}
        return {}


def quantile(values: Sequence[float], share: float) -> float:
    """Return the value that this share of the values does not exceed."""
    return sorted(values)[min(int(share * len(values)), len(values) - 1)]


def quantiles(values: Sequence[float]) -> Figures:
    """Return p50, p95 and p99."""
    return {name: quantile(values, share) for name, share in QUANTILES.items()}


def one(value: float) -> Figures:
    """Return a single figure."""
    return {VALUE: value}


def middle(values: Sequence[float]) -> Figures:
    """Return the median as a single figure."""
    return one(statistics.median(values))


def times(ours: Figures, peer: Figures, limit: float, name: str = VALUE,
          whose: str = 'the peer') -> Target:
    """Limit the ratio of a figure to the peer's."""
    ratio = f'1/{1 / limit:g} of' if limit < 1 else f'{limit:g} times'
    label = '' if name == VALUE else f'{name} '
    return Target(f'{label}at most {ratio} {whose}', ours[name] / peer[name], limit)


def at_most(value: float, limit: float, unit: str) -> Target:
    """Limit a figure itself."""
    return Target(f'at most {limit:g} {unit}' if limit else f'0 {unit}', value, limit)


def median_of(runs: Sequence[Sequence[Row]]) -> list[Row]:
    """Return a row for each of repeated runs: medians, judged targets, and ranges of ratios."""
    found: dict[str, list[Row]] = {}
    for row in itertools.chain.from_iterable(runs):
        found.setdefault(row.what, []).append(row)
    return [_median(rows) if len(rows) > 1 else rows[0] for rows in found.values()]


def _median(rows: Sequence[Row]) -> Row:
    def figures(each: Iterable[Figures]) -> Figures:
        listed = list(each)
        return {name: statistics.median(one[name] for one in listed) for name in listed[0]}

    return replace(
        rows[0], ours=figures(row.ours for row in rows),
        peers={name: figures(row.peers[name] for row in rows) for name in rows[0].peers},
        targets=[replace(target, value=statistics.median(row.targets[at].value for row in rows))
                 for at, target in enumerate(rows[0].targets)],
        spread={name: (min(row.ratios[name] for row in rows),
                       max(row.ratios[name] for row in rows)) for name in rows[0].ratios})
