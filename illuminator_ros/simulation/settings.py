# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Settings of simulated components, for the command line and the YAML file of the simulator."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any, TypeVar

from ..payload.messages import GeoPoint

# The values of settings by name, untyped: each is what its Setting.read returns.
SettingValues = Mapping[str, Any]
T = TypeVar('T')


@dataclass(frozen=True)
class Setting:
    """
    One setting: ``status_interval`` of the file is the option ``--status-interval``.

    :param read: makes a value from text; raises ValueError, whose message gives the reason. A
        mapping has the fields to replace in a value that is a dataclass.
    :param adds: whether a second value is added to the first, which it otherwise replaces.
    :param distinct: whether several components append their component ids to a common text.
    """

    metavar: str
    help: str  # noqa: A003
    read: Callable[[str], object]
    adds: bool = False
    distinct: bool = False


def setting(
    default: T, metavar: str, help: str, read: Callable[[str], object], *,  # noqa: A002
    adds: bool = False, distinct: bool = False,
) -> T:
    """
    Return a field of properties that is a setting; see :class:`Setting`.

    :param default: its value without the setting; the help shows it if it is a float.
    """
    if isinstance(default, float):
        help = f'{help} (default: {default:g})'  # noqa: A001
    return field(default=default, metadata={
        'setting': Setting(metavar, help, read, adds, distinct)})


def settings_of(properties: type) -> dict[str, Setting]:
    """Return the settings that the fields of properties declare."""
    return {one.name: one.metadata['setting'] for one in fields(properties)
            if 'setting' in one.metadata}


def number(low: float, high: float) -> Callable[[str], float]:
    """Return a reader of numbers within a range."""
    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            raise ValueError(f'{text!r} is not a number') from None
        if not low <= value <= high:
            raise ValueError(f'{text} is outside {low:g} to {high:g}')
        return value
    return read


def integer(low: int, high: int) -> Callable[[str], int]:
    """Return a reader of integers within a range; hexadecimal is ``0x...``."""
    def read(text: str) -> int:
        try:
            value = int(text, 0)
        except ValueError:
            raise ValueError(f'{text!r} is not an integer') from None
        if not low <= value <= high:
            raise ValueError(f'{text} is outside {low} to {high}')
        return value
    return read


def geo_point(text: str) -> GeoPoint:
    """
    Read ``LAT,LON,ALT``: degrees, and m above mean sea level.

    :raises ValueError: if the text has another form.
    """
    parts = text.split(',')
    if len(parts) != 3:
        raise ValueError(f'{text!r} is not LAT,LON,ALT')
    latitude, longitude, altitude = parts
    return GeoPoint(number(-90, 90)(latitude), number(-180, 180)(longitude),
                    number(-1000, 100_000)(altitude))


def text(value: str) -> str:
    """Read a text of at most 200 bytes."""
    if len(value.encode()) > 200:
        raise ValueError(f'{value[:20]!r}... is too long')
    return value


def one_of(names: Iterable[str]) -> Callable[[str], str]:
    """Return a reader of one name of several."""
    def read(text: str) -> str:
        if text not in names:
            raise ValueError(f'{text!r} is not one of {", ".join(names)}')
        return text
    return read
