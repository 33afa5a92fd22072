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

"""
The documented time limits, measured on this machine.

  python3 bench/promises.py                 needs ROS; takes about two minutes
  python3 bench/promises.py --quick         a few tries of each
  python3 bench/promises.py --json FILE     writes the rows to a file, too

The tests show what happens, by a clock that does not depend on the machine; here is how long it
takes. The exit status is 1 if a limit was exceeded.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import asdict
import json
import os
from pathlib import Path
import signal
import sys
import tempfile
import time

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / 'test')]

from bench.promise_bench import Bench, Row, until_end  # noqa: E402
from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from std_srvs.srv import SetBool, Trigger  # noqa: E402
from support.light import CONFIGURE, ON_OFF  # noqa: E402
from support.live_link import Lights, LiveLink  # noqa: E402
from support.open_channel import bound_socket  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.processes import python  # noqa: E402
from support.ros import own_domain, STREAM  # noqa: E402

ON = SetBool.Request(data=True)


def answers(bench: Bench) -> None:
    """3.1: how long a set takes, and failing without a light."""
    with bench.lit() as (_, light):
        light.fake.results[CONFIGURE] = None
        bench.take('a set is answered, by a light that says nothing', '3.1', 0.9,
                   [bench.set(brightness=float(n)) for n in range(bench.count)])
        light.fake.results[CONFIGURE] = 0
        light.fake.applies = False
        bench.take('a set is answered, by a light that does not do it', '3.1', 0.9,
                   [bench.set(brightness=float(n)) for n in range(bench.count)])
    with bench.bridge(free_port()):
        asks: dict[str, Callable[[], float]] = {
            '~/enable': lambda: bench.call(SetBool, 'enable', ON),
            '~/refresh': lambda: bench.call(Trigger, 'refresh', Trigger.Request()),
            'a set': lambda: bench.set(brightness=50.0),
        }
        for name, ask in asks.items():
            bench.take(f'{name} fails at once without a light', '3.1', 0.3,
                       [ask() for _ in range(bench.count)])


def returns(bench: Bench) -> None:
    """3.4: how long it takes to be back."""
    bench.take('a TCP link is open again', '3.4', 1.0, _each(bench, _tcp_return))
    bench.take('a UDP light is connected again', '3.4', 1.0, _udp_returns(bench))
    bench.take('a port that was in use is open', '3.4', 1.0, _each(bench, _port_free))


def _each(bench: Bench, measure: Callable[[], float]) -> list[float]:
    return [measure() for _ in range(bench.count)]


def _tcp_return() -> float:
    from socket import SOCK_STREAM
    port = free_port(SOCK_STREAM)
    server = Lights(f'tcpin://127.0.0.1:{port}')
    server.wait_open()
    client = LiveLink(f'tcp://127.0.0.1:{port}')
    client.wait_open()
    client.endpoint.heard.wait_for(lambda heard: True)
    server.stop()
    client.wait_lost()
    # So long that it is tried as rarely as it ever is.
    time.sleep(2.0)
    server = Lights(f'tcpin://127.0.0.1:{port}')
    server.wait_open()
    began = time.monotonic()
    client.wait_open(2)
    seconds = time.monotonic() - began
    client.stop()
    server.stop()
    return seconds


def _udp_returns(bench: Bench) -> list[float]:
    times = []
    with bench.lit(heartbeat_timeout=1.1) as (program, light):
        for count in range(1, bench.count + 1):
            light.vanish()
            program.wait_for('light 1/243 lost', count=count)
            began = time.monotonic()
            light.serve()
            program.wait_for('light 1/243 connected', count=count + 1)
            times.append(time.monotonic() - began)
    return times


def _port_free() -> float:
    port = free_port()
    with bound_socket(port=port) as taken:
        link = LiveLink(f'udpin://127.0.0.1:{port}')
        link.wait_lost()
        time.sleep(2.0)
        taken.close()
        began = time.monotonic()
        link.wait_open()
        seconds = time.monotonic() - began
    link.stop()
    return seconds


def ends(bench: Bench) -> None:
    """3.4: how long it takes to end."""
    times: dict[str, list[float]] = {
        'the bridge ends': [], 'the bridge ends in the midst of a command': [],
        'the bridge ends and switches the light off': [], 'the node is gone from the graph': [],
        'the simulator ends': []}
    idle, busy, off, graph, simulator = times.values()
    for n in range(bench.count):
        number = (signal.SIGINT, signal.SIGTERM)[n % 2]
        with bench.lit() as (program, _):
            idle.append(until_end(program, number))
            began = time.monotonic()
            while 'illuminator' in bench.ros.node.get_node_names():
                time.sleep(0.002)
            graph.append(idle[-1] + time.monotonic() - began)
        with bench.lit() as (program, light):
            light.fake.results[ON_OFF] = None
            bench.ros.start(SetBool, '/illuminator/enable', ON)
            light.wait_for(ON_OFF)
            busy.append(until_end(program, number))
        with bench.lit(off_on_shutdown=True) as (program, light):
            off.append(until_end(program, number))
            assert light.fake.fields['enable'] == 0, 'the light is still on'
        program = python('illuminator_ros.simulator', f'udpout://127.0.0.1:{free_port()}')
        program.wait_for('link open')
        simulator.append(until_end(program, number))
    for promise, seconds in times.items():
        bench.take(promise, '3.4', 1.0, seconds)


def diagnostics(bench: Bench) -> None:
    """3.5: how regularly diagnostics come, and how soon a change of a level is told."""
    with bench.lit() as (_, light):
        arrivals: list[tuple[float, DiagnosticArray]] = []
        bench.ros.node.create_subscription(
            DiagnosticArray, '/diagnostics',
            lambda array: arrivals.append((time.monotonic(), array)), STREAM)
        time.sleep(bench.count + 1.5)
        stamps = [array.header.stamp.sec + array.header.stamp.nanosec / 1e9
                  for _, array in arrivals]
        gaps = [abs(later - earlier - 1.0)
                for earlier, later in zip(stamps, stamps[1:], strict=False)]
        bench.take('diagnostics come each second: how far off', '3.5', 0.2, gaps)
        changes = []
        for n in range(bench.count):
            arrivals.clear()
            began = time.monotonic()
            light.report(error_status=(n + 1) % 2)
            level = (b'\1', b'\0')[n % 2]
            while not (found := [at for at, array in list(arrivals)
                                 if array.status[-1].level == level]):
                time.sleep(0.001)
            changes.append(found[0] - began)
        bench.take('a level that changes is told at once', '3.5', 0.3, changes)


def rest(bench: Bench) -> None:
    """How much of a processor a link takes that has nothing to do."""
    link = LiveLink('memory://quiet')
    clock = time.pthread_getcpuclockid(link.link._thread.ident or 0)
    shares = []
    for _ in range(bench.count):
        began, busy = time.monotonic(), time.clock_gettime(clock)
        time.sleep(0.5)
        shares.append((time.clock_gettime(clock) - busy) / (time.monotonic() - began))
    link.stop()
    bench.take('a quiet link: its share of a processor', '8', 0.02, shares)


def measure(count: int) -> list[Row]:
    """Measure each promise so often, and return the rows."""
    with own_domain() as domain:
        bench = Bench(domain, count)
        for part in (answers, returns, ends, diagnostics, rest):
            part(bench)
    return bench.rows


def main() -> int:
    """Read the command line, and print what was measured."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--quick', action='store_true', help='three tries of each, not ten')
    parser.add_argument('--json', metavar='FILE', help='write the rows to this file')
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as home:
        os.environ['ROS_HOME'] = home
        rows = measure(3 if options.quick else 10)
    width = max(len(row.promise) for row in rows)
    for row in rows:
        print(f'{row.section:3}  {row.promise:{width}}  limit {row.limit:5.2f}  p50 {row.p50:6.3f}'
              f'  max {row.max:6.3f}  of {row.tries:2}  {"met" if row.met else "MISSED"}')
    if options.json:
        Path(options.json).write_text(json.dumps(
            [{**asdict(row), 'met': row.met} for row in rows], indent=2) + '\n')
    return 0 if all(row.met for row in rows) else 1


if __name__ == '__main__':
    sys.exit(main())
