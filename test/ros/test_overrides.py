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

"""Parameters of the light given at the start (DESIGN.md, 3.3)."""

import json
from pathlib import Path

import pytest
from support.light import CONFIGURE, MavResult, ON_OFF, params, ServedLight
from support.ros import Parameters, Ros, running_bridge
from support.slow import CLOCK

# What the light is configured to be before anybody asks: mode, brightness, period, duty cycle.
OWN = {'mode': 2, 'brightness': 90.0, 'strobe_period': 2.0, 'strobe_duty_cycle': 10.0}


@pytest.fixture
def light(port: int) -> ServedLight:
    """Return a light that is not yet within hearing."""
    return ServedLight(port, **OWN)


@pytest.mark.parametrize(('given', 'sent'), [
    ({'brightness': 60.5}, (2.0, 60.5, 2.0, 10.0)),
    ({'brightness': 60}, (2.0, 60.0, 2.0, 10.0)),
    ({'mode': 'internal_control', 'strobe_period': 0}, (1.0, 90.0, 0.0, 10.0)),
    ({'mode': 'internal_control', 'brightness': 1, 'strobe_period': 3.5,
      'strobe_duty_cycle': 50}, (1.0, 1.0, 3.5, 50.0)),
])
def test_they_are_sent_with_the_first_connection_in_one_command(
    ros: Ros, port: int, light: ServedLight, given: dict[str, object],
    sent: tuple[float, ...],
) -> None:
    with running_bridge(ros.domain, port, **given) as bridge, light:
        bridge.wait_for('light 1/243 configured: ')

        assert [params(command) for command in light.commands(CONFIGURE)] == [sent]


@pytest.mark.parametrize('yaml', [
    'illuminator: {ros__parameters: {brightness: 60}}',
    '/illuminator: {ros__parameters: {brightness: 60.0}}',
    '/**: {ros__parameters: {brightness: 60}}',
])
def test_they_may_stand_in_a_file(
    ros: Ros, port: int, light: ServedLight, tmp_path: Path, yaml: str,
) -> None:
    file = tmp_path / 'parameters.yaml'
    file.write_text(yaml)

    with running_bridge(ros.domain, port, '--params-file', str(file)) as bridge, light:
        bridge.wait_for('light 1/243 configured: ')

        assert [params(command)[1] for command in light.commands(CONFIGURE)] == [60.0]


def test_the_parameters_have_them_once_the_light_has(
    own_ros: Ros, port: int, light: ServedLight,
) -> None:
    with running_bridge(own_ros.domain, port, brightness=60), light:
        Parameters(own_ros).wait(brightness=60.0, strobe_period=2.0)


def test_without_any_nothing_is_sent(own_ros: Ros, port: int, light: ServedLight) -> None:
    with running_bridge(own_ros.domain, port), light:
        Parameters(own_ros).wait(brightness=90.0, mode='external_sync')

        assert light.commands(CONFIGURE) == []


def test_what_one_bridge_has_can_be_given_to_the_next(
    own_ros: Ros, port: int, light: ServedLight, tmp_path: Path,
) -> None:
    """As ``ros2 param dump`` and ``--params-file`` do."""
    file = tmp_path / 'dump.yaml'
    with light:
        with running_bridge(own_ros.domain, port, heartbeat_timeout=2, signing_mode="'off'"):
            parameters = Parameters(own_ros)
            parameters.wait(brightness=90.0)
            parameters.set(brightness=55)
            names = parameters.names()
            dump = dict(zip(names, parameters.get(*names), strict=True))
        # JSON is YAML, but for the arrays that rcl makes of lists.
        file.write_text(json.dumps({'/illuminator': {'ros__parameters': {
            name: list(value) if isinstance(value, list | tuple) else value
            for name, value in dump.items()}}}))
        light.report(brightness=10.0)

        with running_bridge(own_ros.domain, port, '--params-file', str(file)) as bridge:
            bridge.wait_for('light 1/243 configured: ')

            assert light.fake.fields['brightness'] == 55.0
            assert bridge.count('WARN') + bridge.count('ERROR') == 0
            assert parameters.get('heartbeat_timeout') == [2.0]


