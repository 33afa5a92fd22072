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

"""The delay that a silent light causes to others: ``~/enable`` of three lights beside it."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import threading
import time

from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address

from ..light import serving
from ..rig import Bench, bridge, Client, free_port, PATIENCE
from ..rows import quantiles, Row, times

LIGHTS, CALLS, ROUNDS = 4, 100, 3
BESIDE, ALONE = 'beside a silent light', 'undisturbed'


def measure(bench: Bench) -> Iterator[Row]:
    """Call each light in turn; in every second round one more is silent and called meanwhile."""
    port = free_port()
    names = ['illuminator', *(f'illuminator_1_{244 + number}' for number in range(LIGHTS - 1))]
    *others, silent = (f'/{name}/enable' for name in names)
    took: dict[str, list[float]] = {BESIDE: [], ALONE: []}
    with contextlib.ExitStack() as stack:
        stack.enter_context(bridge(f'udpin://127.0.0.1:{port}', target_component=243))
        lights = [stack.enter_context(serving(port, Address(1, 243 + number)))
                  for number in range(LIGHTS)]
        client = stack.enter_context(Client(bench.domain))
        second = stack.enter_context(Client(bench.domain))
        for service in others:
            client.meet(service)
        second.meet(silent)
        for _ in range(bench.amount(ROUNDS, 1)):
            for kind, values in took.items():
                ended = threading.Event()
                thread = threading.Thread(target=keep_calling, args=(second, silent, ended))
                lights[-1].silent = {
                    mavlink.MAV_CMD_ILLUMINATOR_ON_OFF} if kind == BESIDE else set()
                if kind == BESIDE:
                    lights[-1].asked.clear()
                    thread.start()
                    lights[-1].asked.wait(PATIENCE)
                for number in range(bench.amount(CALLS, 3)):
                    service = others[number % len(others)]
                    seconds, answer = client.call(service, bool(number // len(others) % 2))
                    if answer is None or not answer.success:
                        raise RuntimeError(f'{service}: {answer}')
                    values.append(seconds * 1e3)
                ended.set()
                if kind == BESIDE:
                    thread.join()
            time.sleep(0.1)
    ours, peer = quantiles(took[BESIDE]), quantiles(took[ALONE])
    yield Row('~/enable of three lights beside a silent one', 'ms', ours, {ALONE: peer},
              [times(ours, peer, 3.0, 'p99')], note=f'{len(took[BESIDE])} calls of each')


def keep_calling(client: Client, service: str, ended: threading.Event) -> None:
    """Call a service again and again."""
    while not ended.is_set():
        client.call(service, True, 10.0)
