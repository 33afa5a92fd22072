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

"""Values for a light: what it may get, and how what it may not get is refused."""

from decimal import Decimal
import struct

from illuminator_ros.illuminator.model import (
    checked,
    float32,
    InvalidValue,
    Limits,
    Mode,
    shortest,
)
import pytest

NAN, INF = float('nan'), float('inf')
LIMITS = Limits(float32(0.05), float32(10.0))


@pytest.mark.parametrize(('name', 'value', 'expected'), [
    ('mode', 'internal_control', Mode.INTERNAL_CONTROL),
    ('mode', 'external_sync', Mode.EXTERNAL_SYNC),
    ('mode', Mode.EXTERNAL_SYNC, Mode.EXTERNAL_SYNC),
    ('brightness', 0, 0.0),
    ('brightness', 100, 100.0),
    ('brightness', 33.3, 33.3),
    ('strobe_duty_cycle', 0.0, 0.0),
    ('strobe_duty_cycle', 100, 100.0),
    ('strobe_period', 0, 0.0),
    ('strobe_period', 3600, 3600.0),
])
def test_a_valid_value_is_returned_as_it_is_sent(name, value, expected):
    result = checked(name, value)
    assert result == expected
    assert type(result) is type(expected)


@pytest.mark.parametrize('name', ['brightness', 'strobe_period', 'strobe_duty_cycle'])
@pytest.mark.parametrize('value', [
    True, False, '50', None, [50.0], b'50', Decimal(50), 1j, NAN, INF, -INF, -0.001, -1, 1e300,
    10 ** 18,
])
def test_a_value_that_is_not_a_possible_number_is_refused(name, value):
    with pytest.raises(InvalidValue, match=name):
        checked(name, value)


@pytest.mark.parametrize(('name', 'value'), [
    ('brightness', 100.001), ('strobe_duty_cycle', 100.001), ('strobe_period', 3600.001),
])
def test_a_value_above_the_range_is_refused_with_the_range(name, value):
    with pytest.raises(InvalidValue, match=r'out of range: 0 to (100 %|3600 s)$'):
        checked(name, value)


@pytest.mark.parametrize('value', [
    'unknown', 'INTERNAL_CONTROL', '', 'x', 1, 2, 1.0, None, True, ['external_sync'],
    Mode.UNKNOWN,
])
def test_no_other_mode_can_be_asked_for(value):
    with pytest.raises(InvalidValue, match='none of internal_control, external_sync'):
        checked('mode', value)


@pytest.mark.parametrize('period', [0.0, 0.05, 0.1, 10.0, 5])
def test_a_period_within_the_reported_limits_is_taken(period):
    assert checked('strobe_period', period, LIMITS) == period


@pytest.mark.parametrize('period', [0.0499, 1e-9, 10.0001])
def test_a_period_outside_the_reported_limits_is_refused_with_the_limits(period):
    with pytest.raises(InvalidValue, match=r'0 \(no strobe\) or 0\.05 to 10 s'):
        checked('strobe_period', period, LIMITS)


@pytest.mark.parametrize(('limit', 'period'), [(0.1, 0.1), (0.05, 0.05), (0.3, 0.3), (0.7, 0.7)])
def test_a_period_on_a_limit_is_taken_although_float32_moves_the_limit(limit, period):
    # float32(0.1) is more than 0.1, float32(0.7) is less: each would refuse its own limit.
    assert checked('strobe_period', period, Limits(float32(limit), 10.0)) == period
    assert checked('strobe_period', period, Limits(0.0, float32(limit))) == period


@pytest.mark.parametrize('limits', [
    None, Limits(0.0, 0.0), Limits(10.0, 0.05), Limits(NAN, NAN), Limits(0.0, INF)])
def test_limits_that_say_nothing_refuse_nothing(limits):
    assert checked('strobe_period', 77.0, limits) == 77.0


@pytest.mark.parametrize('value', [
    60.1, 0.1, 0.05, 33.3, 100.0, 0.0, 1e-7, 12345.678, 99.99, 7.0, 3600.0, 0.123456])
def test_the_shortest_number_is_the_one_that_was_sent(value):
    assert shortest(float32(value)) == value


@pytest.mark.parametrize('bits', [0x3F800001, 0x42C7FFFF, 0x00000001, 0x7F7FFFFF, 0xC2F6E979])
def test_the_shortest_number_is_the_same_float32(bits):
    (value,) = struct.unpack('<f', struct.pack('<I', bits))
    assert float32(shortest(value)) == value


@pytest.mark.parametrize(('value', 'expected'), [(1e39, INF), (-1e39, -INF), (0.5, 0.5)])
def test_a_number_too_large_for_a_float_field_is_infinite(value, expected):
    assert float32(value) == expected


def test_an_error_about_a_huge_value_is_short():
    with pytest.raises(InvalidValue) as caught:
        checked('brightness', [0.5] * 1_000_000)
    assert len(str(caught.value)) < 200
