#!/usr/bin/env python3
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
Ends bridges with ``off_on_shutdown`` while everything is requested of their three lights.

In each run publishers send ON to each light at 500 Hz, services and parameter sets are under way,
and in every second run each frame is lost with a probability of 30 % each way. In every third run
a service keeps the executor busy. Then the bridge gets SIGINT, SIGTERM or SIGHUP. The run is right
if the bridge ends in time with status 0, OFF is the last command that it has sent to each light
and would change it, and each light is off or named as one that may still be on.

    python3 test/soak/end.py --runs 200

It needs ROS (rclpy). Exit status: 0 if all runs are right, 1 if not.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable
import contextlib
import functools
from pathlib import Path
import random
import signal
import sys
import threading
import time
from typing import Any

TEST = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TEST.parent), str(TEST)]

from illuminator_ros.mavlink.link import Link  # noqa: E402
from illuminator_ros.mavlink.messages import Address  # noqa: E402
from rcl_interfaces.srv import GetParameters, SetParameters  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from std_msgs.msg import Bool, Float32  # noqa: E402
from std_srvs.srv import SetBool  # noqa: E402
from support.light import CONFIGURE, ON_OFF, ServedLight  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.recording import Call  # noqa: E402
from support.ros import own_domain, Parameters, Ros, start_bridge  # noqa: E402
from support.waiting import eventually  # noqa: E402

LIGHTS = {'/illuminator': Address(1, 243), '/illuminator_1_244': Address(1, 244),
          '/illuminator_1_245': Address(1, 245)}
# s between the messages of a publisher, and between service calls.
PERIOD, CALL_PERIOD = 0.002, 0.02
LOSS = 0.3
# s within which a process must end after its signal.
LIMIT = 1.0
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Users:
    """Publishers, and clients of services, in threads of this process."""

    def __init__(self, ros: Ros) -> None:
        self._ros = ros
        self._ended = threading.Event()
        self.calls: list[Call] = []
        switches = [ros.publisher(Bool, f'{node}/cmd/enable') for node in LIGHTS]
        dimmer = ros.publisher(Float32, '/illuminator/cmd/brightness')
        dim = SetParameters.Request(
            parameters=[Parameter('brightness', value=30.0).to_parameter_msg()])
        self._threads = [
            *(self._repeat(PERIOD, functools.partial(one.publish, Bool(data=True)))
              for one in switches),
            self._repeat(PERIOD, lambda: dimmer.publish(Float32(data=50 + 50 * random.random()))),
            *(self._repeat(CALL_PERIOD, functools.partial(self._call, client, request))
              for type_, service, request in (
                  (SetBool, 'enable', SetBool.Request(data=True)),
                  (SetBool, 'enable_all', SetBool.Request(data=True)),
                  (SetParameters, 'set_parameters', dim))
              for client in self._clients(type_, service))]

    def _clients(self, type_: type, service: str) -> list[Any]:
        clients = [self._ros.node.create_client(type_, f'{node}/{service}') for node in LIGHTS
                   if service != 'enable_all' or node == '/illuminator']
        for client in clients:
            eventually(client.service_is_ready)
        return clients

    def _call(self, client: Any, request: Any) -> None:
        self.calls.append(Call(client.call_async(request)))

    def _repeat(self, period: float, act: Callable[[], object]) -> threading.Thread:
        def repeat() -> None:
            while not self._ended.wait(period):
                act()

        thread = threading.Thread(target=repeat)
        thread.start()
        return thread

    def end(self) -> None:
        """End all threads."""
        self._ended.set()
        for thread in self._threads:
            thread.join()


def play(number: int, draw: random.Random, domain: int, counts: Counter[str]) -> list[str]:
    """Do one run, and return what is wrong."""
    loss, busy = LOSS * (number % 2), not number % 3
    kind = draw.choice(SIGNALS)
    port = free_port()
    with contextlib.ExitStack() as stack:
        ros = stack.enter_context(contextlib.closing(Ros(domain)))
        lights = [stack.enter_context(ServedLight(port, address, link=Link, stream=0.1))
                  for address in LIGHTS.values()]
        program = start_bridge(domain, port, off_on_shutdown=True, target_component=243)
        try:
            for node in LIGHTS:
                Parameters(ros, node).wait(brightness=100.0)
            users = Users(ros)
            try:
                eventually(lambda: all(one.fake.fields['enable'] for one in lights))
                for one in lights:
                    one.fake.loss = loss
                time.sleep(draw.uniform(0.0, 0.5))
                if busy:
                    ros.start(GetParameters, '/illuminator/get_parameters',
                              GetParameters.Request(names=['x'] * 1_000_000))
                began = time.monotonic()
                status = program.end(kind)
                took = time.monotonic() - began
            finally:
                users.end()
        finally:
            program.kill()
    counts['runs'] += 1
    problems = []
    if status or 'Traceback' in program.log or 'internal error' in program.log:
        problems.append(f'status {status}:\n{program.log[-3000:]}')
    if took > LIMIT:
        problems.append(f'took {took:.2f} s')
    for one in lights:
        address = one.fake.source
        changes = [(command.command, command.param1)
                   for command in one.commands(ON_OFF, CONFIGURE)]
        named = program.count(f'light {address} may still be on')
        is_off = not one.fake.fields['enable']
        counts[f'{"off" if is_off else "on"}, {"named" if named else "not named"}'
               f' at {loss:.0%} loss'] += 1
        if changes[-1:] != [(ON_OFF, 0.0)]:
            problems.append(f'light {address}: the last changes are {changes[-3:]}')
        if not (is_off or named):
            problems.append(f'light {address} is on, and the log does not say so')
        if not (named or program.count(f'light {address} is off')):
            problems.append(f'light {address} has no line in the log')
    counts['answers "the bridge is ending"'] += sum(
        call.answered and 'the bridge is ending' in str(call.result()) for call in users.calls)
    return [f'run {number}, {kind.name}, loss {loss:.0%}, {"busy" if busy else "idle"}: {text}'
            for text in problems]


def main() -> int:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--runs', type=int, default=200, help='default: %(default)s')
    parser.add_argument('--seed', default='0', help='any text (default: %(default)s)')
    options = parser.parse_args()
    counts: Counter[str] = Counter()
    wrong = 0
    with own_domain() as domain:
        for number in range(options.runs):
            problems = play(number, random.Random(f'{options.seed} {number}'), domain, counts)
            wrong += bool(problems)
            for problem in problems:
                print(f'PROBLEM: {problem}', flush=True)
            if number % 10 == 9:
                print(f'{number + 1} runs, {wrong} wrong', flush=True)
    for name, count in sorted(counts.items()):
        print(f'{count:6} {name}')
    print(f'{options.runs - wrong} of {options.runs} runs are right')
    return 1 if wrong else 0


if __name__ == '__main__':
    sys.exit(main())
