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

"""When ``/diagnostics`` warns and when it reports an error, and that it does so at once."""

from collections.abc import Iterator
import math
import socket

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from illuminator_ros.mavlink.messages import heartbeat, MavType
import pytest
from support.light import Address, CONFIGURE, MavResult, ServedLight
from support.ros import Parameters, Ros, running_bridge, STREAM
from support.slow import CLOCK, pass_time_until

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


class Diagnostics:
    """The published statuses of one node's link and lamp."""

    def __init__(self, ros: Ros) -> None:
        self.recorder = ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)

    def wait(self, part: str, level: bytes, text: str) -> DiagnosticStatus:
        """Wait until a part has a level, and a message with this text."""
        def find(array: DiagnosticArray) -> list[DiagnosticStatus]:
            return [status for status in array.status if status.name.endswith(f': {part}')
                    and status.level == level and text in status.message]

        return find(self.recorder.wait(find))[0]


@pytest.fixture(scope='module')
def settings() -> dict[str, float]:
    """Publish periodically so rarely that only changes of level are seen soon."""
    return {'diagnostics_period': 60.0}


@pytest.fixture(scope='module')
def recorded(ros: Ros, shared_bridge: object, parameters: Parameters) -> Diagnostics:
    return Diagnostics(ros)


@pytest.fixture
def diagnostics(light: ServedLight, recorded: Diagnostics) -> Iterator[Diagnostics]:
    """Return the diagnostics of a light without faults, before and after the test."""
    recorded.recorder.clear()
    yield recorded
    light.behave()
    light.report(enable=0, error_status=0, brightness=100.0, temp_c=25.0)


@pytest.mark.parametrize(('report', 'level', 'text'), [
    ({'error_status': 1}, WARN, 'dimmed because it is hot'),
    ({'error_status': 2}, ERROR, 'switched off because it is too hot'),
    ({'error_status': 4}, WARN, 'temperature sensor failed'),
    ({'error_status': 3}, ERROR, 'switched off because it is too hot; dimmed because it is hot'),
    ({'error_status': 8}, WARN, 'unknown flags 0x8'),
    ({'error_status': 0x80000000}, WARN, 'unknown flags 0x80000000'),
    ({'brightness': math.nan}, WARN, 'implausible: brightness nan'),
    ({'temp_c': math.inf}, WARN, 'implausible: temp_c inf'),
])
def test_fault_in_a_status_is_published_at_once_and_so_is_its_end(
    light: ServedLight, diagnostics: Diagnostics, report: dict[str, float], level: bytes,
    text: str,
) -> None:
    light.report(**report)
    assert diagnostics.wait('lamp', level, text).message == text
    diagnostics.recorder.clear()

    light.report(enable=1, error_status=0, brightness=100.0, temp_c=25.0)

    diagnostics.wait('lamp', OK, 'on')


def test_accepted_configuration_that_the_light_does_not_show_is_a_warning(
    ros: Ros, light: ServedLight, diagnostics: Diagnostics, parameters: Parameters,
) -> None:
    light.fake.applies = False

    call = parameters.start_set(brightness=30.0)
    light.wait_for(CONFIGURE)
    ros.catch_up()
    CLOCK.forward(0.9)
    assert not call.result().results[0].successful

    status = diagnostics.wait('lamp', WARN, 'brightness 30 % not confirmed')
    assert 'ILLUMINATOR_STATUS shows brightness 100 %' in status.message
    light.report(brightness=30.0)
    diagnostics.wait('lamp', OK, 'off')


def test_refused_set_is_not_a_warning(
    light: ServedLight, diagnostics: Diagnostics, parameters: Parameters,
) -> None:
    light.fake.results[CONFIGURE] = MavResult.DENIED

    parameters.set(brightness=31.0)
    light.report(error_status=2)

    diagnostics.wait('lamp', ERROR, 'too hot')
    assert WARN not in [array.status[1].level for array in diagnostics.recorder.messages]


def test_lost_frames_are_a_warning(light: ServedLight, diagnostics: Diagnostics) -> None:
    light.lose_frames(100)
    light.report()

    diagnostics.wait('link', WARN, '% of the frames lost')


def test_another_sender_with_our_address_is_an_error(
    light: ServedLight, diagnostics: Diagnostics,
) -> None:
    light.send(heartbeat(MavType.ONBOARD_CONTROLLER), Address(1, 194))

    diagnostics.wait('link', ERROR, 'another sender uses our address 1/194')


def test_missing_light_is_a_warning_with_its_duration_and_an_error_after_ten_seconds(
    own_ros: Ros, port: int,
) -> None:
    with running_bridge(own_ros.domain, port):
        diagnostics = Diagnostics(own_ros)

        CLOCK.forward(8.0)
        diagnostics.wait('link', WARN, 'no light connected for 8')
        CLOCK.forward(2.0)
        diagnostics.wait('link', ERROR, 'no light connected for 10')
        assert {len(array.status) for array in diagnostics.recorder.messages} == {1}


def test_link_that_is_not_open_is_an_error_with_its_reason(own_ros: Ros, port: int) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as occupant:
        occupant.bind(('127.0.0.1', port))
        with running_bridge(own_ros.domain, port, until='link not open'):
            diagnostics = Diagnostics(own_ros)
            CLOCK.forward(1.0)
            diagnostics.wait(
                'link', ERROR, f'not open: cannot listen on 127.0.0.1:{port}: Address '
                'already in use; no light connected')


def test_lost_light_is_an_error_until_it_is_heard_again(own_ros: Ros, port: int) -> None:
    with running_bridge(own_ros.domain, port) as bridge, ServedLight(port) as light:
        bridge.wait_for('connected')
        diagnostics = Diagnostics(own_ros)
        CLOCK.forward(1.0)
        diagnostics.wait('lamp', OK, 'off')

        light.fake.silent = True
        pass_time_until(lambda: bridge.count('lost'))
        diagnostics.wait('lamp', ERROR, 'light 1/243 is lost: no heartbeat for ')

        diagnostics.recorder.clear()
        light.fake.silent = False
        CLOCK.forward(1.0)
        diagnostics.wait('lamp', OK, 'off')
