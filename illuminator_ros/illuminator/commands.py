# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The changes of a light: MAV_CMD_ILLUMINATOR_ON_OFF and MAV_CMD_DO_ILLUMINATOR_CONFIGURE."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from .model import (
    Configuration,
    DIMMING_FLAGS,
    FIELDS,
    flag_names,
    Status,
    unexpected_differences,
)
from ..mavlink.dialect import mavlink
from ..payload.attempt import Change, Sending

CONFIRMED = 'confirmed by ILLUMINATOR_STATUS'


def _despite_heat(status: Status) -> str:
    dimming = status.error_flags & DIMMING_FLAGS
    return f'{CONFIRMED}, but {" and ".join(flag_names(dimming))}' if dimming else CONFIRMED


def _with_flags(shown: str, status: Status) -> str:
    return ', '.join(filter(None, (shown, *flag_names(status.error_flags))))


def _shows_switch(on: bool, status: Status) -> bool | None:
    if not on and status.is_off_by_heat:
        return None
    return status.enabled is on


def _shown_switch(status: Status) -> str:
    shown = {True: 'on', False: 'off', None: 'neither on nor off'}[status.enabled]
    return _with_flags(shown, status)


def _switch_evidence(on: bool, status: Status) -> str:
    if on:
        return _despite_heat(status)
    if status.is_off_by_heat:
        return f'accepted (ILLUMINATOR_STATUS shows {_shown_switch(status)})'
    return CONFIRMED


# Each switches all lights of a component; the command cannot select one of them. Made once, since
# each request needs one before its command is sent.
SWITCHES = {on: Change[Status](
    mavlink.MAV_CMD_ILLUMINATOR_ON_OFF, (float(on),), 'on' if on else 'off',
    sending=Sending.UNTIL_ACKNOWLEDGED if on else Sending.UNTIL_OBEYED,
    shown_by=partial(_shows_switch, on), actual=_shown_switch,
    evidence=partial(_switch_evidence, on)) for on in (False, True)}
ON, OFF = SWITCHES[True], SWITCHES[False]


@dataclass(frozen=True, kw_only=True)
class Configure(Change[Status]):
    """
    Configures a light; the command carries all four fields.

    :param names: the fields that must change.
    """

    configuration: Configuration
    names: list[str]

    @classmethod
    def whole(cls, configuration: Configuration, names: list[str]) -> Configure:
        """Return the change to a configuration: a status shows it only with all its fields."""
        return cls._of(configuration, names, list(FIELDS))

    @classmethod
    def part(cls, configuration: Configuration, names: list[str], note: str = '') -> Configure:
        """Return the change to some fields, which a status shows whatever the others are."""
        return cls._of(configuration, names, names, note)

    @classmethod
    def _of(cls, configuration: Configuration, names: list[str], compared: list[str],
            note: str = '') -> Configure:
        return cls(
            mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE, configuration.params(),
            configuration.describe(names), note=note, configuration=configuration, names=names,
            shown_by=partial(_shows, configuration, names, compared),
            actual=partial(_shown, configuration, compared),
            evidence=partial(_evidence, configuration, names))


def _missing(configuration: Configuration, compared: list[str], status: Status) -> list[str]:
    return [name for name in unexpected_differences(
        configuration, status.configuration(configuration), status.error_flags, step=True)
        if name in compared]


def _hidden(configuration: Configuration, names: list[str], status: Status) -> list[str]:
    """Return those of the fields that must change whose value a status does not show."""
    different = configuration.differences(status.configuration(configuration))
    return [name for name in names if name in different or getattr(status, name) is None]


def _shows(configuration: Configuration, names: list[str], compared: list[str],
           status: Status) -> bool | None:
    if _missing(configuration, compared, status):
        return False
    return None if _hidden(configuration, names, status) else True


def _shown(configuration: Configuration, compared: list[str], status: Status) -> str:
    reported = status.configuration(configuration)
    return _with_flags(reported.describe(_missing(configuration, compared, status)), status)


def _evidence(configuration: Configuration, names: list[str], status: Status) -> str:
    hidden = _hidden(configuration, names, status)
    if not hidden:
        return CONFIRMED
    if status.error_flags & DIMMING_FLAGS:
        return _despite_heat(status)
    reported = status.configuration(configuration)
    shown = (f'no valid {name}' if getattr(status, name) is None
             else reported.describe([name]) for name in hidden)
    return f'accepted (ILLUMINATOR_STATUS shows {", ".join(shown)})'
