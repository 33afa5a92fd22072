# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The result of a measurement: our figures, those of peers, and targets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

# By statistic; the statistic of a single figure is ''.
Figures = Mapping[str, float]


class Target(NamedTuple):
    """
    A value that must not exceed a limit.

    :param text: the target in words.
    """

    text: str
    value: float
    limit: float

    @property
    def is_met(self) -> bool:
        """Whether the value is within the limit."""
        return self.value <= self.limit


@dataclass(frozen=True)
class Row:
    """
    One measurement.

    :param peers: the figures of others, measured in the same run; the ratio is to the first.
    """

    what: str
    unit: str
    ours: Figures
    peers: Mapping[str, Figures] = field(default_factory=dict)
    targets: Sequence[Target] = ()
    note: str = ''

    def __str__(self) -> str:
        """Return a row of a Markdown table: what, ours, peers, ratio, targets."""
        peers = '; '.join(f'{name}: {_text(values)} {self.unit}'
                          for name, values in self.peers.items())
        first: Figures = next(iter(self.peers.values()), {})
        ratios = {name: value / first[name] for name, value in self.ours.items()
                  if first.get(name)}
        targets = '; '.join(f'{one.text}: {"met" if one.is_met else "MISSED"}'
                            for one in self.targets)
        what = f'{self.what} ({self.note})' if self.note else self.what
        return (f'| {what} | {_text(self.ours)} {self.unit} | {peers} | {_text(ratios)} | '
                f'{targets} |')


def _text(figures: Figures) -> str:
    return ' / '.join(f'{value:,.0f}' if abs(value) >= 1000 else f'{value:.3g}'
                      for value in figures.values())


def quantiles(values: Sequence[float], *shares: float) -> Figures:
    """Return some quantiles, p50, p95 and p99 by default; 1 is the greatest value."""
    ordered = sorted(values)
    return {f'p{100 * share:g}': ordered[min(int(share * len(ordered)), len(ordered) - 1)]
            for share in shares or (0.5, 0.95, 0.99)}


def times(ours: Figures, peer: Figures, limit: float, name: str = '', whose: str = '') -> Target:
    """Limit the ratio of a figure to the figure of a peer."""
    ratio = f'1/{1 / limit:g}' if limit < 1 else f'{limit:g} times'
    return Target(f'{name} at most {ratio} {whose}'.strip(), ours[name] / peer[name], limit)


def at_most(value: float, limit: float, unit: str) -> Target:
    """Limit a figure itself."""
    return Target(f'at most {limit:g} {unit}', value, limit)
