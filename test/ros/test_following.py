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

"""Parameters show the light, whoever has changed it (DESIGN.md, 3.2)."""

import pytest
from std_msgs.msg import Float32
from std_srvs.srv import Trigger
from support.light import CONFIGURE, ServedLight
from support.processes import Program
from support.ros import Parameters, Ros

THROTTLING = 1
FIELDS = ('mode', 'brightness', 'strobe_period', 'strobe_duty_cycle')


@pytest.fixture(autouse=True)
def start(light: ServedLight, parameters: Parameters) -> None:
    """Have every test begin with the same configuration, and no status of its own."""
    light.report(mode=1, brightness=80.0, strobe_period=0.0, strobe_duty_cycle=0.0,
                 error_status=0)
    parameters.wait(mode='internal_control', brightness=80.0, strobe_period=0.0,
                    strobe_duty_cycle=0.0)
    light.forget()


def all_is_done(ros: Ros) -> None:
    """Wait until the node has done what follows from all that it has heard."""
    assert ros.call(Trigger, '/illuminator/refresh', Trigger.Request()).success


@pytest.mark.parametrize(('report', 'shown'), [
    ({'brightness': 35.0}, {'brightness': 35.0}),
    ({'mode': 2}, {'mode': 'external_sync'}),
    ({'strobe_period': 0.5}, {'strobe_period': 0.5}),
    ({'strobe_duty_cycle': 12.5}, {'strobe_duty_cycle': 12.5}),
    ({'brightness': 36.0, 'strobe_period': 2.0}, {'brightness': 36.0, 'strobe_period': 2.0}),
])
class TestChangedByAnother:
    def test_the_parameters_move_and_nothing_is_sent(
        self, ros: Ros, light: ServedLight, parameters: Parameters, report: dict[str, float],
        shown: dict[str, object],
    ) -> None:
        light.report(**report)

        parameters.wait(**shown)
        all_is_done(ros)
        assert light.commands(CONFIGURE) == []

    def test_it_is_one_line_in_the_log_and_one_event(
        self, ros: Ros, light: ServedLight, parameters: Parameters, bridge: Program,
        report: dict[str, float], shown: dict[str, object],
    ) -> None:
        events = parameters.events()
        lines = bridge.count('was changed')

        light.report(**report)
        parameters.wait(**shown)
        all_is_done(ros)

        assert bridge.count('was changed') == lines + 1
        assert {p.name for p in events.wait().changed_parameters} == set(shown)
        assert len(events.messages) == 1


def test_the_line_is_info_and_tells_the_new_values(
    light: ServedLight, parameters: Parameters, bridge: Program,
) -> None:
    light.report(brightness=37.0, strobe_period=0.25)

    bridge.wait_for(
        'light 1/243 was changed: brightness 37 %, strobe_period 0.25 s')
    [line] = [line for line in bridge.lines if 'brightness 37 %' in line]
    assert line.startswith('[INFO]')


class TestNoChange:
    """What is not a change by somebody: no line, no event, no command."""

    @pytest.fixture(autouse=True)
    def unmoved(self, ros: Ros, light: ServedLight, parameters: Parameters, bridge: Program):
        self.events = parameters.events()
        self.lines = bridge.count('was changed')
        yield
        all_is_done(ros)
        assert self.events.messages == []
        assert bridge.count('was changed') == self.lines
        assert light.commands(CONFIGURE) == []

    def test_the_rounding_of_float32(
        self, ros: Ros, light: ServedLight, parameters: Parameters,
    ) -> None:
        assert parameters.set(brightness=60.1)[0].successful
        self.events.wait()
        self.events.clear()
        light.forget()

        # What comes back on the wire is 60.099998.
        light.report()
        all_is_done(ros)

        assert parameters.get('brightness') == [60.1]

    def test_less_light_because_of_heat(
        self, ros: Ros, light: ServedLight, parameters: Parameters,
    ) -> None:
        topic = ros.subscribe(Float32, '/illuminator/brightness')

        light.report(brightness=40.0, error_status=THROTTLING)
        topic.wait_value(40.0)
        light.report(brightness=80.0, error_status=0)
        all_is_done(ros)

        assert parameters.get('brightness') == [80.0]

    def test_a_status_in_which_the_mode_is_unknown(
        self, ros: Ros, light: ServedLight, parameters: Parameters,
    ) -> None:
        light.report(mode=0)
        all_is_done(ros)
        light.report(mode=1)

        assert parameters.get('mode') == ['internal_control']

    def test_a_value_that_cannot_be_true(
        self, ros: Ros, light: ServedLight, parameters: Parameters,
    ) -> None:
        light.report(brightness=float('nan'))
        all_is_done(ros)
        light.report(brightness=80.0)

        assert parameters.get('brightness') == [80.0]


class TestNoFeedback:
    def test_a_set_is_followed_by_nothing(
        self, ros: Ros, light: ServedLight, parameters: Parameters,
    ) -> None:
        parameters.set(brightness=22.0)
        light.forget()
        for _ in range(3):
            light.report()

        all_is_done(ros)
        assert light.commands(CONFIGURE) == []

    def test_a_light_that_rounds_to_its_steps_has_the_last_word(
        self, ros: Ros, light: ServedLight, parameters: Parameters, bridge: Program,
    ) -> None:
        lines = bridge.count('was changed')
        light.fake.steps = 1.0

        [result] = parameters.set(brightness=33.3)

        light.fake.steps = 0.0
        assert result.successful
        assert parameters.get('brightness') == [33.0]
        all_is_done(ros)
        assert bridge.count('was changed') == lines
        assert len(light.commands(CONFIGURE)) == 1


def test_two_who_change_the_light_do_not_fight(
    ros: Ros, light: ServedLight, parameters: Parameters,
) -> None:
    parameters.set(brightness=50.0)
    light.report(brightness=20.0)
    parameters.wait(brightness=20.0)

    parameters.set(strobe_period=1.0)

    assert parameters.get('brightness', 'strobe_period') == [20.0, 1.0]
    assert light.fake.fields['brightness'] == 20.0
