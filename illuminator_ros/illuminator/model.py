# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
The values of an illuminator: status, configuration and limits, their ranges and comparison.

https://mavlink.io/en/services/illuminator.html
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property, lru_cache
import math
import reprlib
import struct
from typing import Any

from .messages import IlluminatorStatus
from ..mavlink import dialect
from ..mavlink.dialect import mavlink
from ..mavlink.errors import InvalidValue

# Values of configuration fields by name, untyped: the mode is a Mode, the others are numbers.
Changes = Mapping[str, Any]

ABSOLUTE_ZERO_C = -273.15
MAX_TEMPERATURE_C = 1000.0
# Longest plausible strobe period, s; larger reports are invalid.
MAX_STROBE_PERIOD = 3600.0
# A light may round values to its own steps; differences within these are not changes. % for
# brightness and duty cycle; relative for the strobe period.
PERCENT_STEP = 0.5
PERIOD_STEP = 0.01
FLOAT32_STEP = 1e-6
# s; a shorter period is a 0 with a rounding error.
SHORTEST_PERIOD = 1e-6


# The flags under which a light is less bright than it was set.
DIMMING_FLAGS = (mavlink.ILLUMINATOR_ERROR_FLAGS_THERMAL_THROTTLING
                 | mavlink.ILLUMINATOR_ERROR_FLAGS_OVER_TEMPERATURE_SHUTDOWN)
KNOWN_FLAGS = DIMMING_FLAGS | mavlink.ILLUMINATOR_ERROR_FLAGS_THERMISTOR_FAILURE


def flag_names(flags: int) -> list[str]:
    """Return readable names of error flags; unknown bits as one hexadecimal number."""
    return dialect.flag_names('ILLUMINATOR_ERROR_FLAGS', flags)


class Mode(IntEnum):
    """ILLUMINATOR_MODE."""

    UNKNOWN = mavlink.ILLUMINATOR_MODE_UNKNOWN
    INTERNAL_CONTROL = mavlink.ILLUMINATOR_MODE_INTERNAL_CONTROL
    EXTERNAL_SYNC = mavlink.ILLUMINATOR_MODE_EXTERNAL_SYNC

    @cached_property
    def label(self) -> str:
        """Return the name that the ROS interface uses."""
        return self.name.lower()


# The modes that can be commanded; UNKNOWN can only be reported.
MODES = {mode.label: mode for mode in Mode if mode is not Mode.UNKNOWN}
_MODES = {int(mode): mode for mode in Mode}
_ENABLED = {0: False, 1: True}


def float32(value: float) -> float:
    """Return a number as a float field holds it; infinity if it does not fit."""
    try:
        return float(struct.unpack('<f', struct.pack('<f', value))[0])
    except OverflowError:
        return math.copysign(math.inf, value)


# Cached, since a light reports the same numbers repeatedly.
@lru_cache(maxsize=256)
def shortest(value: float) -> float:
    """Return the shortest decimal number that is this float32: 60.1 for 60.099998474."""
    for digits in range(1, 9):
        short = float(f'{value:.{digits}g}')
        if float32(short) == value:
            # Equal arguments have one entry in the cache, so -0.0 becomes 0.0.
            return short + 0.0
    return value


@dataclass(frozen=True, slots=True)
class StrobeRange:
    """
    The strobe periods that a light reports to be possible, s.

    They are as sent and may be invalid, see :attr:`known`. Both are 0 where the light does not
    know them, as in ArduSub.
    """

    min_strobe_period: float = 0.0
    max_strobe_period: float = 0.0

    @property
    def known(self) -> bool:
        """Whether the light reports a valid range."""
        low, high = self.min_strobe_period, self.max_strobe_period
        return 0 <= low <= high <= MAX_STROBE_PERIOD and high > 0

    def nearest(self, period: float) -> float:
        """Return the possible period, s, that is nearest to another one; 0 remains 0."""
        if not (period and self.known):
            return period
        return min(max(period, shortest(self.min_strobe_period)), shortest(self.max_strobe_period))


