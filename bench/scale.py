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
Many lights on one link: what is found, what is lost, and what a status costs.

  python3 bench/scale.py            without ROS: Link and Controller over UDP
  python3 bench/scale.py --nodes    with ROS: the bridge's nodes as another process sees them
"""

from __future__ import annotations

import argparse
from collections import Counter
import contextlib
import os
from pathlib import Path
import signal
import socket
import statistics
import subprocess
import sys
import threading
import time
from typing import Any

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from illuminator_ros.illuminator.controller import Controller  # noqa: E402
from illuminator_ros.illuminator.light import Light, Settings  # noqa: E402
from illuminator_ros.illuminator.model import Status  # noqa: E402
from illuminator_ros.illuminator.observer import LightObserver  # noqa: E402
from illuminator_ros.mavlink.dialect import (  # noqa: E402
    encode_payload,
    heartbeat,
    IlluminatorStatus,
    LAYOUTS,
    MavType,
    Source,
)
from illuminator_ros.mavlink.framing import encode_frame  # noqa: E402
from illuminator_ros.mavlink.link import Link  # noqa: E402
from illuminator_ros.mavlink.url import parse_url  # noqa: E402

# s for which the lights of a run are listened to, after they have been found.
LISTENING = 6.0
# Frames per second in the measurement of CPU time, half of them statuses; the same for any
# number of lights, so that nothing but the number differs.
RATE = 400
WARM_UP, MEASURED, ROUNDS = 2.0, 3.0, 5


class Watcher(LightObserver):
    """Counts what lights report."""

    def __init__(self) -> None:
        self.found: dict[Source, float] = {}
        self.lost_count = 0
        self.statuses: Counter[Source] = Counter()

    def connected(self, light: Light) -> None:
        self.found.setdefault(light.source, time.monotonic())

    def lost(self, light: Light, reason: str) -> None:
        self.lost_count += 1

    def status(self, light: Light, status: Status) -> None:
        self.statuses[light.source] += 1


def free_port() -> int:
    """Return a UDP port that nobody uses."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(('127.0.0.1', 0))
        return int(probe.getsockname()[1])


@contextlib.contextmanager
def program(module: str, *arguments: str, **env: str) -> Any:
    """Run a program of ours and end it."""
    process = subprocess.Popen(
        [sys.executable, '-m', module, *arguments], cwd=ROOT, stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL, env={**os.environ, **env})
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(10)


@contextlib.contextmanager
def simulator(port: int, count: int, interval: float) -> Any:
    """Run simulated lights that send to a port."""
    with program('illuminator_ros.simulator', f'udpout://127.0.0.1:{port}', '--count', str(count),
                 '--system-id', '2', '--component-id', '1', '--status-interval',
                 str(interval)) as process:
        yield process


@contextlib.contextmanager
def listening(port: int, **options: Any) -> Any:
    """Run a controller that listens on a port."""
    watcher = Watcher()

    def found(light: Light) -> None:
        light.observer = watcher

    link = Link(parse_url(f'udpin://127.0.0.1:{port}'),
                Controller(Source(1, 194), Settings(), on_light=found, **options),
                label='')
    link.start()
    try:
        yield link, watcher
    finally:
        link.stop()


def discovery(count: int, hertz: float) -> None:
    """Find simulated lights, and listen to them for a while."""
    port = free_port()
    with listening(port) as (link, watcher), simulator(port, count, 1 / hertz):
        while not watcher.found:
            time.sleep(0.01)
        began = min(watcher.found.values())
        time.sleep(LISTENING)
        took = max(watcher.found.values()) - began
        got = [watcher.statuses[source] for source in watcher.found]
        print(f'{count:4} lights at {hertz:g} Hz: {len(watcher.found)} found, the last '
              f'{took:.2f} s after the first; {watcher.lost_count} lost; statuses of one in '
              f'{LISTENING:g} s: {min(got)} to {max(got)}')


def frames(lights: int, seconds: float) -> list[bytes]:
    """Return what lights send in some time: heartbeats and statuses, RATE a second in all."""
    sources = [Source(2 + number // 250, 1 + number % 250) for number in range(lights)]
    sequences: Counter[Source] = Counter()
    result = []

    def add(source: Source, message: Any) -> None:
        result.append(encode_frame(
            message.id, encode_payload(message), sequence=sequences[source] & 0xFF, source=source,
            crc_extra=LAYOUTS[message.id].crc_extra))
        sequences[source] += 1

    for number in range(int(RATE / 2 * seconds)):
        source = sources[number % lights]
        add(source, heartbeat(MavType.ILLUMINATOR))
        add(source, IlluminatorStatus(
            100_000 + int(number * 2000 / RATE), 1, 3, 0, 1, 50.0, 0.0, 0.0, 25.0, 0.05, 10.0))
    return result


def cpu_per_status(lights: int) -> float:
    """Return the CPU time of the link's thread for a status and a heartbeat, s."""
    port = free_port()
    sending = frames(lights, WARM_UP + MEASURED)
    # Nobody answers here: what a light is asked when it is found is soon given up.
    with (listening(port, command_timeout=0.05, command_retries=0) as (link, watcher),
          socket.socket(type=socket.SOCK_DGRAM) as sender):
        sender.connect(('127.0.0.1', port))

        def thread_time() -> float:
            answers: list[float] = []
            answered = threading.Event()
            link.call(lambda now: (answers.append(time.thread_time()), answered.set()))
            answered.wait()
            return answers[0]

        began = time.monotonic()
        before = statuses = 0.0
        for number, frame in enumerate(sending):
            if number == int(WARM_UP * RATE):
                before, statuses = thread_time(), sum(watcher.statuses.values())
            with contextlib.suppress(ConnectionError):
                sender.send(frame)
            if not number % 4:
                time.sleep(max(began + number / RATE - time.monotonic(), 0))
        time.sleep(0.1)
        return (thread_time() - before) / (sum(watcher.statuses.values()) - statuses)


def protocol() -> int:
    """Measure without ROS; return the exit status."""
    for count, hertz in ((1, 1.0), (20, 10.0), (100, 1.0)):
        discovery(count, hertz)
    counts = (1, 10, 100)
    costs: dict[int, list[float]] = {count: [] for count in counts}
    for _ in range(ROUNDS):
        for count in counts:
            costs[count].append(cpu_per_status(count))
    base = statistics.median(costs[1])
    for count in counts:
        cost = statistics.median(costs[count])
        print(f'{count:4} lights, {RATE // 2} statuses and {RATE // 2} heartbeats a second in '
              f'all: {cost * 1e6:.0f} us CPU for one of each, {cost / base:.2f} times one light')
    return 0


def main() -> int:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--nodes', action='store_true', help='with ROS')
    parser.add_argument('--counts', type=int, nargs='+', default=[1, 10, 25, 50, 100],
                        help='numbers of lights for --nodes')
    options = parser.parse_args()
    if options.nodes:
        from nodes import measure
        return measure(options.counts)
    return protocol()


if __name__ == '__main__':
    sys.exit(main())
