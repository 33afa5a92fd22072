# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The parameters: as tools see them, set while the node runs, and refused with the reason."""

from collections.abc import Iterator
from typing import Any

from illuminator_ros.gimbal.ros.gimbals import GIMBAL_PARAMETERS
from illuminator_ros.gimbal.ros.manager_node import MANAGER_PARAMETERS
from illuminator_ros.illuminator.ros.parameters import DEVICE_PARAMETERS, LIGHT_PARAMETERS
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.rededge.ros.camera_node import MOUNT_PARAMETERS, PARAMETERS
from illuminator_ros.ros.parameters import LINK_PARAMETERS, ParameterSpec
import pytest
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from std_msgs.msg import Float32
from support.light import CONFIGURE, free_port, params, ServedLight
from support.ros import Parameters, Ros, running_bridge

DEVICE = ('mode', 'brightness', 'strobe_period', 'strobe_duty_cycle')
DOUBLE, STRING, NOT_SET = (
    ParameterType.PARAMETER_DOUBLE, ParameterType.PARAMETER_STRING,
    ParameterType.PARAMETER_NOT_SET)
TYPES = {float: DOUBLE, str: STRING, int: ParameterType.PARAMETER_INTEGER,
         bool: ParameterType.PARAMETER_BOOL, list: ParameterType.PARAMETER_STRING_ARRAY}
LINK = {spec.name: TYPES[type(spec.default)] for spec in (*LINK_PARAMETERS, *LIGHT_PARAMETERS)}


@pytest.fixture(scope='module')
def alone(ros: Ros) -> Iterator[Parameters]:
    """Return the parameters of a bridge that has not heard a light."""
    with running_bridge(ros.domain, 0, '-r', '__node:=alone', connection_url='memory://none'):
        yield Parameters(ros, '/alone')


def test_parameters_of_the_light_are_described_and_not_listed_before_its_first_status(
    alone: Parameters,
) -> None:
    assert alone.get(*DEVICE, 'frame_id') == [None] * 4 + ['illuminator']
    assert alone.types(*DEVICE) == [NOT_SET] * 4
    # ros2 param dump would write null, which cannot be loaded.
    assert not set(DEVICE) & set(alone.names())
    assert [one.type for one in alone.describe(*DEVICE)] == [STRING, DOUBLE, DOUBLE, DOUBLE]
    assert alone.get('connection_url', 'component_id') == ['memory://none', 193]


@pytest.mark.parametrize(('name', 'unit', 'high', 'constraint'), [
    ('brightness', '[%]', 100.0, ''), ('strobe_duty_cycle', '[%]', 100.0, ''),
    ('strobe_period', '[s]', 10.0, '0 = no strobe')])
def test_number_is_described_with_unit_range_and_constraint(
    light: ServedLight, parameters: Parameters, name: str, unit: str, high: float,
    constraint: str,
) -> None:
    [descriptor] = parameters.describe(name)

    assert unit in descriptor.description
    assert constraint in descriptor.additional_constraints
    [range_] = descriptor.floating_point_range
    assert (range_.from_value, range_.to_value, range_.step) == (0.0, high, 0.0)
    assert not descriptor.read_only


@pytest.mark.parametrize(('limits', 'high'), [
    ((0.1, 3.0), 3.0), ((0.0, 0.0), 3600.0), ((5.0, 1.0), 3600.0), ((0.05, 10.0), 10.0)])
def test_strobe_range_follows_the_limits_that_the_light_reports(
    light: ServedLight, parameters: Parameters, limits: tuple[float, float], high: float,
) -> None:
    light.report(strobe_period=0.0)
    parameters.wait(strobe_period=0.0)

    light.fake.fields |= {'min_strobe_period': limits[0], 'max_strobe_period': limits[1]}

    parameters.wait_range('strobe_period', high)


def test_link_parameters_are_typed_and_described(parameters: Parameters) -> None:
    names, before = list(LINK), parameters.get(*LINK)
    types = parameters.types(*names)

    assert dict(zip(names, types, strict=True)) == LINK
    for name, descriptor in zip(names, parameters.describe(*names), strict=True):
        assert descriptor.description, name
    for name, value in (('connection_url', 'udpin://127.0.0.1:1'), ('frame_id', 'other'),
                        ('system_id', 7), ('off_on_shutdown', True)):
        [result] = parameters.set(**{name: value})
        assert not result.successful
        assert 'read-only' in result.reason
    assert parameters.get(*LINK) == before


