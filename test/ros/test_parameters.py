# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The parameters as tools see them: values, types, descriptors."""

from collections.abc import Iterator
from typing import Any

from illuminator_ros.illuminator.ros.parameters import LIGHT_PARAMETERS
from illuminator_ros.ros.parameters import LINK_PARAMETERS
import pytest
from rcl_interfaces.msg import ParameterType
from support.light import CONFIGURE, params, ServedLight
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
