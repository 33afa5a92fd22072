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

The turns of the link run without ROS and without sockets, and do everything except publishing.
Time is simulated, so that the numbers of lights are compared in turn within milliseconds: on a
shared machine, the processor's speed and caches change the cost by half from one second to the
next.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
import itertools
import time

from illuminator_ros.illuminator.events import LightEvent, StatusReceived
from illuminator_ros.illuminator.light import Settings
from illuminator_ros.illuminator.messages import IlluminatorStatus
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address, heartbeat, Message
from support.client import Client
from support.frames import frame_of
from support.simulated_link import SimulatedLink

from ..rig import Bench, interleaved
from ..rows import one, Row, times

COUNTS = (1, 10, 100)
# Frames per second, half of them statuses; the same for any number of lights, so that only the
# number differs.
RATE = 800
# Frames before the measurement, until the requests for identity have ended, and in each part of
# the measurement: those of 1 s, so that each part has the work that is due once a second.
WARM_UP, PART = 10 * RATE, RATE
ROUNDS = 75
FLAT = 1.2
PEER = '127.0.0.1', 14550


class Lights:
    """
    A link with some lights.

    :ivar costs: CPU time for a status and a heartbeat in each part of the measurement, us.
    """

    def __init__(self, number: int, warm_up: int) -> None:
        # The lights do not answer, and the client soon gives up its first requests.
        client = Client(Address(1, 194), Settings(), command_timeout=0.05, command_retries=0)
        client.events.subscribe(self._count)
        self._link = SimulatedLink(client, lambda data, peer: None)
        self._frames = frames(number)
        self._statuses = 0
        self.costs: list[float] = []
        self.measure(warm_up)
        self.costs.clear()

    def _count(self, event: LightEvent) -> None:
        self._statuses += isinstance(event, StatusReceived)

    def measure(self, count: int) -> None:
        """Receive some frames, and measure the CPU time."""
        received = [(frame, PEER) for frame in itertools.islice(self._frames, count)]
        before, began = self._statuses, time.thread_time()
        for datagram in received:
            self._link.receive(datagram)
            self._link.run(1 / RATE)
        self.costs.append(1e6 * (time.thread_time() - began) / (self._statuses - before))


def frames(lights: int) -> Iterator[bytes]:
    """Yield what lights send: heartbeats and statuses, RATE a second in all."""
    sources = [Address(2 + number // 250, 1 + number % 250) for number in range(lights)]
    sequences: Counter[Address] = Counter()

    def next_frame(source: Address, message: Message) -> bytes:
        sequences[source] += 1
        return frame_of(message, sequences[source] & 0xFF, source)

    for number in itertools.count():
        source = sources[number % lights]
        yield next_frame(source, heartbeat(mavlink.MAV_TYPE_ILLUMINATOR))
        yield next_frame(source, IlluminatorStatus(
            100_000 + int(number * 2000 / RATE), 1, 3, 0, 1, 50.0, 0.0, 0.0, 25.0, 0.05, 10.0))


def measure(bench: Bench) -> Iterator[Row]:
    """Compare the numbers of lights in alternate order."""
    found = {str(count): Lights(count, bench.amount(WARM_UP, RATE)) for count in COUNTS}
    for name in interleaved(list(found), bench.amount(ROUNDS, 1)):
        found[name].measure(bench.amount(PART, 20))
    # Take the least: other load on the machine only adds to it.
    least = {name: min(lights.costs) for name, lights in found.items()}
    base = one(least['1'])
    for name, cost in least.items():
        targets = [] if name == '1' else [times(one(cost), base, FLAT)]
        yield Row(f'CPU for a status and a heartbeat, without ROS, lights: {name}', 'us',
                  one(cost), {'one light': base}, targets,
                  f'{RATE // 2} of each a second in all')
