# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A parameter set succeeds only if the light has taken it, and it is answered in time."""

from typing import Any

from illuminator_ros.mavlink.dialect import mavlink
import pytest
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from support.light import CONFIGURE, params, ServedLight
from support.ros import Parameters, Ros

START: dict[str, Any] = {
    'mode': 'internal_control', 'brightness': 80.0, 'strobe_period': 0.0, 'strobe_duty_cycle': 0.0}
FOUR = {'mode': 'external_sync', 'brightness': 40.0, 'strobe_period': 0.5,
        'strobe_duty_cycle': 25.0}
@pytest.fixture(autouse=True)
def start(ros: Ros, light: ServedLight, parameters: Parameters) -> None:
    """Have every test begin with the same configuration."""
    light.report(mode=1, brightness=80.0, strobe_period=0.0, strobe_duty_cycle=0.0)
    parameters.wait(**START)
    # The test must not receive the event of this change.
    ros.synchronize()
    light.forget()


@pytest.mark.parametrize('atomically', [False, True])
def test_four_parameters_in_one_call_are_one_command_and_one_event(
    light: ServedLight, parameters: Parameters, atomically: bool,
) -> None:
    events = parameters.events()

    response = parameters.start_set(atomically=atomically, **FOUR).result()

    results = [response.result] if atomically else response.results
    assert all(result.successful for result in results)
    assert [params(c) for c in light.commands(CONFIGURE)] == [(2.0, 40.0, 0.5, 25.0)]
    assert parameters.get(*FOUR) == list(FOUR.values())
    assert {p.name for p in events.wait().changed_parameters} == set(FOUR)
    assert len(events.messages) == 1


@pytest.mark.parametrize('atomically', [False, True])
@pytest.mark.parametrize(('name', 'value', 'reason'), [
    ('brightness', 101, 'brightness 101 % is out of range: 0 to 100 %'),
    ('brightness', True, 'brightness True is not a number'),
    ('strobe_period', 0.01, 'strobe_period 0.01 s is outside the range that the light reports: '
                            '0 (no strobe) or 0.05 to 10 s'),
    ('brightness', None, 'brightness cannot be deleted'),
    ('frame_id', 'other', 'frame_id is read-only: restart the node with -p frame_id:=VALUE'),
    ('max_brightness', 'bright', "max_brightness: 'bright' is not a number"),
    ('source_timeout', 5.0, 'source_timeout: is given, but sources is empty'),
    ('banana', 1.0, 'banana is not a parameter of this node'),
    ('brightnes', 1.0, "brightnes is not a parameter of this node; did you mean 'brightness'?"),
])
def test_invalid_value_is_refused_with_its_reason_and_nothing_is_sent(
    light: ServedLight, parameters: Parameters, name: str, value: object, reason: str,
    atomically: bool,
) -> None:
    if atomically:
        result = parameters.set_atomically(**{'strobe_duty_cycle': 1.0, name: value})
    else:
        [result] = parameters.set(**{name: value})

    assert not result.successful
    assert reason in result.reason
    assert light.commands(CONFIGURE) == []
    assert parameters.get(*START, 'frame_id') == [*START.values(), 'illuminator']


def test_request_of_an_unknown_type_or_with_repeated_names_or_empty_is_answered(
    light: ServedLight, parameters: Parameters,
) -> None:
    """No rclpy client can make the first two; others can."""
    unknown = Parameter(name='strobe_period', value=ParameterValue(type=77, double_value=5.0))
    twice = [Parameter(name='brightness', value=ParameterValue(
        type=ParameterType.PARAMETER_DOUBLE, double_value=value)) for value in (10.0, 20.0)]

    listed = parameters.start(SetParameters, 'set_parameters', parameters=[
        unknown, *twice, twice[1]]).result().results
    atomic, atomic_twice = (
        parameters.start(SetParametersAtomically, 'set_parameters_atomically',
                         parameters=values).result().result
        for values in ([unknown], [*twice, twice[0]]))

    assert [result.successful for result in listed] == [False, False, True, True]
    assert not atomic.successful
    assert '77' in listed[0].reason and listed[0].reason == atomic.reason
    assert listed[1].reason == 'brightness has another value later in the request'
    assert atomic_twice.reason == listed[1].reason
    assert parameters.get('brightness', 'strobe_period') == [20.0, 0.0]
    assert light.fake.fields['brightness'] == 20.0
    assert parameters.set() == []
    assert parameters.set_atomically().successful


def test_refusal_by_the_light_is_reported_by_name_and_changes_nothing(
    light: ServedLight, parameters: Parameters,
) -> None:
    events = parameters.events()
    light.fake.results[CONFIGURE] = mavlink.MAV_RESULT_DENIED

    listed = parameters.set(brightness=30.0, strobe_duty_cycle=1.0)
    # A parameter of the node itself is set first, and restored.
    atomic = parameters.start_set(
        atomically=True, use_sim_time=True, brightness=30.0).result().result
    light.behave()
    assert parameters.set(brightness=31.0)[0].successful

    for outcome in (*listed, atomic):
        assert not outcome.successful
        assert outcome.reason.startswith('refused: MAV_RESULT_DENIED (1 try, ')
    assert parameters.get('use_sim_time', 'strobe_duty_cycle') == [False, 0.0]
    event = events.wait(lambda event: any(
        p.name == 'brightness' for p in event.changed_parameters))
    assert [p.value.double_value for p in event.changed_parameters] == [31.0]
