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

"""Values as text, bar and line. Pure functions without rich; None is an unknown value."""

from __future__ import annotations

from collections.abc import Sequence
import math

from .model import Diagnosis

UNKNOWN = '-'
BLOCKS = '▁▂▃▄▅▆▇█'
ASCII_BLOCKS = '_.-=+*%#'
# K; a smaller difference is drawn as a flat line.
SMALLEST_SPAN = 4.0
# degC; a greater value is clipped.
HIGHEST = 1e6


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
