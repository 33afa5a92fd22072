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

"""Figures of a run as PNGs; the only thing here that needs matplotlib."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
import re
from typing import Any

import matplotlib

matplotlib.use('Agg')

import matplotlib.pyplot as plt  # noqa: E402

from .rows import Row  # noqa: E402

# Plot -> title, label of x and of y, scale of x.
CURVES = {
    'lights': ('CPU of the bridge and number of lights (1 Hz each)', 'lights', '% of a core',
               'log'),
    'foreign UDP': ('CPU and frames of others, UDP', 'frames/s', '% of a core', 'linear'),
    'foreign TCP': ('CPU and frames of others, TCP', 'frames/s', '% of a core', 'linear'),
    'foreign serial': ('CPU and frames of others, serial', 'frames/s', '% of a core', 'linear'),
}


def draw(rows: Iterable[Row], directory: Path) -> list[Path]:
    """Draw what there is something of; return the files."""
    directory.mkdir(parents=True, exist_ok=True)
    listed = list(rows)
    paths = [_distribution(row, directory) for row in listed if row.samples]
    for name, (title, x_label, y_label, scale) in CURVES.items():
        points = sorted((row.curves[name] for row in listed if name in row.curves),
                        key=lambda point: point[0])
        if points:
            figure, axes = _axes(title, x_label, y_label)
            axes.set_xscale(scale)
            for curve in points[0][1]:
                axes.plot([x for x, _ in points], [ys[curve] for _, ys in points], marker='o',
                          label=curve)
            axes.set_ylim(bottom=0.0)
            paths.append(_save(figure, axes, directory, f'cpu {name}'))
    return paths


def _distribution(row: Row, directory: Path) -> Path:
    """Draw for each time the share of samples that took no longer."""
    figure, axes = _axes(row.what, row.unit, 'share that took no longer')
    for name, samples in row.samples.items():
        ordered = sorted(samples)
        axes.step(ordered, [(number + 1) / len(ordered) for number in range(len(ordered))],
                  where='post', label=name)
    # The slowest few of some thousand would press all others together.
    axes.set_xscale('log')
    return _save(figure, axes, directory, row.what)


def _axes(title: str, x_label: str, y_label: str) -> tuple[Any, Any]:
    figure, axes = plt.subplots(figsize=(7.0, 4.2))
    axes.set(title=title, xlabel=x_label, ylabel=y_label)
    axes.grid(alpha=0.3)
    return figure, axes


def _save(figure: Any, axes: Any, directory: Path, name: str) -> Path:
    axes.legend()
    figure.tight_layout()
    path = directory / f'{re.sub("[^a-z0-9]+", "_", name.lower()).strip("_")}.png'
    figure.savefig(path, dpi=120)
    plt.close(figure)
    return path
