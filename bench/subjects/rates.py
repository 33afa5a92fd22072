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

"""CPU of the whole bridge, and latency, with a light's status at 1, 10 and 50 Hz."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import time

from std_msgs.msg import Float64

from .status import STATE
from ..light import Sender
from ..rig import Bench, bridge, Client, cpu, free_port, PATIENCE
from ..rows import one, quantiles, Row

RATES = (1.0, 10.0, 50.0)
MEASURED = 3.0


def measure(bench: Bench) -> Iterator[Row]:
    """Let one light send at each rate."""
    port = free_port()
    with contextlib.ExitStack() as stack:
        program = stack.enter_context(bridge(f'udpin://127.0.0.1:{port}'))
        client = stack.enter_context(Client(bench.domain))
        sender = stack.enter_context(contextlib.closing(Sender(port)))
        statuses: list[float] = []

        def came(message: Float64) -> None:
            at = time.monotonic()
            statuses.append((at - sender.sent[round(message.data * 1000)]) * 1e3)

        client.subscribe(Float64, '/illuminator/uptime', came, STATE)
        until = time.monotonic() + PATIENCE
        while not statuses:
            if time.monotonic() > until:
                raise RuntimeError('nothing is published')
            sender.stream(0.1, 0.02)
        sender.stream(bench.amount(2.0, 0.1), 0.05)
        for rate in RATES:
            before, count, began = cpu(program.pid), len(statuses), time.monotonic()
            sender.stream(bench.amount(MEASURED, 0.1), 1 / rate)
            seconds = time.monotonic() - began
            used = cpu(program.pid) - before
            yield Row(f'CPU of the bridge, one light at {rate:g} Hz', '%',
                      one(100 * used / seconds),
                      note=f'{len(statuses) - count} statuses in {seconds:.1f} s')
            time.sleep(0.1)
            yield Row(f'status to a subscriber at {rate:g} Hz', 'ms',
                      quantiles(statuses[count:]))
