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

"""What the monitor knows of lights, moment by moment."""

from illuminator_ros.cli.monitor.model import (
    Diagnosis,
    Fleet,
    MAX_LIGHTS,
    printable,
    SILENCE,
    State,
    Trend,
)
import pytest

BOW = '/bow'


def fleet_with(**values: object) -> Fleet:
    """Return a fleet with one light that has published these values at time 100."""
    fleet = Fleet()
    fleet.seen([BOW], 100.0)
    for topic, value in values.items():
        fleet.take(BOW, topic, value, 100.0)
    return fleet


class TestState:
    @pytest.mark.parametrize(('values', 'state'), [
        ({}, State.UNKNOWN),
        ({'connected': True}, State.UNKNOWN),
        ({'connected': True, 'enabled': True}, State.ON),
        ({'connected': True, 'enabled': False}, State.OFF),
        ({'connected': False, 'enabled': True}, State.LOST),
    ])
    def test_it_follows_from_what_was_published(
        self, values: dict[str, bool], state: State,
    ) -> None:
        assert fleet_with(**values).lights[0].state(100.0) is state

    def test_a_light_of_which_nothing_comes_is_silent(self) -> None:
        [light] = fleet_with(connected=True, enabled=True).lights

        assert light.state(100.0 + SILENCE) is State.ON
        assert light.state(100.1 + SILENCE) is State.SILENT

    def test_diagnostics_break_the_silence_too(self) -> None:
        fleet = fleet_with(enabled=True)

        fleet.diagnosed(BOW, 'link', Diagnosis(0, 'open', {}), 110.0)

        assert fleet.lights[0].state(111.0) is State.ON

    def test_a_light_that_left_the_graph_is_gone(self) -> None:
        fleet = fleet_with(connected=True, enabled=True)

        fleet.seen([], 101.0)

        assert fleet.lights[0].state(101.0) is State.GONE

    def test_one_that_returns_is_as_before_but_for_what_was_agreed(self) -> None:
        fleet = fleet_with(connected=True, enabled=True)
        fleet.agreed(BOW, 30.0)
        fleet.seen([], 101.0)

        new = fleet.seen([BOW], 102.0)

        assert new == []
        assert fleet.lights[0].state(102.0) is State.ON
        assert fleet.lights[0].setpoint is None


class TestFleet:

    def test_new_lights_are_told_once_and_stand_in_the_order_of_their_names(self) -> None:
        fleet = Fleet()

        assert fleet.seen(['/b', '/a'], 0.0) == ['/a', '/b']
        assert fleet.seen(['/a', '/b', '/aa'], 1.0) == ['/aa']
        assert [light.name for light in fleet.lights] == ['/a', '/aa', '/b']

    def test_only_what_is_gone_is_cleared(self) -> None:
        fleet = Fleet()
        fleet.seen(['/a', '/b'], 0.0)
        fleet.seen(['/b'], 1.0)

        assert fleet.clear_gone() == ['/a']
        assert [light.name for light in fleet.lights] == ['/b']

    def test_their_number_is_bounded(self) -> None:
        fleet = Fleet()

        fleet.seen([f'/light_{number}' for number in range(MAX_LIGHTS + 5)], 0.0)

        assert len(fleet.lights) == MAX_LIGHTS

    def test_what_is_of_no_known_light_is_passed_over(self) -> None:
        fleet = fleet_with()

        fleet.take('/other', 'enabled', True, 100.0)
        fleet.diagnosed('', 'lamp', Diagnosis(2, 'broken', {}), 100.0)
        fleet.agreed('/other', 1.0)

        assert [light.name for light in fleet.lights] == [BOW]
        assert fleet.lights[0].level == 0

    def test_the_level_is_the_worse_of_link_and_lamp(self) -> None:
        fleet = fleet_with()
        fleet.diagnosed(BOW, 'link', Diagnosis(2, 'lost', {}), 100.0)
        fleet.diagnosed(BOW, 'lamp', Diagnosis(1, 'hot', {}), 100.0)

        assert fleet.lights[0].level == 2

    def test_error_flags_have_words(self) -> None:
        assert fleet_with(error_flags=0x15).lights[0].flags == [
            'thermal throttling', 'thermistor failure', 'unknown flags 0x10']

    @pytest.mark.parametrize(('text', 'number'), [
        ('12.5', 12.5), ('0', 0.0), ('n/a', None), ('nan', None), ('inf', None), (None, None)])
    def test_a_number_of_a_diagnosis_is_one_or_none(
        self, text: str | None, number: float | None,
    ) -> None:
        values = {} if text is None else {'loss_percent': text}

        assert Diagnosis(0, '', values).number('loss_percent') == number

    def test_nothing_that_others_send_reaches_the_terminal_as_a_command(self) -> None:
        fleet = fleet_with(mode='\x1b[2J')
        fleet.diagnosed(BOW, 'lamp', Diagnosis(1, 'a\x1b]0;x\x07', {'vendor': '\r\n'}), 100.0)
        [light] = fleet.lights

        assert light.lamp is not None
        texts = [light.value('mode'), light.lamp.message, *light.lamp.values.values()]
        assert all(text.isprintable() for text in texts)
        assert printable('Ünï 20 %') == 'Ünï 20 %'


class TestTrend:

    def test_it_has_the_newest_value_of_each_step(self) -> None:
        trend = Trend(step=2.0, size=10)
        for now, value in ((0.0, 20.0), (1.9, 21.0), (2.0, 22.0), (4.5, 23.0)):
            trend.add(value, now)

        assert trend.last(3, 5.0) == [21.0, 22.0, 23.0]

    def test_steps_without_a_value_are_empty(self) -> None:
        trend = Trend(step=2.0, size=10)
        trend.add(20.0, 0.0)
        trend.add(21.0, 6.0)

        assert trend.last(5, 9.0) == [20.0, None, None, 21.0, None]

    def test_it_is_no_longer_than_its_size(self) -> None:
        trend = Trend(step=1.0, size=3)
        for now in range(100):
            trend.add(float(now), float(now))

        assert trend.last(10, 99.0) == [97.0, 98.0, 99.0]
