#!/usr/bin/env python3
# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
Runs the bridge with faulty simulated lights and a faulty gimbal for a given time.

The devices lose, repeat, reorder, delay and corrupt messages, fall silent, and are restarted,
while services, parameters and setpoints are in use. Every request must be answered in time. At the
end the bridge must serve as at the beginning, with no more memory, threads and descriptors than
after its warm-up.

    python3 test/soak/run.py --seconds 3600 --seed 1

It needs ROS (rclpy). Exit status: 0 if all is well, 1 if not.
"""

from __future__ import annotations

import argparse
from collections import Counter
import contextlib
import os
from pathlib import Path
import random
import resource
import sys
import time
from typing import Any, NamedTuple

TEST = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TEST.parent), str(TEST)]

from geometry_msgs.msg import Vector3, Vector3Stamped  # noqa: E402
from std_msgs.msg import Float32  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.processes import Program, python, start_interpreter  # noqa: E402
from support.ros import bridge_arguments, own_domain, Parameters, Ros  # noqa: E402

# Growth of a process after its warm-up: memory in MB, threads, descriptors. The middleware opens
# some descriptors for participants that come and go.
MAX_GROWTH = (6.0, 0, 4)
# s; the slowest request is a refresh (5 s), behind others of its kind.
ANSWER_LIMIT = 30.0
# s after the faults in which a light that has just restarted gets its configuration back.
CALM = 4.0
REPORT_INTERVAL = 30.0
GIMBAL = '/gimbal_manager'

DEVICES = {'light': ('--component-id', '243'), 'further light': ('--component-id', '244'),
           'gimbal': ('--payload', 'gimbal')}
# Faults of the simulator; '' for none.
FAULTS = ('', 'drop=0.3', 'duplicate=0.3', 'delay=0.3', 'corrupt=0.3', 'silence',
          'drop=0.1,duplicate=0.1,delay=0.1,corrupt=0.1')


class Usage(NamedTuple):
    """The resources of a process: memory in MB, threads, descriptors."""

    memory_mb: float
    threads: int
    descriptors: int

    @classmethod
    def of(cls, pid: int) -> Usage:
        """Read the usage of a process."""
        pages = int(Path(f'/proc/{pid}/statm').read_text().split()[1])
        return cls(pages * resource.getpagesize() / 1e6, len(os.listdir(f'/proc/{pid}/task')),
                   len(os.listdir(f'/proc/{pid}/fd')))

    def __str__(self) -> str:
        return (f'{self.memory_mb:.1f} MB, {self.threads} threads, '
                f'{self.descriptors} descriptors')

    def excess(self, before: Usage) -> list[str]:
        """Return by how much this usage is above an earlier one, beyond the tolerance."""
        return [f'{now - then:.1f} {what} more' for now, then, limit, what in zip(
            self, before, MAX_GROWTH, ('MB of memory', 'threads', 'descriptors'), strict=True)
            if now > then + limit]


class Soak:
    """The programs, and a client."""

    def __init__(self, seed: str, domain: int) -> None:
        self.random = random.Random(seed)
        self.counts: Counter[str] = Counter()
        self.problems: list[str] = []
        self._port = free_port()
        self.bridge = start_interpreter(
            'illuminator_ros.bridge',
            *bridge_arguments(self._port, payloads='[illuminator, gimbal_manager]'),
            env={'ROS_DOMAIN_ID': str(domain)})
        self._devices = {name: self._device(name) for name in DEVICES}
        self.client = Ros(domain)
        self.parameters = Parameters(self.client)
        self._calls: list[tuple[float, str, Any]] = []

    def _device(self, name: str, fault: str = '') -> Program:
        return python('illuminator_ros.simulator', f'udpout://127.0.0.1:{self._port}',
                      *DEVICES[name], *(('--fault', fault) if fault else ()))

    def close(self) -> None:
        """End all programs."""
        self.client.close()
        for name, program in {'bridge': self.bridge, **self._devices}.items():
            if not program.running:
                self.problems.append(f'{name} has ended by itself')
            elif program.end() != 0:
                self.problems.append(f'{name} did not end with 0')
            program.kill()
            if 'Traceback' in program.log or 'internal error' in program.log:
                self.problems.append(f'{name} has printed:\n{program.log[-3000:]}')

    def restart(self, name: str, fault: str = '') -> None:
        """Restart a device with a fault."""
        self._devices[name].kill()
        self._devices[name] = self._device(name, fault)

    def disturb(self) -> None:
        """Restart one of the devices with another fault."""
        fault = self.random.choice(FAULTS)
        self.counts[fault or 'no fault'] += 1
        self.restart(self.random.choice(list(DEVICES)), fault)

    def request(self) -> None:
        """Begin one request of some kind."""
        kind = self.random.choice(('enable', 'refresh', 'set', 'setpoints', 'gimbal', 'rates'))
        self.counts[kind] += 1
        if kind == 'setpoints':
            self.client.publish(Float32, '/illuminator/cmd/brightness',
                                *(self.random.uniform(0, 100) for _ in range(10)))
            return
        if kind == 'rates':
            publisher = self.client.publisher(Vector3Stamped, f'{GIMBAL}/cmd/rate', GIMBAL)
            for _ in range(10):
                publisher.publish(Vector3Stamped(vector=Vector3(
                    y=self.random.uniform(-0.5, 0.5), z=self.random.uniform(-0.5, 0.5))))
            return
        self._calls.append((time.monotonic(), kind, (
            self.client.start_enable(self.random.random() < 0.5) if kind == 'enable' else
            self.client.start(Trigger, '/illuminator/refresh', Trigger.Request())
            if kind == 'refresh' else
            self.client.start(Trigger, f'{GIMBAL}/{self._control()}', Trigger.Request(), GIMBAL)
            if kind == 'gimbal' else
            self.parameters.start_set(strobe_duty_cycle=self.random.uniform(0, 100)))))

    def _control(self) -> str:
        return self.random.choice(('take_control', 'take_control', 'release_control', 'neutral'))

    def collect(self) -> None:
        """Take the received answers, and note overdue ones."""
        waiting = []
        for begun, kind, call in self._calls:
            if call.answered:
                response = call.result()
                good = (response.results[0].successful if kind == 'set' else response.success)
                self.counts[f'{kind}: {"success" if good else "refused"}'] += 1
            elif time.monotonic() - begun > ANSWER_LIMIT:
                self.problems.append(f'{kind} got no answer within {ANSWER_LIMIT:g} s')
            else:
                waiting.append((begun, kind, call))
        self._calls = waiting

    def run(self, seconds: float) -> None:
        """Disturb the devices and send requests for a time, s."""
        until = time.monotonic() + seconds
        next_fault = next_report = time.monotonic()
        while time.monotonic() < until:
            if time.monotonic() >= next_fault:
                next_fault = time.monotonic() + self.random.uniform(0.5, 4.0)
                self.disturb()
            if len(self._calls) < 4:
                self.request()
            self.collect()
            time.sleep(self.random.uniform(0.0, 0.1))
            if seconds > REPORT_INTERVAL and time.monotonic() >= next_report:
                next_report = time.monotonic() + REPORT_INTERVAL
                print(f'bridge {Usage.of(self.bridge.pid)}', flush=True)

    def calm_down(self) -> None:
        """End the faults, and wait for the requests that are under way."""
        for name in DEVICES:
            self.restart(name)
        until = time.monotonic() + ANSWER_LIMIT + 1.0
        while self._calls and time.monotonic() < until:
            self.collect()
            time.sleep(0.05)
        time.sleep(CALM)

    def check_service(self) -> None:
        """Check that light and gimbal can be commanded as at the beginning."""
        for on in (True, False):
            until = time.monotonic() + ANSWER_LIMIT
            # A confirmation may be too late if the machine pauses.
            while not (answer := self.client.enable(on)).success and time.monotonic() < until:
                pass
            if not answer.success:
                self.problems.append(f'at the end: {answer.message}')
        until = time.monotonic() + ANSWER_LIMIT
        while not (taken := self.client.call(
                Trigger, f'{GIMBAL}/take_control', Trigger.Request())).success and (
                    time.monotonic() < until):
            time.sleep(0.5)
        if not taken.success:
            self.problems.append(f'at the end: {taken.message}')


def soak(seconds: float, seed: str) -> int:
    """Run the soak, print the findings, and return the exit status."""
    warm_up = min(max(seconds / 4, 3.0), 120.0)
    with own_domain() as domain, contextlib.ExitStack() as stack:
        one = Soak(seed, domain)
        stack.callback(one.close)
        one.bridge.wait_for('connected')
        one.bridge.wait_for('is served by')
        one.bridge.wait_for('gimbal 1/154 is managed')
        # Modules that are imported late, and buffers, must be there before usage is compared.
        one.run(warm_up)
        one.calm_down()
        before = Usage.of(one.bridge.pid)
        one.run(seconds - warm_up)
        one.calm_down()
        one.check_service()
        after = Usage.of(one.bridge.pid)
    print(f'bridge: after the warm-up {before}; at the end {after}')
    one.problems += [f'bridge: {growth}' for growth in after.excess(before)]
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
