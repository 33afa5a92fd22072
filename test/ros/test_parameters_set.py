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

"""A parameter set succeeds only if the light has taken it (DESIGN.md, 3.1)."""

import math
from typing import Any

import pytest
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from support.light import CONFIGURE, params, ServedLight
from support.ros import Parameters

START = {'mode': 'internal_control', 'brightness': 80.0, 'strobe_period': 0.0,
         'strobe_duty_cycle': 0.0}
FOUR = {'mode': 'external_sync', 'brightness': 40.0, 'strobe_period': 0.5,
        'strobe_duty_cycle': 25.0}


@pytest.fixture(autouse=True)
def start(light: ServedLight, parameters: Parameters) -> None:
    """Have every test begin with the same configuration."""
    light.report(mode=1, brightness=80.0, strobe_period=0.0, strobe_duty_cycle=0.0)
    parameters.wait(**START)


class TestSuccess:
    @pytest.mark.parametrize(('name', 'value', 'sent'), [
        ('mode', 'external_sync', (2.0, 80.0, 0.0, 0.0)),
        ('brightness', 60.5, (1.0, 60.5, 0.0, 0.0)),
        ('strobe_period', 2.0, (1.0, 80.0, 2.0, 0.0)),
        ('strobe_duty_cycle', 50.0, (1.0, 80.0, 0.0, 50.0)),
    ])
    def test_one_is_sent_with_the_others_as_they_are(
        self, light: ServedLight, parameters: Parameters, name: str, value: object,
        sent: tuple[float, ...],
    ) -> None:
        [result] = parameters.set(**{name: value})

        assert result.successful
        assert [params(command) for command in light.commands(CONFIGURE)] == [sent]
        assert parameters.get(name) == [value]

    def test_an_integer_is_taken_for_a_double(
        self, light: ServedLight, parameters: Parameters,
    ) -> None:
        [result] = parameters.set(brightness=60)

        assert result.successful
        [value] = parameters.get('brightness')
        assert (value, type(value)) == (60.0, float)

    def test_four_in_one_call_are_one_command(
        self, light: ServedLight, parameters: Parameters,
    ) -> None:
        results = parameters.set(**FOUR)

        assert [result.successful for result in results] == [True] * 4
        assert [params(c) for c in light.commands(CONFIGURE)] == [(2.0, 40.0, 0.5, 25.0)]
        assert parameters.get(*FOUR) == list(FOUR.values())

    def test_four_atomically_are_one_command(
        self, light: ServedLight, parameters: Parameters,
    ) -> None:
        assert parameters.set_atomically(**FOUR).successful

        assert [params(c) for c in light.commands(CONFIGURE)] == [(2.0, 40.0, 0.5, 25.0)]
        assert parameters.get(*FOUR) == list(FOUR.values())

    def test_two_callers_at_once_both_have_their_way(
        self, light: ServedLight, parameters: Parameters,
    ) -> None:
        calls = [parameters.start_set(brightness=30.0), parameters.start_set(strobe_period=3.0)]

        assert all(call.result().results[0].successful for call in calls)
        assert parameters.get('brightness', 'strobe_period') == [30.0, 3.0]
        assert params(light.commands(CONFIGURE)[-1]) == (1.0, 30.0, 3.0, 0.0)

    def test_the_event_has_all_that_one_call_has_changed(
        self, light: ServedLight, parameters: Parameters,
    ) -> None:
        events = parameters.events()

        parameters.set(**FOUR)

        event = events.wait()
        assert {p.name for p in event.changed_parameters} == set(FOUR)
        assert len(events.messages) == 1


