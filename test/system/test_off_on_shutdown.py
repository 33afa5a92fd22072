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

"""With ``off_on_shutdown`` the node switches off every light at its end, within 1 s."""

from collections.abc import Callable, Iterator
import contextlib
import signal

import pytest
from rcl_interfaces.srv import GetParameters
from support.light import Address, MavResult, ON_OFF, ServedLight
from support.processes import Program
from support.ros import Parameters, Ros, start_bridge, start_slow_bridge
from support.waiting import eventually


@contextlib.contextmanager
def lit(
    ros: Ros, port: int, start: Callable[..., Program] = start_slow_bridge, **parameters: object,
) -> Iterator[tuple[Program, ServedLight]]:
    """Run a bridge with a light that is on."""
    with ServedLight(port, enable=1) as light:
        program = start(ros.domain, port, **{'off_on_shutdown': True, **parameters})
        try:
            Parameters(ros).wait(brightness=100.0)
            yield program, light
        finally:
            program.kill()


def assert_goes_off(light: ServedLight) -> None:
    # The light may go off after the end of the bridge.
    eventually(lambda: light.fake.fields['enable'] == 0)


def assert_ends(program: Program, number: int = signal.SIGTERM) -> None:
    assert (program.end(number), 'Traceback' in program.log) == (0, False), program.log


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_every_light_is_switched_off_and_named(own_ros: Ros, port: int, number: int) -> None:
    with (lit(own_ros, port) as (program, light),
          ServedLight(port, source=Address(1, 244), enable=1) as other):
        Parameters(own_ros, '/illuminator_1_244').wait(brightness=100.0)

        assert_ends(program, number)

        for one in (light, other):
            assert_goes_off(one)
            assert program.count(f'light {one.fake.source} is off: off, confirmed') == 1
        assert program.count('was switched') == 0


def test_light_is_left_on_with_a_warning_without_the_parameter(own_ros: Ros, port: int) -> None:
    with lit(own_ros, port, off_on_shutdown=False) as (program, light):
        assert_ends(program)

        assert light.commands(ON_OFF) == []
        [line] = [line for line in program.lines if 'light 1/243 is left on' in line]
        assert line.startswith('[WARN]')


@pytest.mark.parametrize(('start', 'result', 'line'), [
    (start_slow_bridge, MavResult.DENIED, 'refused: MAV_RESULT_DENIED (1 try, '),
    (start_bridge, None, 'no confirmation within '),
])
def test_light_that_is_not_confirmed_off_is_an_error_that_does_not_delay_the_end(
    own_ros: Ros, port: int, start: Callable[..., Program], result: int | None, line: str,
) -> None:
    with lit(own_ros, port, start=start) as (program, light):
        light.fake.results[ON_OFF] = result

        assert_ends(program)

        line = f'light 1/243 may still be on: {line}'
        assert [found[:7] for found in program.lines if line in found] == ['[ERROR]']


def test_busy_executor_does_not_prevent_it(own_ros: Ros, port: int) -> None:
    with lit(own_ros, port, start=start_bridge) as (program, light):
        own_ros.start(GetParameters, '/illuminator/get_parameters',
                      GetParameters.Request(names=['x'] * 1_000_000))

        assert_ends(program)

        assert_goes_off(light)
