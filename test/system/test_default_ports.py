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

"""``bridge`` and ``simulator``, both without arguments, find each other."""

from collections.abc import Iterator
import socket

import pytest
from support.processes import ended, python
from support.ros import Parameters, Ros

DEFAULT_PORT = 14590


@pytest.fixture(autouse=True)
def default_port() -> Iterator[None]:
    """Claim the port that a bridge without arguments listens on."""
    with (socket.socket(socket.AF_UNIX) as claim,
          socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe):
        try:
            claim.bind('\0illuminator_ros_test_default_port')
            probe.bind(('127.0.0.1', DEFAULT_PORT))
        except OSError:
            pytest.skip(f'UDP port {DEFAULT_PORT} is taken')
        probe.close()
        yield


@pytest.mark.parametrize('first', ['bridge', 'simulator'])
def test_they_find_each_other(own_ros: Ros, first: str) -> None:
    second = {'bridge': 'simulator', 'simulator': 'bridge'}[first]
    env = {'ROS_DOMAIN_ID': str(own_ros.domain)}
    with (ended(python(f'illuminator_ros.{first}', env=env)) as one,
          ended(python(f'illuminator_ros.{second}', env=env)) as other):
        {'bridge': one, 'simulator': other}[first].wait_for('light 1/243 connected')

        Parameters(own_ros).wait(brightness=100.0)
