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

"""Limits, sources, the dead man's switch and changes by other senders, in the node."""

import pytest
from std_msgs.msg import Float32
from support.embedded import refusal
from support.light import CONFIGURE, free_port, ServedLight
from support.ros import Parameters, Ros, running_bridge


@pytest.mark.parametrize(('given', 'reason'), [
    ({'max_brightness': 100.5}, 'max_brightness: 100.5 % is out of range: 0 to 100 %'),
    ({'min_strobe_period': -1.0}, 'min_strobe_period: -1.0 s is out of range: 0 to 3600 s'),
    ({'max_brightness': 60, 'brightness': 80},
     'brightness 80 % is above max_brightness 60 %'),
])
def test_wrong_configuration_is_refused_at_the_start_with_its_reason(
    ros: Ros, given: dict[str, object], reason: str,
) -> None:
    assert reason in refusal(ros.context, **given)


def test_limits_are_shown_by_descriptors_refuse_parameters_and_clip_streams(own_ros: Ros) -> None:
    parameters, port = Parameters(own_ros), free_port()
    with (running_bridge(own_ros.domain, port, max_brightness=60.0, min_strobe_period=0.34)
          as bridge, ServedLight(port, brightness=80.0) as light):
        parameters.wait(brightness=60.0)
        parameters.wait_range('brightness', 60.0)
        brightness, period = parameters.describe('brightness', 'strobe_period')
        assert 'at most 60 %' in brightness.additional_constraints
        assert 'at least 0.34 s' in period.additional_constraints

        [refused] = parameters.set(strobe_period=0.1)
        assert refused.reason == 'strobe_period 0.1 s is below min_strobe_period 0.34 s'
        parameters.set(brightness=50.0)
        own_ros.publish(Float32, '/illuminator/cmd/brightness', 90.0)

        bridge.wait_for('brightness 90 % is above max_brightness 60 %: the limit is sent')
        parameters.wait(brightness=60.0)
        assert max(command.param2 for command in light.commands(CONFIGURE)) == 60.0
