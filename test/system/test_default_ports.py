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

import socket

import pytest
from support.processes import ended, python
from support.ros import Parameters, Ros

DEFAULT_PORT = 14590


@pytest.mark.parametrize('first', ['bridge', 'simulator'])
def test_programs_without_arguments_find_each_other_whichever_starts_first(
    own_ros: Ros, first: str,
) -> None:
    env = {'ROS_DOMAIN_ID': str(own_ros.domain)}
    names = ['bridge', 'simulator'] if first == 'bridge' else ['simulator', 'bridge']
    with (socket.socket(socket.AF_UNIX) as claim,
          socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe):
        try:
            claim.bind('\0illuminator_ros_test_default_port')
            probe.bind(('127.0.0.1', DEFAULT_PORT))
        except OSError:
            pytest.skip(f'UDP port {DEFAULT_PORT} is taken')
        probe.close()
        with (ended(python(f'illuminator_ros.{names[0]}', env=env)) as one,
              ended(python(f'illuminator_ros.{names[1]}', env=env)) as other):
            (one if first == 'bridge' else other).wait_for('light 1/243 connected')

            Parameters(own_ros).wait(brightness=100.0)