@dataclass(frozen=True, slots=True)
class Configuration:
    """
    The fields of MAV_CMD_DO_ILLUMINATOR_CONFIGURE.

    :param brightness: %, 0..100.
    :param strobe_period: s, 0..:data:`MAX_STROBE_PERIOD`; 0 means no strobe.
    :param strobe_duty_cycle: %, 0..100.
    """

    mode: Mode
    brightness: float
    strobe_period: float
    strobe_duty_cycle: float

    def params(self) -> tuple[float, float, float, float]:
        """
        Return param1 to param4 of the command.

        An unknown mode is sent as internal control: the other parameters take effect only in that
        mode, and 0 would be denied.
        """
        mode = self.mode or Mode.INTERNAL_CONTROL
        return float(mode), self.brightness, self.strobe_period, self.strobe_duty_cycle

    def differences(self, other: Configuration, *, step: bool = True) -> list[str]:
        """
        Return the names of the fields in which two configurations differ.

        :param step: whether a light's own rounding is ignored; float32 rounding always is.
        """
        percent = FLOAT32_STEP, PERCENT_STEP if step else 0.0
        period = PERIOD_STEP if step else FLOAT32_STEP, SHORTEST_PERIOD
        steps = {'brightness': percent, 'strobe_period': period, 'strobe_duty_cycle': percent}
        return [*([] if self.mode == other.mode else ['mode']),
                *(name for name, (relative, absolute) in steps.items() if not math.isclose(
                    getattr(self, name), getattr(other, name), rel_tol=relative,
                    abs_tol=absolute))]

    def describe(self, names: list[str] | None = None) -> str:
        """Return some or all of the fields for people, with units."""
        return ', '.join(
            f'mode {self.mode.label}' if name == 'mode'
            else f'{name} {getattr(self, name):g} {_NUMBERS[name][0]}'
            for name in names or FIELDS)


FIELDS = ('mode', 'brightness', 'strobe_period', 'strobe_duty_cycle')
# Unit and upper limit of the fields that are numbers.
_NUMBERS = {'brightness': ('%', 100.0), 'strobe_period': ('s', MAX_STROBE_PERIOD),
            'strobe_duty_cycle': ('%', 100.0)}
# The plausible values of the numbers of ILLUMINATOR_STATUS, in the order of :class:`Status`.
_RANGES = {**{name: (0.0, upper) for name, (_, upper) in _NUMBERS.items()},
           'temp_c': (ABSOLUTE_ZERO_C, MAX_TEMPERATURE_C)}


def checked(name: str, value: object, strobe_range: StrobeRange | None = None) -> Mode | float:
    """
    Return the value of a configuration field, ready to be sent.

    :param name: one of :data:`FIELDS`.
    :param value: a number, or for the mode one of :data:`MODES`.
    :param strobe_range: that the light reports, None where no light is known.
    :raises InvalidValue: if the light must not get it.
    """
    if name == 'mode':
        if isinstance(value, Mode) and value in MODES.values():
            return value
        if not isinstance(value, str) or value not in MODES:
            raise InvalidValue(f'mode {reprlib.repr(value)} is not one of {", ".join(MODES)}')
        return MODES[value]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InvalidValue(f'{name} {reprlib.repr(value)} is not a number')
    unit, upper = _NUMBERS[name]
    if not math.isfinite(value):
        raise InvalidValue(f'{name} {value} is not a finite number')
    if not 0 <= value <= upper:
        raise InvalidValue(f'{name} {value:g} {unit} is out of range: 0 to {upper:g} {unit}')
    if name == 'strobe_period':
        _check_period(float(value), strobe_range)
    return float(value)


def _check_period(period: float, strobe_range: StrobeRange | None) -> None:
    """Compare as float32, as the light does: the float32 of 0.1 is above 0.1."""
    sent = float32(period)
    if period and strobe_range and strobe_range.known and not (
            strobe_range.min_strobe_period <= sent <= strobe_range.max_strobe_period):
        raise InvalidValue(
            f'strobe_period {period:g} s is outside the range that the light reports: 0 (no '
            f'strobe) or {shortest(strobe_range.min_strobe_period):g} to '
            f'{shortest(strobe_range.max_strobe_period):g} s')


