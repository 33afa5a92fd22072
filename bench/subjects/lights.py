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
CPU time for a status with 1, 10 and 100 lights on one link.

Without ROS: the thread of the link is measured, which for each light does all but publish.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
import contextlib
import queue
import socket
import time

from illuminator_ros.illuminator.events import AnyLightEvent, StatusReceived
from illuminator_ros.illuminator.light import Settings
from illuminator_ros.illuminator.messages import IlluminatorStatus
from illuminator_ros.mavlink.link import Link
from illuminator_ros.mavlink.messages import Address, heartbeat, MavType, Message
from illuminator_ros.mavlink.url import parse_url
from support.client import Client
from support.frames import frame_of

from ..rig import Bench, free_port, interleaved, PATIENCE
from ..rows import one, Row, times

COUNTS = (1, 10, 100)
# Frames per second, half of them statuses; the same for any number of lights, so that nothing
# but the number differs.
RATE = 800
ROUNDS = 7
WARM_UP, MEASURED = 0.4, 0.6
FLAT = 1.2


@contextlib.contextmanager
def listening(port: int) -> Iterator[tuple[Link, list[AnyLightEvent]]]:
    """Run a client of lights that listens on a port; yield its link and its events."""
    events: list[AnyLightEvent] = []
    # The lights do not answer, and the client soon gives up its first requests.
    client = Client(Address(1, 194), Settings(), command_timeout=0.05, command_retries=0)
    client.events.subscribe(events.append)
    link = Link(parse_url(f'udpin://127.0.0.1:{port}'), client, label='')
    link.start()
    until = time.monotonic() + PATIENCE
    while not link.state().is_open and time.monotonic() < until:
        time.sleep(0.001)
    try:
        yield link, events
    finally:
        link.stop()


def frames(lights: int, seconds: float) -> list[bytes]:
    """Return what lights send in some time: heartbeats and statuses, RATE a second in all."""
    sources = [Address(2 + number // 250, 1 + number % 250) for number in range(lights)]
    sequences: Counter[Address] = Counter()
    result = []

    def add(source: Address, message: Message) -> None:
        result.append(frame_of(message, sequences[source] & 0xFF, source))
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
    with (listening(port) as (link, events),
          socket.socket(type=socket.SOCK_DGRAM) as sender):
        sender.connect(('127.0.0.1', port))

        def statuses() -> int:
            return sum(isinstance(event, StatusReceived) for event in list(events))

        def thread_time() -> float:
            answers: queue.SimpleQueue[float] = queue.SimpleQueue()
            link.call(lambda now: answers.put(time.thread_time()))
            return answers.get(timeout=10.0)

        began = time.monotonic()
        before, count = 0.0, 0
        for number, frame in enumerate(sending):
            if number == int(warm_up * RATE):
                before, count = thread_time(), statuses()
            with contextlib.suppress(ConnectionError):
                sender.send(frame)
            if not number % 4:
                time.sleep(max(began + number / RATE - time.monotonic(), 0))
        until = time.monotonic() + 5.0
        while statuses() < len(sending) // 2 and time.monotonic() < until:
            time.sleep(0.01)
        return (thread_time() - before) / (statuses() - count)


def measure(bench: Bench) -> Iterator[Row]:
    """Compare the numbers of lights in alternate order, then find them."""
    costs: dict[str, list[float]] = {str(count): [] for count in COUNTS}
    for name in interleaved(list(costs), bench.amount(ROUNDS, 1)):
        costs[name].append(1e6 * cpu_per_status(
            int(name), *bench.amount((WARM_UP, MEASURED), (0.2, 0.1))))
    # The least: whatever else the machine does only adds to it.
    least = {name: min(values) for name, values in costs.items()}
    base = one(least['1'])
    for name, cost in least.items():
        targets = [] if name == '1' else [times(one(cost), base, FLAT)]
        yield Row(f'CPU for a status and a heartbeat, without ROS, lights: {name}', 'us',
                  one(cost), {'one light': base}, targets,
                  f'{RATE // 2} of each a second in all')