@pytest.mark.parametrize(('given', 'sent'), [
    ({'brightness': 60.5}, (2.0, 60.5, 2.0, 10.0)),
    ({'mode': 'internal_control', 'brightness': 1, 'strobe_period': 3.5,
      'strobe_duty_cycle': 50}, (1.0, 1.0, 3.5, 50.0))])
def test_overrides_are_sent_with_the_first_connection_in_one_command(
    own_ros: Ros, port: int, given: dict[str, Any], sent: tuple[float, ...],
) -> None:
    own: dict[str, Any] = {
        'mode': 2, 'brightness': 90.0, 'strobe_period': 2.0, 'strobe_duty_cycle': 10.0}
    with (running_bridge(own_ros.domain, port, **given) as bridge,
          ServedLight(port, **own) as light):
        bridge.wait_for('light 1/243 configured: ')

        assert [params(command) for command in light.commands(CONFIGURE)] == [sent]
        Parameters(own_ros).wait(brightness=sent[1], strobe_period=sent[2])


# Sets

BEFORE: dict[str, Any] = {
    'mode': 'internal_control', 'brightness': 80.0, 'strobe_period': 0.0, 'strobe_duty_cycle': 0.0}
FOUR = {'mode': 'external_sync', 'brightness': 40.0, 'strobe_period': 0.5,
        'strobe_duty_cycle': 25.0}


@pytest.fixture
def start(ros: Ros, light: ServedLight, parameters: Parameters) -> None:
    """Have a test begin with the same configuration."""
    light.report(mode=1, brightness=80.0, strobe_period=0.0, strobe_duty_cycle=0.0)
    parameters.wait(**BEFORE)
    # The test must not receive the event of this change.
    ros.synchronize()
    light.forget()


@pytest.mark.usefixtures('start')
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


@pytest.mark.usefixtures('start')
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
        # Those of the node are set in a request without the device's.
        others = {} if name in ('frame_id', 'source_timeout') else {'strobe_duty_cycle': 1.0}
        result = parameters.set_atomically(**others, **{name: value})
    else:
        [result] = parameters.set(**{name: value})

    assert not result.successful
    assert reason in result.reason
    assert light.commands(CONFIGURE) == []
    assert parameters.get(*BEFORE, 'frame_id') == [*BEFORE.values(), 'illuminator']


@pytest.mark.usefixtures('start')
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


@pytest.mark.usefixtures('start')
def test_refusal_by_the_light_is_reported_by_name_and_changes_nothing(
    light: ServedLight, parameters: Parameters,
) -> None:
    events = parameters.events()
    light.fake.results[CONFIGURE] = mavlink.MAV_RESULT_DENIED

    listed = parameters.set(brightness=30.0, strobe_duty_cycle=1.0)
    atomic = parameters.start_set(atomically=True, brightness=30.0).result().result
    light.behave()
    assert parameters.set(brightness=31.0)[0].successful

    for outcome in (*listed, atomic):
        assert not outcome.successful
        assert outcome.reason.startswith('refused: MAV_RESULT_DENIED (1 try, ')
    assert parameters.get('strobe_duty_cycle') == [0.0]
    event = events.wait(lambda event: any(
        p.name == 'brightness' for p in event.changed_parameters))
    assert [p.value.double_value for p in event.changed_parameters] == [31.0]


# Limits and other parameters of the node

START: dict[str, Any] = {
    'max_brightness': 90.0, 'min_strobe_period': 0.1, 'off_after_silence': 600.0}
SPECS = (*LINK_PARAMETERS, *LIGHT_PARAMETERS, *DEVICE_PARAMETERS, *GIMBAL_PARAMETERS,
         *MANAGER_PARAMETERS, *PARAMETERS, *MOUNT_PARAMETERS)


@pytest.fixture(scope='module')
def guarded(ros: Ros) -> Iterator[Parameters]:
    """Return the parameters of a bridge that was started with limits."""
    with running_bridge(ros.domain, 0, '-r', '__node:=guarded', connection_url='memory://none',
                        **START):
        yield Parameters(ros, '/guarded')