class TestRestart:
    def test_they_are_sent_again_with_what_was_agreed_since(
        self, own_ros: Ros, port: int, light: ServedLight,
    ) -> None:
        with running_bridge(own_ros.domain, port, brightness=60) as bridge, light:
            bridge.wait_for('light 1/243 configured: ')
            assert Parameters(own_ros).set(strobe_period=4.0)[0].successful
            light.forget()

            light.restart()

            bridge.wait_for('light 1/243 has restarted')
            bridge.wait_for('light 1/243 configured: ', count=2)
            assert [params(c) for c in light.commands(CONFIGURE)] == [(2.0, 60.0, 4.0, 10.0)]
            assert Parameters(own_ros).get('brightness', 'strobe_period') == [60.0, 4.0]

    def test_what_was_agreed_without_overrides_is_sent_again_too(
        self, own_ros: Ros, port: int, light: ServedLight,
    ) -> None:
        with running_bridge(own_ros.domain, port) as bridge, light:
            Parameters(own_ros).wait(brightness=90.0)

            light.restart()

            bridge.wait_for('light 1/243 configured: ')
            assert [params(c) for c in light.commands(CONFIGURE)] == [(2.0, 90.0, 2.0, 10.0)]

    def test_they_are_not_where_restoring_is_off_and_the_parameters_follow_the_light(
        self, own_ros: Ros, port: int, light: ServedLight,
    ) -> None:
        with running_bridge(own_ros.domain, port, restore_configuration=False) as bridge, light:
            Parameters(own_ros).wait(brightness=90.0)

            light.restart()

            bridge.wait_for('light 1/243 has restarted')
            Parameters(own_ros).wait(brightness=100.0, mode='internal_control')
            assert light.commands(CONFIGURE) == []

    def test_the_light_is_never_switched_on(
        self, own_ros: Ros, port: int, light: ServedLight,
    ) -> None:
        light.fake.fields['enable'] = 1
        with running_bridge(own_ros.domain, port, brightness=60) as bridge, light:
            bridge.wait_for('light 1/243 configured: ')

            light.restart()

            bridge.wait_for('light 1/243 configured: ', count=2)
            assert light.commands(ON_OFF) == []
            assert light.fake.fields['enable'] == 0


class TestNotTaken:
    def test_a_refusal_is_an_error_in_the_log_and_the_parameters_show_the_light(
        self, own_ros: Ros, port: int, light: ServedLight,
    ) -> None:
        light.fake.results[CONFIGURE] = MavResult.DENIED
        with running_bridge(own_ros.domain, port, brightness=60) as bridge, light:
            bridge.wait_for('light 1/243 not configured: refused: MAV_RESULT_DENIED')

            Parameters(own_ros).wait(brightness=90.0)
            [line] = [line for line in bridge.lines if 'not configured' in line]
            assert line.startswith('[ERROR]')

    def test_one_that_the_light_cannot_do_leaves_the_others_alone(
        self, ros: Ros, port: int, light: ServedLight,
    ) -> None:
        with (running_bridge(ros.domain, port, brightness=60, strobe_period=20.0) as bridge,
              light):
            bridge.wait_for('light 1/243 not configured: strobe_period 20 s is outside what '
                            'the light reports: 0 (no strobe) or 0.05 to 10 s')
            bridge.wait_for('light 1/243 configured: brightness 60 %')

            assert [params(c) for c in light.commands(CONFIGURE)] == [(2.0, 60.0, 2.0, 10.0)]

    def test_they_are_tried_again_while_the_light_says_nothing(
        self, ros: Ros, port: int, light: ServedLight,
    ) -> None:
        light.fake.results[CONFIGURE] = None
        with running_bridge(ros.domain, port, brightness=60, command_retries=0) as bridge, light:
            light.wait_for(CONFIGURE)
            light.fake.results[CONFIGURE] = MavResult.ACCEPTED
            CLOCK.forward(2.0)

            bridge.wait_for('light 1/243 configured: brightness 60 %')