@dataclass(frozen=True, slots=True)
class SafetyLimits:
    """
    Limits that the operator sets for the people around a light.

    :param max_brightness: %, 0..100.
    :param min_strobe_period: s, 0..:data:`MAX_STROBE_PERIOD`; 0 for no limit.
    """

    max_brightness: float = 100.0
    min_strobe_period: float = 0.0

    def check(self, name: str, value: float) -> None:
        """
        Check the value of a field that :func:`checked` has returned.

        :raises InvalidValue: if it is beyond a limit.
        """
        if excess := self._excess(name, value):
            raise InvalidValue(excess)

    def excess_of(self, values: Changes) -> str:
        """Describe how values that :func:`checked` has returned exceed the limits, '' if not."""
        return ', '.join(filter(None, (self._excess(*one) for one in values.items())))

    def clip(self, values: Changes) -> dict[str, Any]:
        """Return the values within the limits that are nearest to others."""
        nearest = {'brightness': self.max_brightness, 'strobe_period': self.min_strobe_period}
        return {name: nearest[name] if self._excess(name, value) else value
                for name, value in values.items()}

    def _excess(self, name: str, value: float) -> str:
        if name == 'brightness' and value > self.max_brightness:
            return f'brightness {value:g} % is above max_brightness {self.max_brightness:g} %'
        if name == 'strobe_period' and 0 < float32(value) < float32(self.min_strobe_period):
            return (f'strobe_period {value:g} s is below min_strobe_period '
                    f'{self.min_strobe_period:g} s')
        return ''

    def clipped(self, configuration: Configuration, strobe_range: StrobeRange) -> Configuration:
        """
        Return the configuration within the limits that is nearest to another one.

        :param strobe_range: of the light; where it excludes the limit the light does not strobe.
        """
        brightness = min(configuration.brightness, self.max_brightness)
        period = configuration.strobe_period
        if self._excess('strobe_period', period):
            period = 0.0 if self.impossible(strobe_range) else self.min_strobe_period
        return replace(configuration, brightness=brightness, strobe_period=period)

    def excess(self, configuration: Configuration) -> tuple[str, ...]:
        """Describe how a configuration exceeds the limits by more than a light's own steps."""
        return tuple(self._excess(name, getattr(configuration, name)) for name
                     in configuration.differences(self.clipped(configuration, StrobeRange())))

    def impossible(self, strobe_range: StrobeRange) -> str:
        """Describe why a light cannot strobe within the limits, '' if it can."""
        longest = strobe_range.max_strobe_period
        if not strobe_range.known or float32(self.min_strobe_period) <= longest:
            return ''
        return (f'min_strobe_period {self.min_strobe_period:g} s is above the '
                f'longest period of the light, {shortest(longest):g} s')


