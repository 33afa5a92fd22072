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

"""The lights of the monitor over time."""

from illuminator_ros.cli.monitor import model
import pytest

BOW = '/bow'


def lights_with(**values: object) -> model.DiscoveredLights:
    """Return lights: one, which has published these values at time 100."""
    lights = model.DiscoveredLights()
    lights.seen([BOW], 100.0)
    for topic, value in values.items():
        lights.take(BOW, topic, value, 100.0)
    return lights


@pytest.mark.parametrize(('values', 'state'), [
    ({}, model.State.UNKNOWN),
    ({'connected': True}, model.State.UNKNOWN),
    ({'connected': True, 'enabled': True}, model.State.ON),
    ({'connected': True, 'enabled': False}, model.State.OFF),
    ({'connected': False, 'enabled': True}, model.State.LOST),
])
def test_state_follows_from_the_topics(values: dict[str, bool], state: model.State) -> None:
    assert lights_with(**values).snapshot()[0].state(100.0) is state


def test_light_without_topics_and_diagnostics_is_silent() -> None:
    lights = lights_with(connected=True, enabled=True)
    [light] = lights.snapshot()
    assert light.state(100.0 + model.SILENCE) is model.State.ON
    assert light.state(100.1 + model.SILENCE) is model.State.SILENT

    lights.diagnosed(BOW, 'link', model.Diagnosis(0, 'open', {}), 110.0)

    assert lights.snapshot()[0].state(111.0) is model.State.ON


def test_light_that_left_the_graph_is_gone_and_returns_without_its_setpoint() -> None:
    lights = lights_with(connected=True, enabled=True)
    lights.agreed(BOW, 30.0)
    lights.seen([], 101.0)
    assert lights.snapshot()[0].state(101.0) is model.State.GONE

    assert lights.seen([BOW], 102.0) == []

    assert lights.snapshot()[0].state(102.0) is model.State.ON
    assert lights.snapshot()[0].setpoint is None


def test_lights_are_sorted_bounded_and_cleared_if_gone() -> None:
    lights = model.DiscoveredLights()

    assert lights.seen(['/b', '/a'], 0.0) == ['/a', '/b']
    assert lights.seen(['/a', '/b', '/aa'], 1.0) == ['/aa']
    assert [light.name for light in lights.snapshot()] == ['/a', '/aa', '/b']
    lights.seen(['/b'], 2.0)
    assert lights.clear_gone() == ['/a', '/aa']
    assert [light.name for light in lights.snapshot()] == ['/b']
    lights.seen(['/b', *(f'/light_{number}' for number in range(model.MAX_LIGHTS + 5))], 3.0)
    assert len(lights.snapshot()) == model.MAX_LIGHTS


def test_values_of_unknown_lights_are_ignored() -> None:
    lights = lights_with()

    lights.take('/other', 'enabled', True, 100.0)
    lights.diagnosed('', 'lamp', model.Diagnosis(2, 'broken', {}), 100.0)
    lights.agreed('/other', 1.0)

    assert [(light.name, light.lamp) for light in lights.snapshot()] == [(BOW, None)]


def test_error_flags_have_texts() -> None:
    assert lights_with(error_flags=0x15).snapshot()[0].flags == [
        'thermal throttling', 'thermistor failure', 'unknown flags 0x10']


def test_control_characters_of_others_never_reach_the_terminal() -> None:
    lights = lights_with(mode='\x1b[2J')
    lights.diagnosed(BOW, 'lamp', model.Diagnosis(1, 'a\x1b]0;x\x07', {'vendor': '\r\n'}), 100.0)
    [light] = lights.snapshot()

    assert light.lamp is not None
    texts = [light.value('mode'), light.lamp.message, *light.lamp.values.values()]
    assert all(text.isprintable() for text in texts)
    assert model.printable('Ünï 20 %') == 'Ünï 20 %'


def test_trend_has_the_newest_value_of_each_step_up_to_its_size() -> None:
    trend = model.Trend(step=2.0, size=10)
    for now, value in ((0.0, 20.0), (1.9, 21.0), (2.0, 22.0), (8.5, 23.0)):
        trend.add(value, now)

    assert trend.last(6, 9.0) == [None, 21.0, 22.0, None, None, 23.0]
    short = model.Trend(step=1.0, size=3)
    for second in range(100):
        short.add(float(second), float(second))
    assert short.last(10, 99.0) == [97.0, 98.0, 99.0]


@pytest.mark.parametrize(('text', 'number'), [
    ('12.5', 12.5), ('0', 0.0), ('n/a', None), ('nan', None), ('inf', None), (None, None)])
def test_number_of_a_diagnosis_is_finite_or_none(
    text: str | None, number: float | None,
) -> None:
    values = {} if text is None else {'loss_percent': text}

    assert model.Diagnosis(0, '', values).number('loss_percent') == number
