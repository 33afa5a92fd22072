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

"""Lights of the field, simulated, with the real node over real UDP (doc/lights.md)."""

from collections.abc import Callable, Iterator
import contextlib
from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
import pytest
from sensor_msgs.msg import Temperature
from std_msgs.msg import Bool, Float64
from std_srvs.srv import SetBool, Trigger
from support.ports import free_port
from support.processes import Program
from support.ros import own_domain, Parameters, Ros, running_bridge, running_simulator, STREAM
from support.slow import CLOCK

ENABLED = 'confirmed by ILLUMINATOR_STATUS: MAV_RESULT_ACCEPTED'


class Kind(NamedTuple):
    """A kind of light: how it is simulated, and what it is like."""

    options: tuple[str, ...]
    address: str
    strobes: bool = True
    measures: bool = True
    vendor: str | None = 'illuminator_ros'


KINDS = {
    'reference': Kind(('--profile', 'reference'), '255/0', vendor='Illuminator Vendor'),
    'ardusub': Kind(('--profile', 'ardusub'), '1/1', strobes=False, measures=False, vendor=None),
    'extended': Kind(('--profile', 'extended'), '1/243'),
    'bitmask of enum values': Kind(('--mode-bitmask', '3'), '1/243'),
    'bitmask of shifted bits': Kind(('--mode-bitmask', '6'), '1/243'),
    'bitmask of one mode': Kind(('--mode-bitmask', '1'), '1/243'),
    'status on request': Kind(('--status-interval', '0'), '1/243'),
}


@pytest.fixture(scope='module', params=KINDS)
def kind_name(request: pytest.FixtureRequest) -> str:
    """Return the name of each kind in turn."""
    return str(request.param)


@pytest.fixture(scope='module')
def domain(kind_name: str) -> Iterator[int]:
    """Claim a ROS domain for each kind: a bridge is not to be mixed up with the one before."""
    with own_domain() as domain:
        yield domain


@pytest.fixture(scope='module')
def kind(kind_name: str, domain: int) -> Iterator[tuple[Kind, Program]]:
    """Run a bridge and a simulated light of each kind."""
    kind, port = KINDS[kind_name], free_port()
    url = f'udpout://127.0.0.1:{port}'
    with contextlib.ExitStack() as stack:
        bridge = stack.enter_context(running_bridge(domain, port))
        stack.enter_context(running_simulator(url, '--plain', *kind.options))
        bridge.wait_for(f'light {kind.address} connected')
        yield kind, bridge


@pytest.fixture
def parameters(ros: Ros, kind: tuple[Kind, Program]) -> Parameters:
    """Return the parameters of the bridge, which the light has reported."""
    parameters = Parameters(ros)
    parameters.wait(mode='internal_control')
    return parameters


@pytest.fixture
def refresh(ros: Ros) -> Callable[[], Any]:
    """Return a function that has the light report again."""
    return lambda: ros.call(Trigger, '/illuminator/refresh', Trigger.Request())


def enable(ros: Ros, on: bool) -> SetBool.Response:
    return ros.call(SetBool, '/illuminator/enable', SetBool.Request(data=on))


def lamp(ros: Ros) -> dict[str, str]:
    """Return the values of the lamp's status."""
    recorder = ros.subscribe(DiagnosticArray, '/diagnostics', STREAM)
    CLOCK.forward(1.0)
    array = recorder.wait(
        lambda array: any(status.name == 'illuminator: lamp' for status in array.status))
    return {value.key: value.value for value in array.status[1].values}


@pytest.mark.parametrize('on', [True, False])
def test_it_is_switched_and_that_is_verified(
    ros: Ros, parameters: Parameters, on: bool,
) -> None:
    response = enable(ros, on)
    assert (response.success, ENABLED in response.message) == (True, True)
    ros.subscribe(Bool, '/illuminator/enabled').wait_value(on)


def test_it_is_configured_and_that_is_verified(ros: Ros, parameters: Parameters) -> None:
    assert parameters.set(brightness=55.0)[0].successful
    assert parameters.get('brightness') == [55.0]


def test_what_it_cannot_do_is_refused_by_the_light_and_the_parameter_keeps_its_value(
    parameters: Parameters, kind: tuple[Kind, Program],
) -> None:
    (result,) = parameters.set(strobe_period=1.0)
    assert result.successful is kind[0].strobes
    assert kind[0].strobes or 'MAV_RESULT_DENIED' in result.reason
    assert parameters.get('strobe_period') == [1.0 if kind[0].strobes else 0.0]


def test_no_mode_is_refused_for_the_bitmask(
    parameters: Parameters, kind: tuple[Kind, Program],
) -> None:
    (result,) = parameters.set(mode='external_sync')
    # ArduSub has no other mode, and says so itself.
    assert result.successful or 'MAV_RESULT_DENIED' in result.reason
    assert result.successful is (kind[0].address != '1/1')
    assert parameters.set(mode='internal_control')[0].successful


def test_a_temperature_is_published_only_where_it_is_measured(
    ros: Ros, parameters: Parameters, kind: tuple[Kind, Program], refresh: Callable[[], Any],
) -> None:
    temperatures = ros.subscribe(Temperature, '/illuminator/temperature', STREAM)
    uptimes = ros.subscribe(Float64, '/illuminator/uptime', STREAM)
    uptimes.clear()
    for count in (1, 2, 3):
        assert refresh().success
        uptimes.wait(count=count)
    if kind[0].measures:
        temperatures.wait(lambda message: message.temperature > 0)
    assert bool(temperatures.messages) is kind[0].measures
    assert ('temperature_c' in lamp(ros)) is kind[0].measures


def test_strobe_limits_of_0_are_no_limits(
    parameters: Parameters, kind: tuple[Kind, Program],
) -> None:
    (descriptor,) = parameters.describe('strobe_period')
    (span,) = descriptor.floating_point_range
    assert span.to_value == (10.0 if kind[0].measures else 3600.0)


def test_who_it_is_comes_as_it_tells_it(
    ros: Ros, parameters: Parameters, kind: tuple[Kind, Program],
) -> None:
    values = lamp(ros)
    assert values['address'] == kind[0].address
    assert values.get('vendor') == kind[0].vendor
    # 28 characters in a field of 24, so it has no terminator.
    if kind[0].address == '255/0':
        assert values['software_version'] == 'Illuminator Software Ver'


def test_it_is_neither_lost_nor_taken_for_restarted_or_for_several(
    ros: Ros, parameters: Parameters, kind: tuple[Kind, Program],
) -> None:
    assert [text for text in ('lost', 'restarted', 'several')
            if kind[1].count(text)] == []
