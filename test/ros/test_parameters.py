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

"""The parameters as tools see them: values, types, descriptors (DESIGN.md, 2 and 3.2)."""

from collections.abc import Iterator
from typing import Any

import pytest
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import DescribeParameters, GetParameters, GetParameterTypes
from rclpy.parameter import Parameter
from support.embedded import resting_bridge
from support.light import ServedLight
from support.ros import Parameters, Ros, running_bridge

DEVICE = ('mode', 'brightness', 'strobe_period', 'strobe_duty_cycle')
DOUBLE, STRING, INTEGER, BOOL, NOT_SET = (
    ParameterType.PARAMETER_DOUBLE, ParameterType.PARAMETER_STRING,
    ParameterType.PARAMETER_INTEGER, ParameterType.PARAMETER_BOOL,
    ParameterType.PARAMETER_NOT_SET)
LINK = {
    'connection_url': STRING, 'system_id': INTEGER, 'component_id': INTEGER,
    'target_system': INTEGER, 'target_component': INTEGER, 'heartbeat_timeout': DOUBLE,
    'command_timeout': DOUBLE, 'command_retries': INTEGER, 'status_interval': DOUBLE,
    'frame_id': STRING, 'beam_range': DOUBLE, 'beam_angle': DOUBLE,
    'diagnostics_period': DOUBLE, 'off_on_shutdown': BOOL,
    'restore_configuration': BOOL, 'signing_mode': STRING, 'signing_key_file': STRING,
    'names': ParameterType.PARAMETER_STRING_ARRAY,
}


class TestBeforeTheFirstStatus:

    @pytest.fixture(scope='class')
    def alone(self, ros: Ros) -> Iterator[Parameters]:
        """Return the parameters of a bridge that has not heard a light."""
        with running_bridge(ros.domain, 0, '-r', '__node:=alone',
                            connection_url='memory://nobody'):
            yield Parameters(ros, '/alone')

    def test_the_light_s_parameters_are_not_set(self, alone: Parameters) -> None:
        assert alone.get(*DEVICE) == [None] * 4
        assert alone.types(*DEVICE) == [NOT_SET] * 4

    def test_they_are_listed_and_described_all_the_same(self, alone: Parameters) -> None:
        assert set(DEVICE) <= set(alone.names())
        assert [d.type for d in alone.describe(*DEVICE)] == [STRING, DOUBLE, DOUBLE, DOUBLE]

    def test_the_link_s_parameters_have_their_values(self, alone: Parameters) -> None:
        assert alone.get('connection_url', 'component_id') == ['memory://nobody', 194]

    def test_what_is_set_is_told_beside_what_is_not(self, alone: Parameters) -> None:
        assert alone.get('brightness', 'frame_id') == [None, 'illuminator']


class TestValues:
    def test_they_are_what_the_light_reports(
        self, light: ServedLight, parameters: Parameters,
    ) -> None:
        light.report(mode=2, brightness=70.0, strobe_period=1.5, strobe_duty_cycle=30.0)

        parameters.wait(mode='external_sync', brightness=70.0, strobe_period=1.5,
                        strobe_duty_cycle=30.0)

    def test_they_have_the_types_that_they_are_described_with(
        self, parameters: Parameters,
    ) -> None:
        assert parameters.types(*DEVICE) == [STRING, DOUBLE, DOUBLE, DOUBLE]

    @pytest.mark.parametrize(('service', 'type_', 'field'), [
        ('get_parameters', GetParameters, 'values'),
        ('get_parameter_types', GetParameterTypes, 'types'),
        ('describe_parameters', DescribeParameters, 'descriptors'),
    ])
    def test_an_unknown_name_gets_an_empty_answer(
        self, parameters: Parameters, service: str, type_: Any, field: str,
    ) -> None:
        response = parameters.start(type_, service, names=['frame_id', 'banana']).result()

        assert list(getattr(response, field)) == []


class TestDescriptors:
    @pytest.mark.parametrize(('name', 'unit', 'high'), [
        ('brightness', '[%]', 100.0), ('strobe_duty_cycle', '[%]', 100.0),
        ('strobe_period', '[s]', 10.0),
    ])
    def test_numbers_have_a_unit_and_a_range(
        self, light: ServedLight, parameters: Parameters, name: str, unit: str, high: float,
    ) -> None:
        [descriptor] = parameters.describe(name)

        assert unit in descriptor.description
        [range_] = descriptor.floating_point_range
        assert (range_.from_value, range_.to_value, range_.step) == (0.0, high, 0.0)
        assert not descriptor.read_only

    def test_the_mode_names_its_choices(self, parameters: Parameters) -> None:
        [descriptor] = parameters.describe('mode')

        assert descriptor.additional_constraints == 'one of: internal_control, external_sync'

    def test_the_gap_above_zero_in_the_strobe_period_is_told(
        self, parameters: Parameters,
    ) -> None:
        [descriptor] = parameters.describe('strobe_period')

        assert '0 = no strobe' in descriptor.additional_constraints

    @pytest.mark.parametrize(('limits', 'high'), [
        ((0.1, 3.0), 3.0), ((0.1, 0.7), 0.7), ((0.0, 0.0), 3600.0), ((5.0, 1.0), 3600.0),
        ((0.05, 10.0), 10.0),
    ])
    def test_the_strobe_range_follows_what_the_light_reports(
        self, light: ServedLight, parameters: Parameters, limits: tuple[float, float],
        high: float,
    ) -> None:
        light.report(strobe_period=0.0)
        parameters.wait(strobe_period=0.0)

        light.fake.fields |= {'min_strobe_period': limits[0], 'max_strobe_period': limits[1]}

        parameters.wait_range('strobe_period', high)

    def test_a_period_beyond_the_light_s_own_limit_is_shown(
        self, light: ServedLight, parameters: Parameters,
    ) -> None:
        light.report(strobe_period=12.0, min_strobe_period=0.05, max_strobe_period=10.0)

        parameters.wait(strobe_period=12.0)
        light.report(strobe_period=0.0)
        parameters.wait(strobe_period=0.0)


class TestLinkParameters:

    def test_all_of_them_are_there_with_their_types(self, parameters: Parameters) -> None:
        assert dict(zip(LINK, parameters.types(*LINK), strict=True)) == LINK

    @pytest.mark.parametrize('name', LINK)
    def test_they_are_described_and_read_only(self, parameters: Parameters, name: str) -> None:
        [descriptor] = parameters.describe(name)

        assert descriptor.read_only
        assert descriptor.description

    @pytest.mark.parametrize(('name', 'value'), [
        ('connection_url', 'udpin://127.0.0.1:1'), ('frame_id', 'other'), ('system_id', 7),
        ('off_on_shutdown', True),
    ])
    def test_setting_one_is_refused_and_changes_nothing(
        self, parameters: Parameters, name: str, value: object,
    ) -> None:
        before = parameters.get(name)

        [result] = parameters.set(**{name: value})

        assert not result.successful
        assert 'read-only' in result.reason
        assert parameters.get(name) == before


def test_what_runs_in_the_same_process_cannot_set_what_the_light_has_not_accepted(
    domain: int,
) -> None:
    with resting_bridge(domain, lambda: 0.0) as process:
        [result] = process.node.set_parameters([Parameter('brightness', value=30.0)])

        assert not result.successful
        assert result.reason == 'brightness: only the parameter services reach the light'
