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
CPU time for a status with 1, 10 and 100 lights on one link, and how many are found.

Without ROS: the thread of the link is measured, which for each light does all but publish.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
import contextlib
import queue
import socket
import time
from typing import Any

from illuminator_ros.illuminator.events import (
    AnyLightEvent,
    LightConnected,
    LightLost,
    StatusReceived,
)
from illuminator_ros.illuminator.light import Settings
from illuminator_ros.mavlink.frame import encode_frame
from illuminator_ros.mavlink.link import Link
from illuminator_ros.mavlink.messages import (
    Address,
    encode_payload,
    heartbeat,
    IlluminatorStatus,
    LAYOUTS,
    MavType,
)
from illuminator_ros.mavlink.url import parse_url
from support.client import Client

from ..rig import Bench, free_port, interleaved, PATIENCE, simulator
from ..rows import at_most, one, Row, Target

COUNTS = (1, 10, 100)
# Frames per second, half of them statuses; the same for any number of lights, so that nothing
# but the number differs.
RATE = 800
ROUNDS = 7
WARM_UP, MEASURED = 0.4, 0.6
FLAT = 1.2
# s for which lights are listened to once the first is found.
LISTENING = 2.0


class Watcher:
    """Counts what lights report."""

    def __init__(self) -> None:
        self.found: dict[Address, float] = {}
        self.lost_count = 0
        self.statuses: Counter[Address] = Counter()

    def take(self, event: AnyLightEvent) -> None:
        """Count an event."""
        if isinstance(event, StatusReceived):
            self.statuses[event.address] += 1
        elif isinstance(event, LightConnected):
            self.found.setdefault(event.address, time.monotonic())
        elif isinstance(event, LightLost):
            self.lost_count += 1


@contextlib.contextmanager
def listening(port: int, **options: Any) -> Iterator[tuple[Link, Watcher]]:
    """Run a controller that listens on a port."""
    watcher = Watcher()
    client = Client(Address(1, 194), Settings(), **options)
    client.events.subscribe(watcher.take)
    link = Link(parse_url(f'udpin://127.0.0.1:{port}'), client, label='')
    link.start()
    until = time.monotonic() + PATIENCE
    while not link.state().is_open and time.monotonic() < until:
        time.sleep(0.001)
    try:
        yield link, watcher
    finally:
        link.stop()


def frames(lights: int, seconds: float) -> list[bytes]:
    """Return what lights send in some time: heartbeats and statuses, RATE a second in all."""
    sources = [Address(2 + number // 250, 1 + number % 250) for number in range(lights)]
    sequences: Counter[Address] = Counter()
    result = []

    def add(source: Address, message: Any) -> None:
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


def cpu_per_status(lights: int, warm_up: float, measured: float) -> float:
    """Return the CPU time of the link's thread for a status and a heartbeat, s."""
    port = free_port()
    sending = frames(lights, warm_up + measured)
    # No light answers here, so the requests on discovery must end soon.
    with (listening(port, command_timeout=0.05, command_retries=0) as (link, watcher),
          socket.socket(type=socket.SOCK_DGRAM) as sender):
        sender.connect(('127.0.0.1', port))

        def thread_time() -> float:
            answers: queue.SimpleQueue[float] = queue.SimpleQueue()
            link.call(lambda now: answers.put(time.thread_time()))
            return answers.get(timeout=10.0)

        began = time.monotonic()
        before = statuses = 0.0
        for number, frame in enumerate(sending):
            if number == int(warm_up * RATE):
                before, statuses = thread_time(), sum(watcher.statuses.values())
            with contextlib.suppress(ConnectionError):
                sender.send(frame)
            if not number % 4:
                time.sleep(max(began + number / RATE - time.monotonic(), 0))
        until = time.monotonic() + 5.0
        while sum(watcher.statuses.values()) < len(sending) // 2 and time.monotonic() < until:
            time.sleep(0.01)
        return (thread_time() - before) / (sum(watcher.statuses.values()) - statuses)


def measure(bench: Bench) -> Iterator[Row]:
    """Compare the numbers of lights in alternate order, then find them."""
    costs: dict[str, list[float]] = {str(count): [] for count in COUNTS}
    for name in interleaved(list(costs), bench.amount(ROUNDS, 1)):
        costs[name].append(1e6 * cpu_per_status(
            int(name), *bench.amount((WARM_UP, MEASURED), (0.2, 0.1))))
    # The least: whatever else the machine does only adds to it.
    least = {name: min(values) for name, values in costs.items()}
    base = least['1']
    for count in COUNTS:
        cost = least[str(count)]
        targets = [] if count == 1 else [
            Target('at most 1.2 times one light', cost / base, FLAT)]
        yield Row(f'CPU for a status and a heartbeat, without ROS, lights: {count}', 'us',
                  one(cost), {} if count == 1 else {'one light': one(base)},
                  targets, f'{RATE // 2} of each a second in all')
    for count, hertz in bench.amount(((20, 10.0), (100, 1.0)), ((3, 10.0),)):
        yield discovery(count, hertz, bench.amount(LISTENING, 0.3))


def discovery(count: int, hertz: float, seconds: float) -> Row:
    """Find simulated lights, and listen to them for a while."""
    port = free_port()
    with (listening(port) as (_, watcher),
          simulator(f'udpout://127.0.0.1:{port}', '--count', str(count), '--system-id', '2',
                    '--component-id', '1', '--status-interval', str(1 / hertz))):
        while not watcher.found:
            time.sleep(0.01)
        began = min(watcher.found.values())
        time.sleep(seconds)
        took = max(watcher.found.values()) - began
        got = [watcher.statuses[source] for source in watcher.found]
    missing = count - len(watcher.found) + watcher.lost_count
    return Row(f'{count} lights at {hertz:g} Hz: the last is found after the first', 's',
               one(took), targets=[at_most(missing, 0, 'lights missing')],
               note=f'statuses of one in {seconds:g} s: {min(got)} to {max(got)}')
