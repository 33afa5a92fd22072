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

"""Two lights behind one component, as the operator sees them (DESIGN.md, 3.6)."""

from collections.abc import Iterator

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from illuminator_ros.mavlink.url import parse_url
import pytest
from std_msgs.msg import Bool
from support.fake_light import FakeLight
from support.light import Address
from support.ports import free_port
from support.processes import Program
from support.ros import Parameters, Ros, running_bridge, STREAM
from support.shared_address import SharedAddress
from support.slow import CLOCK, SlowLink, SPEED

SHARED = 'several lights answer as 1/1: their statuses contradict one another'


@pytest.fixture(scope='module')
def contradiction(domain: int) -> Iterator[tuple[Program, SharedAddress]]:
    """Run a bridge and an autopilot with two lights, one on and one off."""
    port = free_port()
    url = f'udpout://127.0.0.1:{port}'
    lights = SharedAddress(
        FakeLight(Address(1, 1), heartbeat_type=None, stream=0.1 * SPEED, brightness=100.0),
        FakeLight(Address(1, 1), heartbeat_type=None, stream=0.1 * SPEED, enable=1,
                  brightness=40.0))
    with running_bridge(domain, port) as bridge:
        link = SlowLink(parse_url(url), lights, label=url)
        link.start()
        bridge.wait_for('several lights answer as 1/1: parameters stay as they are')
        yield bridge, lights
        link.stop()


def test_diagnostics_warn_of_it(
    ros: Ros, contradiction: tuple[Program, SharedAddress],
) -> None:
    def warned(array: DiagnosticArray) -> bool:
        return any(status.name == 'illuminator: lamp' and status.level == DiagnosticStatus.WARN
                   and SHARED in status.message for status in array.status)

    recorder = ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
    CLOCK.forward(1.0)
    recorder.wait(warned)


def test_topics_go_on_to_show_each_status(
    ros: Ros, contradiction: tuple[Program, SharedAddress],
) -> None:
    enabled = ros.subscribe(Bool, '/illuminator/enabled', STREAM)
    enabled.wait(count=20)
    assert set(enabled.values) == {False, True}


def test_parameters_do_not_flap(
    ros: Ros, contradiction: tuple[Program, SharedAddress],
) -> None:
    events = Parameters(ros).events()
    enabled = ros.subscribe(Bool, '/illuminator/enabled', STREAM)
    enabled.wait(count=30)
    assert events.messages == []
    assert contradiction[0].count('was changed') <= 1


def test_a_set_reaches_both_and_is_shown(
    ros: Ros, contradiction: tuple[Program, SharedAddress],
) -> None:
    assert Parameters(ros).set(brightness=60.0)[0].successful
    assert [light.fields['brightness'] for light in contradiction[1].lights] == [60.0, 60.0]
    assert Parameters(ros).get('brightness') == [60.0]