def test_a_lower_limit_dims_the_light_at_once_and_is_shown(own_ros: Ros) -> None:
    parameters, port = Parameters(own_ros), free_port()
    with (running_bridge(own_ros.domain, port) as bridge,
          ServedLight(port, brightness=80.0) as light):
        parameters.wait(brightness=80.0)

        [accepted] = parameters.set(max_brightness=50)

        assert accepted.successful
        assert parameters.get('max_brightness') == [50.0]
        parameters.wait(brightness=50.0)
        assert [command.param2 for command in light.commands(CONFIGURE)] == [50.0]
        parameters.wait_range('brightness', 50.0)
        [descriptor] = parameters.describe('brightness')
        assert descriptor.additional_constraints == 'at most 50 %, which is max_brightness'
        [refused] = parameters.set(brightness=60.0)
        assert refused.reason == 'brightness 60 % is above max_brightness 50 %'
        own_ros.publish(Float32, '/illuminator/cmd/brightness', 60.0)
        bridge.wait_for('brightness 60 % is above max_brightness 50 %: the limit is sent')
        light.wait_for(CONFIGURE, count=2)
        assert [command.param2 for command in light.commands(CONFIGURE)] == [50.0, 50.0]

        assert parameters.set(max_brightness=100.0)[0].successful
        parameters.wait_range('brightness', 100.0)
        assert parameters.set(brightness=60.0)[0].successful


@pytest.mark.parametrize(('name', 'weaker', 'tighter'), [
    ('max_brightness', 90.1, 20.0), ('min_strobe_period', 0.05, 0.34),
    ('off_after_silence', 601.0, 60.0), ('off_after_silence', 0.0, 60.0)])
def test_a_protection_is_never_weaker_than_at_the_start(
    guarded: Parameters, name: str, weaker: float, tighter: float,
) -> None:
    assert guarded.set(**{name: tighter})[0].successful

    [refused] = guarded.set(**{name: weaker})

    assert not refused.successful
    assert refused.reason == (
        f'{name}: {weaker:g} is a weaker limit than {START[name]:g}, which was given at the '
        f'start: restart the node with -p {name}:=VALUE')
    assert guarded.get(name) == [tighter]
    assert guarded.set(**{name: START[name]})[0].successful


def test_the_descriptors_show_which_parameters_may_be_set(guarded: Parameters) -> None:
    names = [spec.name for spec in LIGHT_PARAMETERS]

    assert [descriptor.read_only for descriptor in guarded.describe(*names)] == [
        not spec.changeable for spec in LIGHT_PARAMETERS]
    assert 'at least 0.1 s' in guarded.describe('strobe_period')[0].additional_constraints


@pytest.mark.parametrize('spec', SPECS, ids=lambda spec: spec.name)
def test_the_range_of_a_number_fits_a_slider_of_rqt_reconfigure(spec: ParameterSpec) -> None:
    """Its sliders have an int of 32 bits, a finite range, and the default in it."""
    descriptor = spec.descriptor(read_only=False)
    ranges = [*descriptor.integer_range, *descriptor.floating_point_range]

    assert len(ranges) == (type(spec.default) in (int, float))
    for one in ranges:
        assert isinstance(spec.default, int | float)
        assert -2**31 <= one.from_value <= spec.default <= one.to_value < 2**31
        assert (one.from_value < one.to_value, one.step) == (True, 0)


def test_a_further_light_is_served_within_a_limit_that_was_set_later(own_ros: Ros) -> None:
    port = free_port()
    with (running_bridge(own_ros.domain, port, '-p', 'illuminator_1_244:brightness:=70.0')
          as bridge, ServedLight(port) as light):
        Parameters(own_ros).wait(mode='internal_control')
        assert Parameters(own_ros).set(max_brightness=50.0)[0].successful
        with ServedLight(port, Address(1, 244), brightness=30.0) as other:
            bridge.wait_for('light 1/244 is served by /illuminator_1_244')
            further = Parameters(own_ros, '/illuminator_1_244')
            further.wait(brightness=50.0)
            further.wait_range('brightness', 50.0)
            assert other.fake.fields['brightness'] == light.fake.fields['brightness'] == 50.0
