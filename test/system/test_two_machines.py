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

import pytest
from support.machines import CannotBeMade, Machine, two_machines
from support.processes import ended

pytestmark = pytest.mark.timeout(300)


@pytest.fixture(scope='module')
def machines() -> Iterator[tuple[Machine, Machine]]:
    """Return a robot's machine, and an operator's."""
    try:
        with two_machines() as (robot, station):
            yield robot, station
    except CannotBeMade as reason:
        pytest.skip(f'two machines cannot be made here: {reason}')


@pytest.mark.parametrize('place', ['robot', 'station'])
def test_client_on_another_machine_uses_topics_services_and_parameters_of_the_bridge(
    machines: tuple[Machine, Machine], domain: int, place: str,
) -> None:
    """The light is on the robot's machine, or on the other."""
    robot, station = machines
    env = {
        'ROS_DOMAIN_ID': str(domain), 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET',
        # Two machines have no memory in common, though these have.
        'FASTDDS_BUILTIN_TRANSPORTS': 'UDPv4'}
    light, listening, sending = ((robot, '127.0.0.1', '127.0.0.1') if place == 'robot' else
                                 (station, '0.0.0.0', robot.address))
    with (ended(robot.python('illuminator_ros.bridge', '--ros-args', '-p',
                             f'connection_url:=udpin://{listening}:14590', env=env)) as bridge,
          ended(light.python('illuminator_ros.simulator', f'udpout://{sending}:14590'))):
        bridge.wait_for('light 1/243 connected')
        client = station.python('support.distant_client', str(domain), env=env)
        try:
            assert client.wait(120.0) == 0, f'{client.log}\n{bridge.log}'
        finally:
            client.kill()
    seen = json.loads(client.lines[-1])
    (enabled, message), (refused, reason) = seen.pop('enable'), seen.pop('refused')

    assert seen == {'connected': True, 'set': [True, ''], 'brightness': 60.0,
                    'enabled topic': True, 'brightness topic': 60.0}
    assert enabled and message.startswith('on, confirmed'), message
    assert not refused and '100' in reason