@dataclass(slots=True, unsafe_hash=True)
class Status:
    """
    An ILLUMINATOR_STATUS. A field that is not plausible is None and named in ``invalid``.

    :param uptime_ms: ms since the light started, wrapping at 2**32.
    :param mode_bitmask: as sent; its meaning differs between lights.
    :param error_flags: as sent: ILLUMINATOR_ERROR_FLAGS.
    :param brightness: %, 0..100.
    :param strobe_period: s, 0..:data:`MAX_STROBE_PERIOD`.
    :param strobe_duty_cycle: %, 0..100.
    :param temperature: degC, as sent: 0 may mean "not measured".
    :param gimbal_device_id: of the gimbal that it is on, 0 if it reports none.
    """

    uptime_ms: int
    enabled: bool | None
    mode: Mode
    mode_bitmask: int
    error_flags: int
    brightness: float | None
    strobe_period: float | None
    strobe_duty_cycle: float | None
    temperature: float | None
    strobe_range: StrobeRange
    invalid: tuple[str, ...] = ()
    gimbal_device_id: int = 0

    @classmethod
    def from_message(cls, message: IlluminatorStatus) -> Status:
        """Read a message. Any content is accepted: an invalid field is marked, not raised."""
        enabled, mode = _ENABLED.get(message.enable), _MODES.get(message.mode)
        invalid = []
        if mode is None:
            invalid.append(f'mode {message.mode}')
        if enabled is None:
            invalid.append(f'enable {message.enable}')
        numbers: list[float | None] = []
        for name, (low, high) in _RANGES.items():
            number: float = getattr(message, name)
            # A comparison with NaN is false.
            is_plausible = low <= number <= high
            numbers.append(number if is_plausible else None)
            if not is_plausible:
                invalid.append(f'{name} {number:g}')
        brightness, strobe_period, strobe_duty_cycle, temperature = numbers
        return cls(
            uptime_ms=message.uptime_ms, enabled=enabled, mode=mode or Mode.UNKNOWN,
            mode_bitmask=message.mode_bitmask, error_flags=message.error_status,
            brightness=brightness, strobe_period=strobe_period,
            strobe_duty_cycle=strobe_duty_cycle, temperature=temperature,
            strobe_range=StrobeRange(message.min_strobe_period, message.max_strobe_period),
            invalid=tuple(invalid), gimbal_device_id=message.gimbal_device_id)

    def repeats(self, other: Status | None) -> bool:
        """Return whether it is equal to another one in all but its uptime."""
        return other is not None and self == replace(other, uptime_ms=self.uptime_ms)

    @property
    def is_dimmed(self) -> bool:
        """Whether heat makes the light less bright than it was set, or has switched it off."""
        return bool(self.error_flags & DIMMING_FLAGS)

    @property
    def is_off_by_heat(self) -> bool:
        """Whether heat keeps the light off, so that it may light up once it has cooled down."""
        return self.enabled is False and bool(
            self.error_flags & mavlink.ILLUMINATOR_ERROR_FLAGS_OVER_TEMPERATURE_SHUTDOWN)

    @property
    def is_dark(self) -> bool:
        """Whether it is off with a brightness of 0, so that a brightness may switch it on."""
        return self.enabled is False and self.brightness == 0.0

    @property
    def complete(self) -> bool:
        """Whether each number of the configuration is plausible."""
        return None not in (self.brightness, self.strobe_period, self.strobe_duty_cycle)

    def configuration(self, otherwise: Configuration) -> Configuration:
        """
        Return the configuration that the light reports.

        :param otherwise: its values replace values that are not plausible.
        """
        brightness, duty = self.brightness, self.strobe_duty_cycle
        period = self.strobe_period
        if period is not None and period < SHORTEST_PERIOD:
            period = 0.0
        return Configuration(
            self.mode,
            otherwise.brightness if brightness is None else shortest(brightness),
            otherwise.strobe_period if period is None else shortest(period),
            otherwise.strobe_duty_cycle if duty is None else shortest(duty))

    def shows_the_state_of(self, other: Status) -> bool:
        """Return whether a light may send both without having been changed."""
        return self.enabled == other.enabled and not unexpected_differences(
            self.configuration(NOTHING), other.configuration(NOTHING), 0, step=True)


NOTHING = Configuration(Mode.UNKNOWN, 0.0, 0.0, 0.0)


def unexpected_differences(
    confirmed: Configuration, reported: Configuration, flags: int, *, step: bool,
) -> list[str]:
    """
    Return the fields in which a light differs from its confirmed configuration without reason.

    There are two good reasons: it dims itself because it is hot, and under external sync its
    output follows another signal.

    :param step: whether the light's own rounding is ignored.
    """
    names = confirmed.differences(reported, step=step)
    # A status without a mode does not contradict.
    if reported.mode is Mode.UNKNOWN or step and confirmed.mode is Mode.UNKNOWN:
        names = [name for name in names if name != 'mode']
    if flags & DIMMING_FLAGS and reported.brightness < confirmed.brightness:
        names = [name for name in names if name != 'brightness']
    if reported.mode is Mode.EXTERNAL_SYNC:
        names = [name for name in names if name == 'mode']
    return names
