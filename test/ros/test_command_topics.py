# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``~/cmd/enable`` and ``~/cmd/brightness`` command the light; the newest message wins."""

import math

from illuminator_ros.mavlink.dialect import mavlink
import pytest
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Bool, Float32
from support.light import CONFIGURE, eventually, ON_OFF, params, ServedLight
from support.ros import Parameters, Ros, running_bridge

ENABLE, BRIGHTNESS = '/illuminator/cmd/enable', '/illuminator/cmd/brightness'


def test_newest_enable_message_wins_while_the_light_is_being_switched(
    ros: Ros, light: ServedLight, parameters: Parameters,
) -> None:
    light.fake.held[ON_OFF] = []
    ros.publish(Bool, ENABLE, *[True] * 50, False)
    light.wait_for(ON_OFF)
    # The node takes earlier messages before it answers.
    parameters.get('frame_id')

    light.release(ON_OFF)

    eventually(lambda: light.commands(ON_OFF)[-1:] and not light.commands(ON_OFF)[-1].param1)
    assert len(light.commands(ON_OFF)) < 10


@pytest.mark.parametrize(('topic', 'type_', 'value', 'command'), [
    ('enable', Bool, True, ON_OFF), ('brightness', Float32, 44.0, CONFIGURE)])
def test_refusal_is_logged_and_parameters_keep_their_values(
    own_ros: Ros, port: int, topic: str, type_: type, value: object, command: int,
) -> None:
    # No answer to an earlier command can be taken for the refusal.
    with running_bridge(own_ros.domain, port) as bridge, ServedLight(port) as light:
        parameters = Parameters(own_ros)
        parameters.wait(mode='internal_control')
        light.fake.results[command] = mavlink.MAV_RESULT_DENIED
        before = parameters.get('brightness')

        own_ros.publish(type_, f'/illuminator/cmd/{topic}', value)

        bridge.wait_for(f'~/cmd/{topic}: refused: MAV_RESULT_DENIED')
        assert parameters.get('brightness') == before


def test_best_effort_publisher_is_heard(
    ros: Ros, light: ServedLight, parameters: Parameters,
) -> None:
    publisher = ros.node.create_publisher(
        Float32, BRIGHTNESS, QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))
    eventually(publisher.get_subscription_count)
    ros.meet('/illuminator')

    publisher.publish(Float32(data=37.0))

    parameters.wait(brightness=37.0)
    ros.node.destroy_publisher(publisher)


def test_invalid_or_early_brightness_is_logged_with_its_reason_and_not_sent(
    own_ros: Ros, port: int,
) -> None:
    with running_bridge(own_ros.domain, port) as bridge:
        own_ros.publish(Float32, BRIGHTNESS, 44.0)
        bridge.wait_for('~/cmd/brightness: no light connected')
        with ServedLight(port) as light:
            Parameters(own_ros).wait(mode='internal_control')

            own_ros.publish(Float32, BRIGHTNESS, math.nan, math.inf, 100.5, -1.0, 50.0)

            bridge.wait_for('~/cmd/brightness: ignored: brightness 100.5 % is out of range')
            light.wait_for(CONFIGURE)
            assert [params(c)[1] for c in light.commands(CONFIGURE)] == [50.0]
