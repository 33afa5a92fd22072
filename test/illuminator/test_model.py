# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The values of a light: reading, checking, comparing and describing them."""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal
import math
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from illuminator_ros.illuminator import model
from illuminator_ros.illuminator.messages import IlluminatorStatus, STATUS_ID
from illuminator_ros.mavlink.dialect import encode
from illuminator_ros.mavlink.errors import InvalidValue
import pytest
from support.fake_light import status_message
from support.messages import decode_payload

NAN, INF = math.nan, math.inf
LIMITS = model.StrobeRange(model.float32(0.05), model.float32(10.0))
BASE = model.Configuration(model.Mode.INTERNAL_CONTROL, 50.0, 1.0, 25.0)
SYNCED = replace(BASE, mode=model.Mode.EXTERNAL_SYNC)
UNKNOWN = replace(BASE, mode=model.Mode.UNKNOWN)
# The numbers of a status: the field of the message, the attribute, the largest and smallest.
NUMBERS = [('brightness', 'brightness', 0.0, 100.0),
           ('strobe_period', 'strobe_period', 0.0, 3600.0),
           ('strobe_duty_cycle', 'strobe_duty_cycle', 0.0, 100.0),
           ('temp_c', 'temperature', -273.15, 1000.0)]


# Values to be sent

@pytest.mark.parametrize(('name', 'value', 'expected'), [
    ('mode', 'internal_control', model.Mode.INTERNAL_CONTROL),
    ('mode', model.Mode.EXTERNAL_SYNC, model.Mode.EXTERNAL_SYNC),
    *((name, value, float(value)) for name, values in (
        ('brightness', (0, 33.3, 100)), ('strobe_duty_cycle', (0.0, 100)),
        ('strobe_period', (0, 0.05, 0.1, 5, 10.0))) for value in values),
])
def test_a_valid_value_is_returned_as_it_is_sent(name: str, value: Any, expected: Any) -> None:
    result = model.checked(name, value, LIMITS)
    assert result == expected
    assert type(result) is type(expected)


@pytest.mark.parametrize(('name', 'value', 'reason'), [
    *((name, value, name) for name in ('brightness', 'strobe_period', 'strobe_duty_cycle')
      for value in (True, '50', None, [50.0] * 100_000, Decimal(50), NAN, INF, -0.001, 1e300)),
    ('brightness', 100.001, r'out of range: 0 to 100 %$'),
    ('strobe_duty_cycle', 100.001, r'out of range: 0 to 100 %$'),
    ('strobe_period', 3600.001, r'out of range: 0 to 3600 s$'),
    *(('strobe_period', value, r'0 \(no strobe\) or 0\.05 to 10 s')
      for value in (0.0499, 10.0001)),
    *(('mode', value, 'not one of internal_control, external_sync') for value in (
        'unknown', 'INTERNAL_CONTROL', '', 1, None, True, ['external_sync'], model.Mode.UNKNOWN)),
])
def test_an_invalid_value_is_refused_with_a_short_reason(
    name: str, value: Any, reason: str,
) -> None:
    with pytest.raises(InvalidValue, match=reason) as caught:
        model.checked(name, value, LIMITS)
    assert len(str(caught.value)) < 200


@given(st.integers(1, 100_000).map(lambda number: number / 1000))
def test_a_period_on_a_limit_is_valid_although_float32_moves_the_limit(limit: float) -> None:
    for limits in (model.StrobeRange(model.float32(limit), 3600.0),
                   model.StrobeRange(0.0, model.float32(limit))):
        assert model.checked('strobe_period', limit, limits) == limit


@pytest.mark.parametrize(('low', 'high', 'known'), [
    (0.05, 10.0, True), (0.0, 10.0, True), (10.0, 10.0, True), (0.0, 3600.0, True),
    (0.0, 0.0, False), (10.0, 0.05, False), (-1.0, 10.0, False), (0.0, 3601.0, False),
    (NAN, 10.0, False), (0.05, NAN, False), (0.05, INF, False), (-INF, INF, False),
])
def test_limits_of_a_light_count_only_where_they_are_possible(
    low: float, high: float, known: bool,
) -> None:
    limits = read(min_strobe_period=low, max_strobe_period=high).strobe_range
    assert limits.known is known
    if not known:
        assert model.checked('strobe_period', 77.0, limits) == 77.0


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_the_shortest_number_is_the_same_float32(value: float) -> None:
    assert model.float32(model.shortest(value)) == value


@pytest.mark.parametrize('value', [60.1, 0.1, 100.0, 0.0, 1e-7, 12345.678, 99.99, 0.123456])
def test_the_shortest_number_is_the_one_that_was_sent(value: float) -> None:
    assert model.shortest(model.float32(value)) == value


def test_the_shortest_number_of_zero_has_no_sign() -> None:
    assert [str(model.shortest(value)) for value in (-0.0, 0.0)] == ['0.0', '0.0']


def test_a_number_too_large_for_a_float_field_is_infinite() -> None:
    assert [model.float32(value) for value in (1e39, -1e39, 0.5)] == [INF, -INF, 0.5]


# Comparison

