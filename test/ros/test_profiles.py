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

"""Simulated lights of each kind that is in use, with the real node over real UDP."""

from collections.abc import Iterator
from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
import pytest
from sensor_msgs.msg import Temperature
from std_msgs.msg import Bool, Float64
from support.ports import free_port
from support.processes import Program
from support.ros import own_domain, Parameters, Ros, running_bridge, running_simulator, STREAM
from support.slow import CLOCK


class Kind(NamedTuple):
    """A kind of light: the simulator's options, and its properties."""

    options: tuple[str, ...]
    address: str
    strobes: bool = True
    measures: bool = True
    vendor: str | None = 'illuminator_ros'


# Once a second would be each 20 s on the slow clock.
OFTEN = ('--status-interval', '0.01')
KINDS = {
    'reference': Kind(('--profile', 'reference', *OFTEN), '255/0', vendor='Illuminator Vendor'),
    'ardusub': Kind(('--profile', 'ardusub', *OFTEN), '1/1', strobes=False, measures=False,
                    vendor=None),
    'extended': Kind(('--profile', 'extended'), '1/243'),
    'bitmask of enum values': Kind(('--mode-bitmask', '3'), '1/243'),
    'bitmask of shifted bits': Kind(('--mode-bitmask', '6'), '1/243'),
    'bitmask of one mode': Kind(('--mode-bitmask', '1'), '1/243'),
    'status on request': Kind(('--status-interval', '0'), '1/243'),
}


@pytest.fixture(scope='module', params=KINDS)
def kind(request: pytest.FixtureRequest) -> Kind:
    """Return each kind in turn."""
    return KINDS[request.param]


@pytest.fixture(scope='module')
def domain(kind: Kind) -> Iterator[int]:
    """Claim a ROS domain for each kind: its bridge must not meet the one before."""
    with own_domain() as domain:
        yield domain


@pytest.fixture(scope='module')
def kind_bridge(kind: Kind, domain: int, ros: Ros) -> Iterator[Program]:
    """Run a bridge and a simulated light, and wait until its parameters are there."""
    port = free_port()
    with (running_bridge(domain, port) as bridge,
          running_simulator(f'udpout://127.0.0.1:{port}', '--plain', *kind.options)):
        bridge.wait_for(f'light {kind.address} connected')
        Parameters(ros).wait(mode='internal_control')
        yield bridge


def lamp(ros: Ros) -> dict[str, str]:
    """Return the values of the lamp's status."""
    recorder = ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
    CLOCK.forward(1.0)
    array = recorder.wait(lambda array: len(array.status) == 2)
    return {value.key: value.value for value in array.status[1].values}


def test_light_is_switched_and_that_is_confirmed(ros: Ros, kind_bridge: Program) -> None:
    for on in (True, False):
        response = ros.enable(on)
        assert response.success
        assert 'confirmed by ILLUMINATOR_STATUS: MAV_RESULT_ACCEPTED' in response.message
        ros.subscribe(Bool, '/illuminator/enabled').wait_value(on)


def test_light_is_configured_and_refuses_only_what_it_cannot_do(
    ros: Ros, kind: Kind, kind_bridge: Program,
) -> None:
    parameters = Parameters(ros)
    assert parameters.set(brightness=55.0)[0].successful
    for name, value, before in (('strobe_period', 1.0, 0.0),
                                ('mode', 'external_sync', 'internal_control')):
        # A mode is never refused for the bitmask: ArduSub has no other, and says so itself.
        (result,) = parameters.set(**{name: value})
        assert result.successful is kind.strobes
        assert kind.strobes or 'MAV_RESULT_DENIED' in result.reason
        assert parameters.get(name) == [value if kind.strobes else before]
        assert parameters.set(mode='internal_control')[0].successful
    assert parameters.get('brightness') == [55.0]


def test_temperature_and_strobe_limits_of_zero_are_not_taken_for_measured_values(
    ros: Ros, kind: Kind, kind_bridge: Program,
) -> None:
    temperatures = ros.subscribe(Temperature, '/illuminator/temperature', STREAM)
    uptimes = ros.subscribe(Float64, '/illuminator/uptime', STREAM)
    uptimes.clear()
    for count in (1, 2, 3):
        assert ros.refresh().success
        uptimes.wait(count=count)
    if kind.measures:
        temperatures.wait(lambda message: message.temperature > 0)

    assert bool(temperatures.messages) is kind.measures
    assert ('temperature_c' in lamp(ros)) is kind.measures
    (descriptor,) = Parameters(ros).describe('strobe_period')
    (span,) = descriptor.floating_point_range
    assert span.to_value == (10.0 if kind.measures else 3600.0)


def test_identity_is_shown_as_the_light_reports_it(
    ros: Ros, kind: Kind, kind_bridge: Program,
) -> None:
    values = lamp(ros)
    assert (values['address'], values.get('vendor')) == (kind.address, kind.vendor)
    # 28 characters in a field of 24, so it has no terminator.
    if kind.address == '255/0':
        assert values['software_version'] == 'Illuminator Software Ver'


def test_light_is_neither_lost_nor_taken_for_restarted_or_for_several(
    kind_bridge: Program,
) -> None:
    assert [text for text in ('lost', 'restarted', 'several') if kind_bridge.count(text)] == []
