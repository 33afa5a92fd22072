# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Parameters that may be set while the node runs, and those that may not."""

from collections.abc import Iterator
from typing import Any

from illuminator_ros.gimbal.ros.gimbals import GIMBAL_PARAMETERS
from illuminator_ros.gimbal.ros.manager_node import MANAGER_PARAMETERS
from illuminator_ros.illuminator.ros.parameters import DEVICE_PARAMETERS, LIGHT_PARAMETERS
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.rededge.ros.camera_node import MOUNT_PARAMETERS, PARAMETERS
from illuminator_ros.ros.parameters import LINK_PARAMETERS, ParameterSpec
import pytest
from std_msgs.msg import Float32
from support.light import CONFIGURE, free_port, ServedLight
from support.ros import Parameters, Ros, running_bridge

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
        # All or none, and the limit is put back.
        result = parameters.set_atomically(max_brightness=40.0, brightness=45.0)
        assert result.reason == 'brightness 45 % is above max_brightness 40 %'
        own_ros.synchronize()
        assert parameters.get('max_brightness', 'brightness') == [50.0, 50.0]
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
