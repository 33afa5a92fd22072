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

"""The log while lights are missing, found, changed and too hot: each fact once, and no flood."""

from collections.abc import Callable, Iterator
import socket
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from illuminator_ros.mavlink.messages import ComponentInformationBasic, heartbeat, MavType
import pytest
from support.fake_light import status_message
from support.frames import frame_of, spoilt
from support.light import Address, MavResult, ON_OFF, ServedLight
from support.processes import Program
from support.ros import Ros, running_bridge, STREAM
from support.slow import CLOCK
from support.waiting import eventually

AUTOPILOT = 2
FLOOD = 2000
# s before a missing light is logged.
NO_LIGHT_GRACE = 10.0
# s between two lines about the same flag, at least.
PAUSE = 5.0


@pytest.fixture(scope='module')
def settings() -> dict[str, float]:
    return {'diagnostics_period': 0.1}


def new_lines(bridge: Program, before: int, text: str) -> list[str]:
    return [line for line in bridge.lines[before:] if text in line]


def test_missing_light_is_logged_once_and_answers_name_the_likeliest_reason(
    own_ros: Ros, port: int,
) -> None:
    with (running_bridge(own_ros.domain, port, target_component=9) as bridge,
          socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger):
        CLOCK.forward(NO_LIGHT_GRACE)
        bridge.wait_for('no light connected: none heard yet on udp ')
        CLOCK.forward(5 * NO_LIGHT_GRACE)

        stranger.sendto(bytes(range(90)), ('127.0.0.1', port))
        while 'nothing is received' in (message := own_ros.enable().message):
            pass
        assert '90 bytes received, no valid frame; check the baud rate' in message
        stranger.sendto(frame_of(heartbeat(AUTOPILOT), source=Address(1, 1)), ('127.0.0.1', port))
        while 'no valid frame' in (message := own_ros.enable().message):
            pass
        assert '1 frames received, none from an illuminator' in message
        with ServedLight(port), ServedLight(port, source=Address(1, 244)):
            bridge.wait_for('light 1/243')
            bridge.wait_for('light 1/244')
            assert 'heard, none of which is the target' in own_ros.enable().message

        [line] = [line for line in bridge.lines if 'no light connected' in line]
        assert line.startswith('[WARN]')


@pytest.mark.parametrize(('flags', 'severity', 'text'), [
    (1, 'WARN', 'thermal throttling: dimmed because it is hot'),
    (2, 'ERROR', 'over temperature shutdown: switched off because it is too hot'),
    (4, 'WARN', 'thermistor failure: temperature sensor failed'),
    (8, 'WARN', 'unknown flags 0x8'),
])
def test_error_flag_is_logged_once_with_its_severity_and_once_when_it_is_cleared(
    ros: Ros, light: ServedLight, bridge: Program, flags: int, severity: str, text: str,
) -> None:
    before = len(bridge.lines)
    for _ in range(3):
        light.report(error_status=flags)
    ros.catch_up()
    ros.outlast(PAUSE, ['/illuminator'])
    light.report(error_status=0)
    bridge.wait_for(f'{text.partition(":")[0]} cleared')
    ros.catch_up()

    first, last = new_lines(bridge, before, 'light 1/243: ')
    assert first.startswith(f'[{severity}]') and first.endswith(f'light 1/243: {text}\n')
    assert last.startswith('[INFO]')


def another_identity(light: ServedLight, now: float, step: int) -> Any:
    return ComponentInformationBasic(0, 0, 0, b'maker', b'', b'', b'', b'%d' % step)


def another_uptime(light: ServedLight, now: float, step: int) -> Any:
    return status_message(1_000_000 * (step % 2), enable=step % 2)


def another_brightness(light: ServedLight, now: float, step: int) -> Any:
    return status_message(light.fake.uptime_ms(now) + step, brightness=50.0 + step % 50)


def another_flag(light: ServedLight, now: float, step: int) -> Any:
    return status_message(light.fake.uptime_ms(now) + step, error_status=step % 2)


@pytest.mark.parametrize('message', [
    another_identity, another_uptime, another_brightness, another_flag])
def test_flood_of_frames_is_not_a_flood_of_lines(
    own_ros: Ros, port: int, message: Callable[[ServedLight, float, int], Any],
) -> None:
    with running_bridge(own_ros.domain, port) as bridge, ServedLight(port, stream=0.0) as light:
        bridge.wait_for('light 1/243 is maker')
        own_ros.catch_up()
        before = len(bridge.lines)

        def send(now: float) -> None:
            for step in range(FLOOD):
                light.fake.send(message(light, now, step))

        light.do(send)
        own_ros.catch_up()

        assert 1 <= len(bridge.lines) - before < 40


@pytest.fixture
def counters(ros: Ros, bridge: Program) -> Iterator[Callable[[], dict[str, float]]]:
    """Return a function that reads the counters of the link."""
    recorder = ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)

    def read() -> dict[str, float]:
        recorder.clear()
        CLOCK.forward(0.1)
        link = recorder.wait(lambda array: len(array.status) == 2).status[0]
        return {value.key: float(value.value) for value in link.values
                if value.key not in ('url', 'open', 'node')}

    yield read


def test_counters_of_the_link_count_lost_and_spoilt_frames_and_resent_commands(
    ros: Ros, light: ServedLight, counters: Callable[[], dict[str, float]],
) -> None:
    light.fake.results[ON_OFF] = [None, MavResult.ACCEPTED]
    light.fake.stream = 0.0
    before = counters()

    call = ros.start_enable()
    light.wait_for(ON_OFF)
    CLOCK.forward(0.5)
    assert call.result().success
    light.lose_frames(5)
    light.report()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.sendto(spoilt(frame_of(heartbeat(MavType.ILLUMINATOR), source=Address(9, 9))),
                        ('127.0.0.1', light.port))
    ros.catch_up()

    expected = {'frames_lost': 5, 'crc_errors': 1, 'commands_resent': 1, 'commands_unanswered': 0}
    # Diagnostics may be made of an older snapshot once.
    eventually(lambda: {
        key: now - before[key] for key, now in counters().items() if key in expected} == expected)
    after = counters()
    assert after['commands_sent'] >= before['commands_sent'] + 2
    assert after['frames_sent'] > before['frames_sent']
