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

"""Rows: figures of the bridge, figures of peers, and targets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
import statistics

# Statistic -> value; a single figure is called VALUE.
Figures = dict[str, float]
VALUE = 'value'
QUANTILES = {'p50': 0.5, 'p95': 0.95, 'p99': 0.99}


@dataclass(frozen=True)
class Target:
    """
    A promise: a value that is not to exceed a limit.

    :param text: the promise in words.
    """

    text: str
    value: float
    limit: float

    @property
    def met(self) -> bool:
        """Whether it is kept."""
        return self.value <= self.limit


@dataclass(frozen=True)
class Row:
    """
    One measurement.

    :param peers: the same of others, measured in the same run; ratios are to the first.
    :param samples: all single values of what may be plotted as a distribution, in ``unit``.
    :param curves: plot -> (x, curve -> y).
    """

    what: str
    unit: str
    ours: Figures
    peers: Mapping[str, Figures] = field(default_factory=dict)
    targets: Sequence[Target] = ()
    note: str = ''
    samples: Mapping[str, list[float]] = field(default_factory=dict)
    curves: Mapping[str, tuple[float, Mapping[str, float]]] = field(default_factory=dict)

    @property
    def ratios(self) -> Figures:
        """Ours divided by the first peer's."""
        for peer in self.peers.values():
            return {name: value / peer[name] for name, value in self.ours.items()
                    if peer.get(name)}
        return {}


def quantile(values: Sequence[float], share: float) -> float:
    """Return the value that this share of them does not exceed."""
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


def times(ours: Figures, peer: Figures, limit: float, name: str = VALUE) -> Target:
    """Promise that a figure is at most so many times the peer's."""
    ratio = f'1/{1 / limit:g} of' if limit < 1 else f'{limit:g} times'
    label = '' if name == VALUE else f'{name} '
    return Target(f'{label}at most {ratio} the peer', ours[name] / peer[name], limit)


def at_most(value: float, limit: float, unit: str) -> Target:
    """Promise that a figure does not exceed a limit."""
    return Target(f'at most {limit:g} {unit}' if limit else f'0 {unit}', value, limit)