class TestRefusedHere:
    WRONG = [
        ('brightness', 101.0, 'brightness 101 % is out of range: 0 to 100 %'),
        ('brightness', -0.5, 'brightness -0.5 % is out of range: 0 to 100 %'),
        ('brightness', 101, 'brightness 101 % is out of range: 0 to 100 %'),
        ('brightness', math.nan, 'brightness nan is not a finite number'),
        ('brightness', math.inf, 'brightness inf is not a finite number'),
        ('brightness', 'bright', "brightness 'bright' is not a number"),
        ('brightness', True, 'brightness True is not a number'),
        ('brightness', [1.0], 'brightness [1.0] is not a number'),
        ('strobe_duty_cycle', 100.5, 'strobe_duty_cycle 100.5 % is out of range'),
        ('strobe_period', 0.01, 'strobe_period 0.01 s is outside what the light reports: 0 (no '
                                'strobe) or 0.05 to 10 s'),
        ('strobe_period', 20.0, 'strobe_period 20 s is outside what the light reports'),
        ('mode', 'unknown', "mode 'unknown' is none of internal_control, external_sync"),
        ('mode', 1, 'mode 1 is none of internal_control, external_sync'),
        ('banana', 1.0, 'banana is no parameter of this node'),
    ]

    @pytest.mark.parametrize(('name', 'value', 'reason'), WRONG)
    def test_what_is_wrong_is_not_sent_and_keeps_its_value(
        self, light: ServedLight, parameters: Parameters, name: str, value: object, reason: str,
    ) -> None:
        [result] = parameters.set(**{name: value})

        assert not result.successful
        assert reason in result.reason
        assert light.commands(CONFIGURE) == []
        assert parameters.get(*START) == list(START.values())

    @pytest.mark.parametrize(('name', 'value', 'reason'), WRONG)
    def test_one_wrong_value_ends_an_atomic_set(
        self, light: ServedLight, parameters: Parameters, name: str, value: object, reason: str,
    ) -> None:
        result = parameters.set_atomically(**{'strobe_period': 1.0, name: value})

        assert not result.successful
        assert reason in result.reason
        assert light.commands(CONFIGURE) == []
        assert parameters.get(*START) == list(START.values())

    def test_one_wrong_value_leaves_the_others_of_a_list_alone(
        self, light: ServedLight, parameters: Parameters,
    ) -> None:
        results = parameters.set(brightness=200.0, strobe_period=1.0)

        assert [result.successful for result in results] == [False, True]
        assert [params(c) for c in light.commands(CONFIGURE)] == [(1.0, 80.0, 1.0, 0.0)]

    def test_a_parameter_of_the_light_cannot_be_deleted(self, parameters: Parameters) -> None:
        [result] = parameters.set(brightness=None)

        assert (result.successful, result.reason) == (False, 'brightness cannot be deleted')

    def test_a_read_only_one_ends_an_atomic_set_before_anything_is_sent(
        self, light: ServedLight, parameters: Parameters,
    ) -> None:
        result = parameters.set_atomically(brightness=30.0, frame_id='other')

        assert not result.successful
        assert light.commands(CONFIGURE) == []
        assert parameters.get('brightness', 'frame_id') == [80.0, 'illuminator']


class TestMalformedRequests:
    """Requests that no rclpy client can make, but others can."""

    @pytest.fixture
    def malformed(self) -> Parameter:
        return Parameter(name='brightness', value=ParameterValue(type=77, double_value=5.0))

    def test_an_unknown_type_is_refused_and_the_rest_is_set(
        self, parameters: Parameters, malformed: Parameter,
    ) -> None:
        good = Parameter(name='strobe_period', value=ParameterValue(
            type=ParameterType.PARAMETER_DOUBLE, double_value=1.0))

        response: Any = parameters.start(
            SetParameters, 'set_parameters', parameters=[malformed, good]).result()

        assert [result.successful for result in response.results] == [False, True]
        assert response.results[0].reason == 'brightness: 77 is no parameter type'
        assert parameters.get('brightness', 'strobe_period') == [80.0, 1.0]

    def test_an_unknown_type_ends_an_atomic_set(
        self, light: ServedLight, parameters: Parameters, malformed: Parameter,
    ) -> None:
        response: Any = parameters.start(
            SetParametersAtomically, 'set_parameters_atomically', parameters=[malformed],
        ).result()

        assert not response.result.successful
        assert response.result.reason == 'brightness: 77 is no parameter type'
        assert light.commands(CONFIGURE) == []

    def test_an_empty_list_is_answered(self, parameters: Parameters) -> None:
        assert parameters.set() == []
        assert parameters.set_atomically().successful

    def test_the_same_name_twice_ends_with_the_last(
        self, light: ServedLight, parameters: Parameters,
    ) -> None:
        twice = [Parameter(name='brightness', value=ParameterValue(
            type=ParameterType.PARAMETER_DOUBLE, double_value=value)) for value in (10.0, 20.0)]

        response: Any = parameters.start(
            SetParameters, 'set_parameters', parameters=twice).result()

        assert [result.successful for result in response.results] == [True, True]
        assert parameters.get('brightness') == [20.0]
        assert light.fake.fields['brightness'] == 20.0
