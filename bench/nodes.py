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

"""Many nodes in one process, as another process sees them; see scale.py --nodes."""

from __future__ import annotations

import os
from pathlib import Path
import random
import time

os.environ.setdefault('ROS_DOMAIN_ID', str(random.randint(1, 101)))
os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')

from parallel import Client, quantile  # noqa: E402
import rclpy  # noqa: E402
from rclpy.context import Context  # noqa: E402
from scale import free_port, program, simulator  # noqa: E402
from std_srvs.srv import SetBool  # noqa: E402

CALLS = 200
# s over which the CPU time is taken, and within which all nodes must be seen.
MEASURED, LIMIT = 4.0, 60.0


def cpu(pid: int) -> float:
    """Return the CPU time of a process so far, s."""
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def megabytes(pid: int) -> float:
    """Return the resident memory of a process, MB."""
    lines = Path(f'/proc/{pid}/status').read_text().splitlines()
    (line,) = [line for line in lines if line.startswith('VmRSS')]
    return int(line.split()[1]) / 1024


def seen(context: Context, services: list[str]) -> float:
    """Return the time until a new participant knows all of some services, s."""
    node = rclpy.create_node('late', context=context)
    began = time.monotonic()
    clients = [node.create_client(SetBool, service) for service in services]
    while not all(client.service_is_ready() for client in clients):
        assert time.monotonic() < began + LIMIT, 'not all nodes are seen'
        time.sleep(0.02)
    took = time.monotonic() - began
    node.destroy_node()
    return took


def measure(counts: list[int]) -> int:
    """Measure some numbers of lights; return the exit status."""
    rclpy.init()
    print('lights  all nodes there  seen by a newcomer  ~/enable p50, p99   CPU     memory')
    for count in counts:
        port = free_port()
        names = ['illuminator', *(f'illuminator_2_{n}' for n in range(2, count + 1))]
        services = [f'/{name}/enable' for name in names]
        with simulator(port, count, 1.0), program(
                'illuminator_ros.bridge', '--ros-args', '-p',
                f'connection_url:=udpin://127.0.0.1:{port}', '-p', 'target_component:=1',
        ) as bridge:
            first = Context()
            rclpy.init(context=first)
            there = seen(first, services)
            newcomer = Context()
            rclpy.init(context=newcomer)
            late = seen(newcomer, services)
            for context in (first, newcomer):
                rclpy.shutdown(context=context)
            time.sleep(2.0)
            before = cpu(bridge.pid)
            time.sleep(MEASURED)
            share = 100 * (cpu(bridge.pid) - before) / MEASURED
            client = Client(['illuminator'])
            time.sleep(1.0)
            times = [client.call('illuminator', bool(n % 2))[0] for n in range(CALLS)]
            print(f'{count:6}  {there:13.1f} s  {late:16.1f} s  '
                  f'{quantile(times, 0.5) * 1e3:5.2f}, {quantile(times, 0.99) * 1e3:5.2f} ms  '
                  f'{share:4.0f} %  {megabytes(bridge.pid):6.0f} MB', flush=True)
            client.node.destroy_node()
    os._exit(0)
