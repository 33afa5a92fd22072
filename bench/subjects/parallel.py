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

"""By how much a light that is silent delays the others: ``~/enable`` of three beside it."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import itertools
import threading
import time
from typing import Any

from illuminator_ros.mavlink.link import Link
from illuminator_ros.mavlink.messages import Address, CommandLong, MavCmd
from illuminator_ros.mavlink.url import parse_url
from support.fake_light import FakeLight

from ..rig import Bench, bridge, Client, free_port, PATIENCE
from ..rows import quantiles, Row, times

LIGHTS, CALLS, ROUNDS = 4, 100, 3
BESIDE, ALONE = 'beside a silent light', 'undisturbed'


class Light(FakeLight):
    """
    A light that can be silent about being switched.

    :ivar switched: set when it is asked to.
    """

    def __init__(self, source: Address) -> None:
        super().__init__(source)
        self.pushes = True
        self.switched = threading.Event()

    def receive(self, source: Address, message: Any, now: float) -> None:
        super().receive(source, message, now)
        if isinstance(message, CommandLong) and message.command == MavCmd.ILLUMINATOR_ON_OFF:
            self.switched.set()


@contextlib.contextmanager
def served(port: int, source: Address) -> Iterator[Light]:
    """Serve a light by a thread of this process."""
    light = Light(source)
    link = Link(parse_url(f'udpout://127.0.0.1:{port}'), light, label='')
    link.start()
    try:
        yield light
    finally:
        link.stop()


def measure(bench: Bench) -> Iterator[Row]:
    """Call each light in turn, with all answering and with one silent and called all the time."""
    port = free_port()
    names = ['illuminator', *(f'illuminator_1_{244 + number}' for number in range(LIGHTS - 1))]
    services = [f'/{name}/enable' for name in names]
    *others, silent = services
    took: dict[str, list[float]] = {BESIDE: [], ALONE: []}
    with contextlib.ExitStack() as stack:
        stack.enter_context(bridge(f'udpin://127.0.0.1:{port}', target_component=243))
        lights = [stack.enter_context(served(port, Address(1, 243 + number)))
                  for number in range(LIGHTS)]
        client = stack.enter_context(Client(bench.domain))
        nagging = stack.enter_context(Client(bench.domain))
        for service in services:
            client.meet(service)
        nagging.meet(silent)
        for _ in range(bench.amount(ROUNDS, 1)):
            for kind in (ALONE, BESIDE):
                lights[-1].results[MavCmd.ILLUMINATOR_ON_OFF] = None if kind == BESIDE else 0
                ended = threading.Event()
                thread = threading.Thread(target=nag, args=(nagging, silent, ended))
                if kind == BESIDE:
                    lights[-1].switched.clear()
                    thread.start()
                    lights[-1].switched.wait(PATIENCE)
                calls = zip(range(bench.amount(CALLS, 3)), itertools.cycle(others), strict=False)
                for number, service in calls:
                    seconds, answer = client.call(service, bool(number // len(others) % 2))
                    if answer is None or not answer.success:
                        raise RuntimeError(f'{service}: {answer}')
                    took[kind].append(seconds * 1e3)
                ended.set()
                if kind == BESIDE:
                    thread.join()
            time.sleep(0.1)
    ours, peer = quantiles(took[BESIDE]), quantiles(took[ALONE])
    yield Row('~/enable of three lights beside a silent one', 'ms', ours, {ALONE: peer},
              [times(ours, peer, 3.0, 'p99')], note=f'{len(took[BESIDE])} calls of each')


def nag(client: Client, service: str, ended: threading.Event) -> None:
    """Call a service again and again."""
    while not ended.is_set():
        client.call(service, True, 10.0)