@pytest.mark.parametrize(('changes', 'by_steps', 'exactly'), [
    ({}, [], []),
    ({'brightness': model.float32(50.000001)}, [], []),
    ({'brightness': 50.4}, [], ['brightness']),
    ({'brightness': 49.6, 'strobe_duty_cycle': 25.4}, [], ['brightness', 'strobe_duty_cycle']),
    ({'strobe_period': 1.009}, [], ['strobe_period']),
    *(({name: value}, [name], [name]) for name, value in (
        ('brightness', 50.6), ('strobe_duty_cycle', 24.4), ('strobe_period', 1.02),
        ('strobe_period', 0.0), ('mode', model.Mode.EXTERNAL_SYNC))),
])
def test_a_difference_counts_beyond_the_steps_of_a_light_or_beyond_float32(
    changes: dict[str, Any], by_steps: list[str], exactly: list[str],
) -> None:
    other = replace(BASE, **changes)
    assert BASE.differences(other) == by_steps
    assert BASE.differences(other, step=False) == exactly


@pytest.mark.parametrize(('confirmed', 'reported', 'flags', 'by_steps', 'exactly'), [
    (BASE, replace(BASE, brightness=25.0), 0, ['brightness'], ['brightness']),
    (BASE, replace(BASE, brightness=25.0), 1, [], []),
    (BASE, replace(BASE, brightness=0.0), 2, [], []),
    (BASE, replace(BASE, brightness=25.0), 4, ['brightness'], ['brightness']),
    (BASE, replace(BASE, brightness=75.0), 1, ['brightness'], ['brightness']),
    (BASE, UNKNOWN, 0, [], []),
    (UNKNOWN, BASE, 0, [], ['mode']),
    (SYNCED, model.Configuration(model.Mode.EXTERNAL_SYNC, 3.0, 0.2, 77.0), 0, [], []),
    (replace(BASE, brightness=80.0), SYNCED, 0, ['mode'], ['mode']),
    (SYNCED, BASE, 0, ['mode'], ['mode']),
], ids=['dimmer', 'throttled', 'shut down', 'thermistor', 'throttled but brighter',
        'mode not reported', 'mode reported later', 'external sync', 'external sync began',
        'external sync ended'])
def test_heat_external_sync_and_an_unknown_mode_explain_differences(
    confirmed: model.Configuration, reported: model.Configuration, flags: int, by_steps: list[str],
    exactly: list[str],
) -> None:
    for step, names in ((True, by_steps), (False, exactly)):
        assert model.unexpected_differences(confirmed, reported, flags, step=step) == names


def test_the_params_of_a_configuration_are_in_the_order_of_the_command() -> None:
    assert SYNCED.params() == (2.0, 50.0, 1.0, 25.0)
    assert UNKNOWN.params() == (1.0, 50.0, 1.0, 25.0)


def test_a_description_has_units_and_can_be_partial() -> None:
    assert BASE.describe() == ('mode internal_control, brightness 50 %, strobe_period 1 s, '
                               'strobe_duty_cycle 25 %')
    assert BASE.describe(['strobe_period']) == 'strobe_period 1 s'


@pytest.mark.parametrize(('flags', 'names'), [
    (0, []), (2, ['over temperature shutdown']), (5, ['thermal throttling', 'thermistor failure']),
    (0x80000001, ['thermal throttling', 'unknown flags 0x80000000'])])
def test_error_flags_have_readable_names(flags: int, names: list[str]) -> None:
    assert model.flag_names(flags) == names


# Reading

def read(**fields: Any) -> model.Status:
    """Return a status as it comes from the wire."""
    message = decode_payload(STATUS_ID, encode(status_message(**fields)))
    assert isinstance(message, IlluminatorStatus)
    return model.Status.from_message(message)


def test_a_plausible_status_is_read_as_sent() -> None:
    status = read(uptime_ms=1234, enable=1, mode_bitmask=2, error_status=5, mode=2,
                  brightness=50.0, strobe_period=0.5, strobe_duty_cycle=25.0, temp_c=-40.5,
                  min_strobe_period=0.25, max_strobe_period=8.0)
    assert status == model.Status(
        uptime_ms=1234, enabled=True, mode=model.Mode.EXTERNAL_SYNC, mode_bitmask=2, error_flags=5,
        brightness=50.0, strobe_period=0.5, strobe_duty_cycle=25.0, temperature=-40.5,
        strobe_range=model.StrobeRange(0.25, 8.0), invalid=())


@pytest.mark.parametrize('value', [NAN, INF, -INF, 3.0e38, -3.0e38])
def test_implausible_numbers_are_none_and_named(value: float) -> None:
    for field, name, _, _ in NUMBERS:
        status = read(**{field: value})
        assert getattr(status, name) is None
        assert [text.split()[0] for text in status.invalid] == [field]
        assert status.complete is (field == 'temp_c')
        if field != 'temp_c':
            assert getattr(status.configuration(BASE), name) == getattr(BASE, name)


def test_numbers_just_within_the_range_are_read() -> None:
    for field, name, low, high in NUMBERS:
        assert getattr(read(**{field: low + 0.01}), name) == pytest.approx(low + 0.01)
        assert getattr(read(**{field: high}), name) == high


def test_enumerators_that_are_not_defined_are_unknown_and_named() -> None:
    assert (read(enable=2).enabled, read(enable=2).invalid) == (None, ('enable 2',))
    assert (read(mode=3).mode, read(mode=3).invalid) == (model.Mode.UNKNOWN, ('mode 3',))
    assert (read(mode=0).mode, read(mode=0).invalid) == (model.Mode.UNKNOWN, ())


def test_a_status_names_all_its_implausible_fields() -> None:
    status = read(enable=9, mode=9, brightness=NAN, strobe_period=-1.0, strobe_duty_cycle=101.0,
                  temp_c=INF)
    assert status.invalid == ('mode 9', 'enable 9', 'brightness nan', 'strobe_period -1',
                              'strobe_duty_cycle 101', 'temp_c inf')
