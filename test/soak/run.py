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
Runs the bridge and simulated lights for as long as is wanted, over a line that does its worst.

Frames are lost, repeated, reordered, delayed and spoilt, the line is cut, the router between
them is restarted, and so is one of two lights, while services, parameters and setpoints are used
all the time. Every request must be answered in time, and at the end the bridge must serve as at
the beginning, with no more memory, threads and descriptors than after its warm-up.

    python3 test/soak/run.py --seconds 3600 --seed 1

It needs ROS (rclpy). Exit status: 0 if all is well, 1 if not.
"""

from __future__ import annotations

import argparse
from collections import Counter
import contextlib
from dataclasses import dataclass
import os
from pathlib import Path
import random
import resource
import sys
import time
from typing import Any

TEST = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TEST.parent), str(TEST)]

from std_msgs.msg import Float32  # noqa: E402
from std_srvs.srv import SetBool, Trigger  # noqa: E402
from support.fault_proxy import FaultProxy, NO_FAULTS  # noqa: E402
from support.faulty_wire import Faults  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.processes import Program, python  # noqa: E402
from support.ros import own_domain, Parameters, Ros, start_bridge  # noqa: E402

# Memory that a process may take more at the end than after its warm-up, MB.
MAX_GROWTH_MB = 6.0
# Descriptors likewise: the middleware opens some for who comes and goes. Threads: none.
MAX_MORE_DESCRIPTORS = 4
# s; the slowest request is a refresh (5 s), behind others of its kind.
ANSWER_LIMIT = 30.0
# s; a light that has just restarted gets its configuration back before it is asked for more.
CALM = 4.0
REPORT_INTERVAL = 30.0

FAULTS = {
    'nothing': NO_FAULTS,
    'loss': Faults(drop=0.3, latency=0.0),
    'reordering': Faults(reorder=0.5, duplicate=0.3, latency=0.0),
    'delays': Faults(delay=0.3, latency=0.01),
    'noise': Faults(corrupt=0.3, latency=0.0),
    'everything': Faults(0.1, 0.1, 0.1, 0.1, 0.1),
    'silence': Faults(drop=1.0, latency=0.0),
}


@dataclass
class Usage:
    """What a process takes."""

    memory_mb: float
    threads: int
    descriptors: int

    @classmethod
    def of(cls, pid: int) -> Usage:
        """Look at a process."""
        pages = int(Path(f'/proc/{pid}/statm').read_text().split()[1])
        return cls(pages * resource.getpagesize() / 1e6, len(os.listdir(f'/proc/{pid}/task')),
                   len(os.listdir(f'/proc/{pid}/fd')))

    def __str__(self) -> str:
        return (f'{self.memory_mb:.1f} MB, {self.threads} threads, '
                f'{self.descriptors} descriptors')

    def excess(self, before: Usage) -> list[str]:
        """Return what a process takes more than before, beyond what it may."""
        found = []
        if self.memory_mb > before.memory_mb + MAX_GROWTH_MB:
            found.append(f'{self.memory_mb - before.memory_mb:.1f} MB of memory more')
        if self.threads > before.threads:
            found.append(f'{self.threads - before.threads} threads more')
        if self.descriptors > before.descriptors + MAX_MORE_DESCRIPTORS:
            found.append(f'{self.descriptors - before.descriptors} descriptors more')
        return found


class Soak:
    """The programs, the line between them, and a client."""

    def __init__(self, seed: str, domain: int) -> None:
        self.random = random.Random(seed)
        self.counts: Counter[str] = Counter()
        self.problems: list[str] = []
        port = free_port()
        self.proxy = FaultProxy(port, self.random.randrange(1 << 30))
        self.bridge = start_bridge(domain, port)
        self.light = self._simulator(243)
        self.restarted = self._simulator(244)
        self.client = Ros(domain)
        self.parameters = Parameters(self.client)
        self._calls: list[tuple[float, str, Any]] = []

    def _simulator(self, component: int) -> Program:
        return python('illuminator_ros.simulator', f'udpout://127.0.0.1:{self.proxy.port}',
                      '--component-id', str(component))

    def close(self) -> None:
        """End it all."""
        self.client.close()
        for program, name in ((self.bridge, 'bridge'), (self.light, 'simulator'),
                              (self.restarted, 'simulator')):
            if not program.running:
                self.problems.append(f'{name} has ended by itself')
            elif program.end() != 0:
                self.problems.append(f'{name} did not end with 0')
            program.kill()
            if 'Traceback' in program.log or 'internal error' in program.log:
                self.problems.append(f'{name} has printed:\n{program.log[-3000:]}')
        self.proxy.close()

    def usages(self) -> dict[str, Usage]:
        """Return what the two programs take that run from the beginning to the end."""
        return {'bridge': Usage.of(self.bridge.pid), 'simulator': Usage.of(self.light.pid)}

    # What is done

    def disturb(self) -> None:
        """Do something to the line or the lights."""
        what = self.random.choice([*FAULTS, 'router restart', 'light restart'])
        self.counts[what] += 1
        if what == 'router restart':
            self.proxy.restart()
        elif what == 'light restart':
            self.restarted.kill()
            self.restarted = self._simulator(244)
        else:
            self.proxy.set(FAULTS[what])

    def request(self) -> None:
        """Begin one request of some kind."""
        what = self.random.choice(('enable', 'refresh', 'set', 'setpoints'))
        self.counts[what] += 1
        if what == 'enable':
            call = self.client.start(SetBool, '/illuminator/enable', SetBool.Request(
                data=self.random.random() < 0.5))
        elif what == 'refresh':
            call = self.client.start(Trigger, '/illuminator/refresh', Trigger.Request())
        elif what == 'set':
            call = self.parameters.start_set(strobe_duty_cycle=self.random.uniform(0, 100))
        else:
            self.client.publish(Float32, '/illuminator/cmd/brightness',
                                *(self.random.uniform(0, 100) for _ in range(10)))
            return
        self._calls.append((time.monotonic(), what, call))

    def collect(self) -> None:
        """Take the answers that are there, and miss those that should be."""
        waiting = []
        for begun, what, call in self._calls:
            if call.answered:
                response = call.result()
                good = getattr(response, 'success', None)
                good = response.results[0].successful if good is None else good
                self.counts[f'{what}: {"success" if good else "refused"}'] += 1
            elif time.monotonic() - begun > ANSWER_LIMIT:
                self.problems.append(f'{what} got no answer within {ANSWER_LIMIT:g} s')
            else:
                waiting.append((begun, what, call))
        self._calls = waiting

    def run(self, seconds: float, *, disturbed: bool = True) -> None:
        """Go on for a time."""
        until = time.monotonic() + seconds
        next_fault = next_report = time.monotonic()
        while time.monotonic() < until:
            if disturbed and time.monotonic() >= next_fault:
                next_fault = time.monotonic() + self.random.uniform(0.5, 4.0)
                self.disturb()
            if len(self._calls) < 4:
                self.request()
            self.collect()
            time.sleep(self.random.uniform(0.0, 0.1))
            if seconds > REPORT_INTERVAL and time.monotonic() >= next_report:
                next_report = time.monotonic() + REPORT_INTERVAL
                print('; '.join(f'{name} {usage}' for name, usage in self.usages().items()),
                      flush=True)

    def calm_down(self) -> None:
        """End the faults, and wait for what is under way."""
        self.proxy.set(NO_FAULTS)
        until = time.monotonic() + ANSWER_LIMIT + 1.0
        while self._calls and time.monotonic() < until:
            self.collect()
            time.sleep(0.05)
        time.sleep(CALM)

    def check_service(self) -> None:
        """Check that the light can be commanded as on the first day."""
        for on in (True, False):
            until = time.monotonic() + ANSWER_LIMIT
            answer: Any = None
            # Where the machine stands still meanwhile, one may come too late.
            while (answer is None or not answer.success) and time.monotonic() < until:
                answer = self.client.call(
                    SetBool, '/illuminator/enable', SetBool.Request(data=on), ANSWER_LIMIT)
            if not answer.success:
                self.problems.append(f'at the end: {answer.message}')


def soak(seconds: float, seed: str) -> int:
    """Run it and say what was found."""
    with own_domain() as domain, contextlib.ExitStack() as stack:
        one = Soak(seed, domain)
        stack.callback(one.close)
        one.bridge.wait_for('connected', 30.0)
        one.bridge.wait_for('is served by', 30.0)
        # Each kind of request and fault once or more, so that all that is loaded late is there.
        one.run(min(max(seconds / 4, 6.0), 120.0))
        one.calm_down()
        before = one.usages()
        one.run(seconds - min(max(seconds / 4, 6.0), 120.0))
        one.calm_down()
        one.check_service()
        after = one.usages()
    for name, usage in after.items():
        print(f'{name}: after the warm-up {before[name]}; at the end {usage}')
        one.problems += [f'{name}: {what}' for what in usage.excess(before[name])]
    print(', '.join(f'{name} {count}' for name, count in sorted(one.counts.items())))
    for problem in one.problems:
        print(f'PROBLEM: {problem}')
    return 1 if one.problems else 0


def main() -> int:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--seconds', type=float, default=600.0, help='default: %(default)s')
    parser.add_argument('--seed', default='0', help='any text (default: %(default)s)')
    options = parser.parse_args()
    return soak(options.seconds, options.seed)


if __name__ == '__main__':
    sys.exit(main())
