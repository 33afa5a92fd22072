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

"""A node and its simulator, both without a URL, find each other."""

import contextlib
import socket

import pytest
from support.processes import ended, Program, python

# Node -> its port, the arguments of its simulator, and the line of its log.
NODES = {
    'bridge': (14590, (), 'light 1/243 connected'),
    'rededge': (14592, ('--payload', 'rededge'), '/100 connected'),
}


@pytest.mark.parametrize('node_first', [True, False])
@pytest.mark.parametrize('node', NODES)
def test_programs_without_a_url_find_each_other_whichever_starts_first(
        domain: int, node: str, node_first: bool) -> None:
    port, arguments, found = NODES[node]
    env = {'ROS_DOMAIN_ID': str(domain)}
    with (socket.socket(socket.AF_UNIX) as claim,
          socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe,
          contextlib.ExitStack() as programs):
        try:
            claim.bind(f'\0illuminator_ros_test_default_port_{port}')
            probe.bind(('127.0.0.1', port))
        except OSError:
            pytest.skip(f'UDP port {port} is taken')
        probe.close()

        def start(name: str) -> Program:
            more = arguments if name == 'simulator' else ()
            return programs.enter_context(ended(python(f'illuminator_ros.{name}', *more, env=env)))

        started = {name: start(name) for name in (
            (node, 'simulator') if node_first else ('simulator', node))}
        started[node].wait_for(found)
