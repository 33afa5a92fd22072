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

"""Bridge and ROS client on two machines, and the MAVLink link between two machines."""

from collections.abc import Iterator
import json
from pathlib import Path
from typing import Any

import pytest
from support.machines import CannotBeMade, Machine, two_machines
from support.processes import ended

pytestmark = pytest.mark.timeout(300)


@pytest.fixture(scope='module')
def machines() -> Iterator[tuple[Machine, Machine]]:
    """Return a robot's machine, and the one of somebody who watches it."""
    try:
        with two_machines() as (robot, station):
            yield robot, station
    except CannotBeMade as reason:
        pytest.skip(f'two machines cannot be made here: {reason}')


@pytest.fixture(scope='module', params=['robot', 'station'])
def seen(
    request: pytest.FixtureRequest, machines: tuple[Machine, Machine], domain: int,
) -> Any:
    """Have the bridge used from afar, with the light on either machine; return what came of it."""
    robot, station = machines
    env = {
        'ROS_DOMAIN_ID': str(domain), 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET',
        # Two machines have no memory in common, though these have.
        'FASTDDS_BUILTIN_TRANSPORTS': 'UDPv4'}
    if request.param == 'robot':
        light, listening, sending = robot, '127.0.0.1', '127.0.0.1'
    else:
        light, listening, sending = station, '0.0.0.0', robot.address
    with (ended(robot.python('illuminator_ros.bridge', '--ros-args', '-p',
                             f'connection_url:=udpin://{listening}:14590', env=env)) as bridge,
          ended(light.python('illuminator_ros.simulator', f'udpout://{sending}:14590'))):
        bridge.wait_for('light 1/243 connected', timeout=30.0)
        tests = str(Path(__file__).parents[1])
        client = station.python('support.distant_client', str(domain),
                                env={**env, 'PYTHONPATH': tests})
        try:
            assert client.wait(120.0) == 0, f'{client.log}\n{bridge.log}'
        finally:
            client.kill()
        yield json.loads(client.lines[-1])


def test_a_late_subscriber_gets_the_state(seen: Any) -> None:
    assert seen['connected'] is True


def test_a_service_is_answered(seen: Any) -> None:
    success, message = seen['enable']

    assert (success, message.startswith('on, confirmed')) == (True, True), message


def test_a_parameter_is_set_on_the_light(seen: Any) -> None:
    assert seen['set'] == [True, '']
    assert seen['brightness'] == 60.0


def test_a_parameter_is_refused_with_its_reason(seen: Any) -> None:
    success, reason = seen['refused']

    assert not success
    assert '100' in reason


def test_topics_show_what_was_done(seen: Any) -> None:
    assert (seen['enabled topic'], seen['brightness topic']) == (True, 60.0)


def test_nothing_is_left_of_the_machines(machines: tuple[Machine, Machine]) -> None:
    with two_machines() as others:
        keepers = [machine.pid for machine in others]
        assert 'cable' in others[0].run('ip', '-brief', 'link')

    assert [Path(f'/proc/{pid}').exists() for pid in keepers] == [False, False]
    assert not Path('/sys/class/net/cable').exists()
