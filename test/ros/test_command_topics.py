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

"""``~/cmd/enable`` and ``~/cmd/brightness``."""

import math
import threading

import pytest
from std_msgs.msg import Bool, Float32
from support.light import CONFIGURE, eventually, MavResult, ON_OFF, params, ServedLight
from support.processes import Program
from support.ros import Parameters, Ros, running_bridge
from support.waiting import PATIENCE


class TestEnable:

    @pytest.mark.parametrize('on', [True, False])
    def test_it_switches_the_light(self, ros: Ros, light: ServedLight, on: bool) -> None:
        ros.publish(Bool, '/illuminator/cmd/enable', on)

        [command] = light.wait_for(ON_OFF)

        assert command.param1 == float(on)

    def test_of_what_comes_while_it_switches_only_the_newest_is_done(
        self, ros: Ros, light: ServedLight, parameters: Parameters,
    ) -> None:
        light.fake.delays[ON_OFF] = math.inf
        ros.publish(Bool, '/illuminator/cmd/enable', *[True] * 50, False)
        light.wait_for(ON_OFF)
        # The node has taken what came before it answers.
        parameters.get('frame_id')

        light.release(ON_OFF)

        eventually(lambda: light.commands(ON_OFF)[-1:] and not light.commands(ON_OFF)[-1].param1)
        assert len(light.commands(ON_OFF)) < 10

    def test_a_refusal_is_logged(self, ros: Ros, light: ServedLight, bridge: Program) -> None:
        light.fake.results[ON_OFF] = MavResult.DENIED

        ros.publish(Bool, '/illuminator/cmd/enable', True)

        bridge.wait_for('~/cmd/enable: refused: MAV_RESULT_DENIED')


class TestBrightness:
    def test_it_configures_the_light_and_keeps_the_other_fields(
        self, ros: Ros, light: ServedLight, parameters: Parameters,
    ) -> None:
        light.report(mode=1, strobe_period=2.0, strobe_duty_cycle=20.0)
        parameters.wait(strobe_period=2.0)

        ros.publish(Float32, '/illuminator/cmd/brightness', 41.0)

        [command] = light.wait_for(CONFIGURE)
        assert params(command) == (1.0, 41.0, 2.0, 20.0)

    def test_the_parameter_follows(
        self, ros: Ros, light: ServedLight, parameters: Parameters,
    ) -> None:
        ros.publish(Float32, '/illuminator/cmd/brightness', 43.0)

        parameters.wait(brightness=43.0)

    @pytest.mark.parametrize(('value', 'reason'), [
        (math.nan, 'brightness nan is not a finite number'),
        (math.inf, 'brightness inf is not a finite number'),
        (100.5, 'brightness 100.5 % is out of range: 0 to 100 %'),
        (-1.0, 'brightness -1 % is out of range: 0 to 100 %'),
    ])
    def test_nonsense_is_logged_and_not_sent(
        self, own_ros: Ros, port: int, value: float, reason: str,
    ) -> None:
        with running_bridge(own_ros.domain, port) as bridge, ServedLight(port) as light:
            Parameters(own_ros).wait(mode='internal_control')

            own_ros.publish(Float32, '/illuminator/cmd/brightness', value, 50.0)

            bridge.wait_for(f'~/cmd/brightness: {reason}')
            light.wait_for(CONFIGURE)
            assert [params(c)[1] for c in light.commands(CONFIGURE)] == [50.0]

    def test_a_refusal_is_logged_and_the_parameter_keeps_its_value(
        self, ros: Ros, light: ServedLight, bridge: Program, parameters: Parameters,
    ) -> None:
        light.fake.results[CONFIGURE] = MavResult.DENIED
        before = parameters.get('brightness')

        ros.publish(Float32, '/illuminator/cmd/brightness', 44.0)

        bridge.wait_for('~/cmd/brightness: refused: MAV_RESULT_DENIED')
        assert parameters.get('brightness') == before

    def test_without_a_light_it_says_so(self, own_ros: Ros, port: int) -> None:
        with running_bridge(own_ros.domain, port) as bridge:
            own_ros.publish(Float32, '/illuminator/cmd/brightness', 44.0)

            bridge.wait_for('~/cmd/brightness: no light connected')


class TestStream:
    COUNT = 250

    def test_at_500_hz_the_newest_wins_and_one_command_is_in_flight(
        self, ros: Ros, light: ServedLight,
    ) -> None:
        light.fake.delays[CONFIGURE] = math.inf
        publisher = ros.publisher(Float32, '/illuminator/cmd/brightness')
        values = iter(range(1, self.COUNT + 1))
        done = threading.Event()

        def publish() -> None:
            value = next(values, None)
            if value is None:
                timer.cancel()
                done.set()
            else:
                publisher.publish(Float32(data=value * 100.0 / self.COUNT))

        timer = ros.node.create_timer(0.002, publish)

        assert done.wait(PATIENCE)
        light.release(CONFIGURE)
        eventually(lambda: light.fake.fields['brightness'] == 100.0)
        assert len(light.commands(CONFIGURE)) < self.COUNT / 4
        assert light.fake.most_at_once == 1

    def test_a_burst_ends_with_its_last_value(self, ros: Ros, light: ServedLight) -> None:
        ros.publish(Float32, '/illuminator/cmd/brightness', *map(float, range(10, 71)))

        eventually(lambda: light.fake.fields['brightness'] == 70.0)

    def test_a_setpoint_that_is_reached_already_is_not_sent_again(
        self, ros: Ros, light: ServedLight, parameters: Parameters,
    ) -> None:
        ros.publish(Float32, '/illuminator/cmd/brightness', 71.0)
        parameters.wait(brightness=71.0)
        light.forget()

        ros.publish(Float32, '/illuminator/cmd/brightness', 71.0, 72.0)

        parameters.wait(brightness=72.0)
        assert [params(command)[1] for command in light.commands(CONFIGURE)] == [72.0]
