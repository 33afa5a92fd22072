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

"""ILLUMINATOR_STATUS, read from lights of every quality."""

from illuminator_ros.illuminator.messages import STATUS_ID
from illuminator_ros.illuminator.model import Configuration, Limits, Mode, NOTHING, Status
from illuminator_ros.mavlink.messages import encode_payload
import pytest
from support.fake_light import status_message
from support.messages import decode_payload

NAN, INF = float('nan'), float('inf')


def read(**fields) -> Status:
    """Return a status as it comes from the wire."""
    return Status.from_message(
        decode_payload(STATUS_ID, encode_payload(status_message(**fields))))


def test_a_believable_status_is_read_as_sent():
    status = read(uptime_ms=1234, enable=1, mode_bitmask=2, error_status=5, mode=2,
                  brightness=50.0, strobe_period=0.5, strobe_duty_cycle=25.0, temp_c=-40.5,
                  min_strobe_period=0.25, max_strobe_period=8.0)
    assert status == Status(
        uptime_ms=1234, enabled=True, mode=Mode.EXTERNAL_SYNC, mode_bitmask=2, error_flags=5,
        brightness=50.0, strobe_period=0.5, strobe_duty_cycle=25.0, temperature=-40.5,
        limits=Limits(0.25, 8.0), invalid=())


@pytest.mark.parametrize(('name', 'attribute', 'low', 'high'), [
    ('brightness', 'brightness', 0.0, 100.0),
    ('strobe_period', 'strobe_period', 0.0, 3600.0),
    ('strobe_duty_cycle', 'strobe_duty_cycle', 0.0, 100.0),
    ('temp_c', 'temperature', -273.15, 1000.0),
])
class TestNumbers:

    @pytest.mark.parametrize('value', [NAN, INF, -INF, 3.0e38, -3.0e38])
    def test_a_number_that_cannot_be_is_none_and_named(self, name, attribute, low, high, value):
        status = read(**{name: value})
        assert getattr(status, attribute) is None
        assert [text.split()[0] for text in status.invalid] == [name]

    def test_just_inside_the_range_is_read(self, name, attribute, low, high):
        assert getattr(read(**{name: low + 0.01}), attribute) == pytest.approx(low + 0.01)
        assert getattr(read(**{name: high}), attribute) == high


@pytest.mark.parametrize('enable', [2, 255])
def test_an_enable_that_is_neither_0_nor_1_is_unknown(enable):
    status = read(enable=enable)
    assert status.enabled is None
    assert status.invalid == (f'enable {enable}',)


@pytest.mark.parametrize('mode', [3, 255])
def test_a_mode_that_is_none_of_the_enum_is_unknown_and_named(mode):
    status = read(mode=mode)
    assert status.mode is Mode.UNKNOWN
    assert status.invalid == (f'mode {mode}',)


def test_mode_0_is_unknown_and_nothing_wrong():
    status = read(mode=0)
    assert (status.mode, status.invalid) == (Mode.UNKNOWN, ())


def test_everything_wrong_is_named_at_once():
    status = read(enable=9, mode=9, brightness=NAN, strobe_period=-1.0, strobe_duty_cycle=101.0,
                  temp_c=INF)
    assert status.invalid == ('mode 9', 'enable 9', 'brightness nan', 'strobe_period -1',
                              'strobe_duty_cycle 101', 'temp_c inf')


def test_the_configuration_is_the_shortest_numbers_that_were_meant():
    configuration = read(brightness=60.1, strobe_period=0.1, strobe_duty_cycle=33.3
                         ).configuration(NOTHING)
    assert (configuration.brightness, configuration.strobe_period,
            configuration.strobe_duty_cycle) == (60.1, 0.1, 33.3)


@pytest.mark.parametrize('name', ['brightness', 'strobe_period', 'strobe_duty_cycle'])
def test_the_confirmed_value_replaces_an_implausible_one(name):
    agreed = Configuration(Mode.INTERNAL_CONTROL, 41.0, 0.5, 42.0)
    status = read(**{name: NAN})
    assert not status.complete
    assert getattr(status.configuration(agreed), name) == getattr(agreed, name)


@pytest.mark.parametrize(('low', 'high', 'known'), [
    (0.05, 10.0, True),
    (0.0, 10.0, True),
    (10.0, 10.0, True),
    (0.0, 3600.0, True),
    (0.0, 0.0, False),       # ArduSub: not supported
    (10.0, 0.05, False),
    (-1.0, 10.0, False),
    (0.0, 3601.0, False),
    (NAN, 10.0, False),
    (0.05, NAN, False),
    (0.05, INF, False),
    (-INF, INF, False),
])
def test_limits_count_only_where_they_make_sense(low, high, known):
    assert read(min_strobe_period=low, max_strobe_period=high).limits.known is known
