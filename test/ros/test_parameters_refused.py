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

"""A light that does not take a configuration: refused in time, and nothing changes."""

import pytest
from support.light import CONFIGURE, MavResult, ServedLight
from support.ros import Parameters, Ros, running_bridge

# s; rqt_reconfigure gives up after 1.0 s.
LIMIT = 0.9


@pytest.fixture(autouse=True)
def start(light: ServedLight, parameters: Parameters) -> None:
    """Have every test begin with the same configuration."""
    light.report(mode=1, brightness=80.0, strobe_period=0.0, strobe_duty_cycle=0.0)
    parameters.wait(brightness=80.0, strobe_period=0.0)


@pytest.mark.parametrize('result', [
    MavResult.DENIED, MavResult.UNSUPPORTED, MavResult.FAILED, MavResult.CANCELLED,
])
class TestRefusal:
    def test_it_is_told_by_name(
        self, light: ServedLight, parameters: Parameters, result: MavResult,
    ) -> None:
        light.fake.results[CONFIGURE] = result

        [outcome] = parameters.set(brightness=30.0)

        assert not outcome.successful
        assert outcome.reason.startswith(f'refused: MAV_RESULT_{result.name} (1 try, ')
        assert parameters.get('brightness') == [80.0]

    def test_an_atomic_set_changes_nothing(
        self, light: ServedLight, parameters: Parameters, result: MavResult,
    ) -> None:
        light.fake.results[CONFIGURE] = result

        outcome = parameters.set_atomically(brightness=30.0, strobe_period=1.0)

        assert not outcome.successful
        assert outcome.reason.startswith(f'refused: MAV_RESULT_{result.name}')
        assert parameters.get('brightness', 'strobe_period') == [80.0, 0.0]


def test_all_of_a_list_are_refused_together(
    light: ServedLight, parameters: Parameters,
) -> None:
    light.fake.results[CONFIGURE] = MavResult.DENIED

    results = parameters.set(brightness=30.0, strobe_period=1.0)

    assert [result.successful for result in results] == [False, False]
    assert results[0].reason == results[1].reason


def test_a_refusal_makes_no_parameter_event(
    light: ServedLight, parameters: Parameters,
) -> None:
    events = parameters.events()
    light.fake.results[CONFIGURE] = [MavResult.DENIED, MavResult.ACCEPTED]

    parameters.set(brightness=30.0)
    parameters.set(brightness=31.0)

    event = events.wait()
    assert [p.value.double_value for p in event.changed_parameters] == [31.0]


def test_what_the_node_keeps_itself_is_taken_back_with_a_refused_atomic_set(
    light: ServedLight, parameters: Parameters,
) -> None:
    light.fake.results[CONFIGURE] = MavResult.DENIED

    outcome = parameters.set_atomically(use_sim_time=True, brightness=30.0)

    assert not outcome.successful
    assert parameters.get('use_sim_time', 'brightness') == [False, 80.0]


class TestInTime:

    @pytest.mark.parametrize('atomically', [False, True])
    def test_a_light_that_says_nothing(
        self, light: ServedLight, parameters: Parameters, atomically: bool,
    ) -> None:
        light.fake.results[CONFIGURE] = None
        call = parameters.start_set(atomically=atomically, brightness=30.0)

        response = call.result()

        result = response.result if atomically else response.results[0]
        assert not result.successful
        assert result.reason.startswith('no acknowledgement (')
        assert call.elapsed < LIMIT
        assert parameters.get('brightness') == [80.0]

    def test_a_light_that_goes_on_asking_for_patience(
        self, light: ServedLight, parameters: Parameters,
    ) -> None:
        light.fake.results[CONFIGURE] = MavResult.TEMPORARILY_REJECTED
        call = parameters.start_set(brightness=30.0)

        [result] = call.result().results

        assert not result.successful
        assert 'MAV_RESULT_TEMPORARILY_REJECTED' in result.reason
        assert call.elapsed < LIMIT

    def test_a_light_that_accepts_and_does_not_show_it(
        self, light: ServedLight, parameters: Parameters,
    ) -> None:
        light.fake.applies = False
        call = parameters.start_set(brightness=30.0)

        [result] = call.result().results

        assert not result.successful
        assert result.reason.startswith(
            'brightness 30 % not confirmed: MAV_RESULT_ACCEPTED, but ILLUMINATOR_STATUS shows '
            'brightness 80 %')
        assert call.elapsed < LIMIT
        assert parameters.get('brightness') == [80.0]

    def test_two_sets_for_a_light_that_says_nothing(
        self, light: ServedLight, parameters: Parameters,
    ) -> None:
        light.fake.results[CONFIGURE] = None
        calls = [parameters.start_set(brightness=value) for value in (30.0, 31.0)]

        for call in calls:
            call.result()

        assert max(call.elapsed for call in calls) < LIMIT


class TestNoLight:
    def test_it_is_refused_at_once_where_none_was_ever_heard(
        self, own_ros: Ros, port: int,
    ) -> None:
        with running_bridge(own_ros.domain, port):
            parameters = Parameters(own_ros)
            call = parameters.start_set(brightness=30.0)

            [result] = call.result().results

            assert not result.successful
            assert result.reason == (
                f'no light connected: none heard yet on udp 127.0.0.1:{port}: '
                'nothing comes in')
            assert call.elapsed < 0.3
            assert parameters.get('brightness') == [None]

    def test_it_is_refused_at_once_where_it_is_lost(self, own_ros: Ros, port: int) -> None:
        with (running_bridge(own_ros.domain, port, heartbeat_timeout=1.1) as bridge,
              ServedLight(port, brightness=80.0) as light):
            parameters = Parameters(own_ros)
            parameters.wait(brightness=80.0)
            light.fake.silent = True
            bridge.wait_for('lost')
            call = parameters.start_set(brightness=30.0)

            [result] = call.result().results

            assert not result.successful
            assert result.reason.startswith('light 1/243 is lost: no heartbeat for 1.')
            assert call.elapsed < 0.3
            assert parameters.get('brightness') == [80.0]


class TestLightWithoutStatus:
    """A light that never tells what it is configured to be."""

    @pytest.fixture
    def silent(self, own_ros: Ros, port: int) -> ServedLight:
        light = ServedLight(port, stream=0.0)
        light.fake.pushes = False
        light.fake.answers.clear()
        return light

    def test_all_four_in_one_call_are_accepted(
        self, own_ros: Ros, port: int, silent: ServedLight,
    ) -> None:
        with running_bridge(own_ros.domain, port) as bridge, silent:
            bridge.wait_for('connected')
            parameters = Parameters(own_ros)

            results = parameters.set(mode='internal_control', brightness=30.0,
                                     strobe_period=0.0, strobe_duty_cycle=0.0)

            assert all(result.successful for result in results)
            assert parameters.get('brightness') == [30.0]

    def test_fewer_are_refused_since_the_rest_is_unknown(
        self, own_ros: Ros, port: int, silent: ServedLight,
    ) -> None:
        with running_bridge(own_ros.domain, port) as bridge, silent:
            bridge.wait_for('connected')

            [result] = Parameters(own_ros).set(brightness=30.0)

            assert not result.successful
            assert ('mode, strobe_period, strobe_duty_cycle must be set in the same call'
                    in result.reason)
            assert silent.commands(CONFIGURE) == []
