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

"""With ``off_on_shutdown`` the light goes dark with the node, within the second that it has."""

from collections.abc import Callable, Iterator
import contextlib
import signal

from illuminator_ros.ros import bridge as bridge_module
import pytest
from std_srvs.srv import SetBool
from support.embedded import embedded_bridge
from support.light import Address, CONFIGURE, eventually, MavResult, ON_OFF, ServedLight
from support.processes import Program
from support.ros import Parameters, Ros, start_bridge, start_slow_bridge
from support.slow import CLOCK, pass_time_until
from support.waiting import PATIENCE


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


def goes_off(light: ServedLight) -> None:
    # The bridge does not wait for it beyond its end.
    eventually(lambda: light.fake.fields['enable'] == 0)


def ends(program: Program, number: int = signal.SIGTERM) -> bool:
    return program.end(number) == 0 and 'Traceback' not in program.log


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_the_light_is_switched_off(own_ros: Ros, port: int, number: int) -> None:
    with lit(own_ros, port) as (program, light):
        assert ends(program, number)

        goes_off(light)


def test_every_light_is_switched_off(own_ros: Ros, port: int) -> None:
    with (lit(own_ros, port) as (program, light),
          ServedLight(port, source=Address(1, 244), enable=1) as other):
        Parameters(own_ros, '/illuminator_1_244').wait(brightness=100.0)

        assert ends(program)

        goes_off(light)
        goes_off(other)


def test_without_it_the_light_is_left_as_it_is(own_ros: Ros, port: int) -> None:
    with lit(own_ros, port, off_on_shutdown=False) as (program, light):
        assert ends(program)

        assert light.commands(ON_OFF) == []


def test_a_lost_command_is_sent_again(
    own_ros: Ros, port: int, monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(bridge_module, 'OFF_LIMIT', PATIENCE)
    with (ServedLight(port, enable=1) as light,
          embedded_bridge(own_ros.domain, port, off_on_shutdown=True) as bridge):
        Parameters(own_ros).wait(brightness=100.0)
        light.fake.results[ON_OFF] = [None, MavResult.ACCEPTED]

        bridge.end()
        light.wait_for(ON_OFF)
        CLOCK.forward(0.5)

        goes_off(light)


def test_a_light_that_says_nothing_does_not_hold_the_node(own_ros: Ros, port: int) -> None:
    with lit(own_ros, port, start=start_bridge) as (program, light):
        light.fake.results[ON_OFF] = None

        assert ends(program)


@pytest.mark.parametrize(('result', 'limit', 'line'), [
    (MavResult.ACCEPTED, PATIENCE, '[INFO] light 1/243 is off: off, confirmed'),
    (MavResult.DENIED, PATIENCE,
     '[ERROR] light 1/243 may still be on: refused: MAV_RESULT_DENIED (1 try, '),
    (None, 0.05, '[ERROR] light 1/243 may still be on: no confirmation within 50 ms'),
])
def test_the_log_says_what_became_of_it(
    own_ros: Ros, port: int, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str],
    result: int | None, limit: float, line: str,
) -> None:
    monkeypatch.setattr(bridge_module, 'OFF_LIMIT', limit)
    with (ServedLight(port, enable=1) as light,
          embedded_bridge(own_ros.domain, port, off_on_shutdown=True)):
        Parameters(own_ros).wait(brightness=100.0)
        light.fake.results[ON_OFF] = result

    severity, text = line.split(' ', 1)
    assert [found for found in ''.join(capfd.readouterr()).splitlines()
            if found.startswith(severity) and text in found]


def test_requests_that_the_light_takes_long_for_do_not_hold_it_up(
    own_ros: Ros, port: int,
) -> None:
    with lit(own_ros, port) as (program, light):
        light.fake.results[ON_OFF] = [MavResult.IN_PROGRESS, MavResult.ACCEPTED]
        light.fake.results[CONFIGURE] = MavResult.IN_PROGRESS
        own_ros.start(SetBool, '/illuminator/enable', SetBool.Request(data=True))
        own_ros.start(SetBool, '/illuminator/enable', SetBool.Request(data=True))
        Parameters(own_ros).start_set(brightness=20.0)
        light.wait_for(ON_OFF)
        light.wait_for(CONFIGURE)

        assert ends(program)

        goes_off(light)
        assert [command.param1 for command in light.commands(ON_OFF)] == [1.0, 0.0]


def test_a_lost_light_is_not_waited_for(own_ros: Ros, port: int) -> None:
    with lit(own_ros, port) as (program, light):
        light.fake.silent = True
        pass_time_until(lambda: program.count('lost'))

        assert ends(program)

        assert light.commands(ON_OFF) == []
        assert program.count('light 1/243 may still be on: light 1/243 is lost: no heartbeat')
