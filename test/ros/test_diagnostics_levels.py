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

"""When ``/diagnostics`` warns, and when it calls an error (DESIGN.md, 3.5)."""

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
    """What was published of one node's link and lamp."""

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
    """Have diagnostics so rarely that what comes soon has come because a level changed."""
    return {'diagnostics_period': 60.0}


@pytest.fixture(scope='module')
def diagnostics(ros: Ros, shared_bridge: object, parameters: Parameters) -> Diagnostics:
    return Diagnostics(ros)


@pytest.fixture(autouse=True)
def good(light: ServedLight, diagnostics: Diagnostics) -> Iterator[None]:
    """Have each test begin and end with nothing to complain of."""
    yield
    light.behave()
    light.report(enable=0, error_status=0, brightness=100.0, temp_c=25.0)


def test_a_good_light_is_ok_and_off_or_on(light: ServedLight, diagnostics: Diagnostics) -> None:
    light.report(error_status=1)
    light.report(error_status=0, enable=0)
    diagnostics.wait('lamp', OK, 'off')
    light.report(error_status=1)
    light.report(error_status=0, enable=1)
    diagnostics.wait('lamp', OK, 'on')


@pytest.mark.parametrize(('report', 'level', 'text'), [
    ({'error_status': 1}, WARN, 'dimmed because it is hot'),
    ({'error_status': 2}, ERROR, 'switched off because it is too hot'),
    ({'error_status': 4}, WARN, 'temperature sensor failed'),
    ({'error_status': 3}, ERROR, 'switched off because it is too hot; dimmed because it is hot'),
    ({'error_status': 8}, WARN, 'unknown flags 0x8'),
    ({'error_status': 0x80000000}, WARN, 'unknown flags 0x80000000'),
    ({'brightness': math.nan}, WARN, 'not believable: brightness nan'),
    ({'temp_c': math.inf}, WARN, 'not believable: temp_c inf'),
])
def test_what_a_status_says_is_told_at_once(
    light: ServedLight, diagnostics: Diagnostics, report: dict[str, float], level: bytes,
    text: str,
) -> None:
    diagnostics.recorder.clear()

    light.report(**report)

    assert diagnostics.wait('lamp', level, text).message == text


def test_the_return_to_ok_is_told_at_once(light: ServedLight, diagnostics: Diagnostics) -> None:
    light.report(error_status=2)
    diagnostics.wait('lamp', ERROR, 'too hot')
    diagnostics.recorder.clear()

    light.report(error_status=0)

    diagnostics.wait('lamp', OK, 'off')


def test_a_light_that_does_not_show_what_it_accepted_is_warned_about(
    ros: Ros, light: ServedLight, diagnostics: Diagnostics, parameters: Parameters,
) -> None:
    light.fake.applies = False
    diagnostics.recorder.clear()

    call = parameters.start_set(brightness=30.0)
    light.wait_for(CONFIGURE)
    ros.catch_up()
    CLOCK.forward(0.9)
    assert not call.result().results[0].successful

    status = diagnostics.wait('lamp', WARN, 'brightness 30 % not confirmed')
    assert 'ILLUMINATOR_STATUS shows brightness 100 %' in status.message
    light.report(brightness=30.0)
    diagnostics.wait('lamp', OK, 'off')


def test_a_refused_set_is_no_reason_to_warn(
    light: ServedLight, diagnostics: Diagnostics, parameters: Parameters,
) -> None:
    light.fake.results[CONFIGURE] = MavResult.DENIED
    diagnostics.recorder.clear()

    parameters.set(brightness=31.0)
    light.report(error_status=2)

    diagnostics.wait('lamp', ERROR, 'too hot')
    levels = [array.status[1].level for array in diagnostics.recorder.messages]
    assert WARN not in levels


def test_lost_frames_are_warned_about(light: ServedLight, diagnostics: Diagnostics) -> None:
    diagnostics.recorder.clear()

    light.lose_frames(100)
    light.report()

    diagnostics.wait('link', WARN, '% of the frames lost')


def test_somebody_else_with_our_address_is_an_error(
    light: ServedLight, diagnostics: Diagnostics,
) -> None:
    diagnostics.recorder.clear()

    light.send(heartbeat(MavType.ONBOARD_CONTROLLER), Address(1, 194))

    diagnostics.wait('link', ERROR, 'another sender uses our address 1/194')


class TestNoLight:

    def test_it_is_an_error_after_a_grace_of_ten_seconds(self, own_ros: Ros, port: int) -> None:
        with running_bridge(own_ros.domain, port):
            diagnostics = Diagnostics(own_ros)

            CLOCK.forward(8.0)
            diagnostics.wait('link', WARN, 'no light connected for 8')
            CLOCK.forward(2.0)
            diagnostics.wait('link', ERROR, 'no light connected for 10')

    def test_the_warning_tells_how_long(self, own_ros: Ros, port: int) -> None:
        with running_bridge(own_ros.domain, port):
            diagnostics = Diagnostics(own_ros)
            CLOCK.forward(1.0)
            diagnostics.wait('link', WARN, 'no light connected for ')

    def test_there_is_no_lamp_yet(self, own_ros: Ros, port: int) -> None:
        with running_bridge(own_ros.domain, port):
            recorder = Diagnostics(own_ros).recorder
            CLOCK.forward(1.0)
            array = recorder.wait()

            assert [status.name for status in array.status] == ['illuminator: link']

    def test_a_link_that_is_not_open_is_an_error(self, own_ros: Ros, port: int) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as occupant:
            occupant.bind(('127.0.0.1', port))
            with running_bridge(own_ros.domain, port, until='link not open'):
                diagnostics = Diagnostics(own_ros)
                CLOCK.forward(1.0)
                diagnostics.wait(
                    'link', ERROR, f'not open: cannot listen on 127.0.0.1:{port}: Address '
                    'already in use; no light connected')

    def test_a_lost_one_is_an_error_and_not_stale(self, own_ros: Ros, port: int) -> None:
        with (running_bridge(own_ros.domain, port) as bridge,
              ServedLight(port) as light):
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
