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

"""``~/enable`` while an autopilot uses the same UDP port, and whether a frame is lost then."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import time

from ..rig import Bench, bridge, Client, free_port, peer, simulator, udp_queue
from ..rows import at_most, Figures, quantiles, Row

RATES = (0, 500, 5000)
CALLS = 300


def measure(bench: Bench) -> Iterator[Row]:
    """Call at each rate of frames."""
    port = free_port()
    quiet: Figures = {}
    with contextlib.ExitStack() as stack:
        stack.enter_context(simulator(f'udpout://127.0.0.1:{port}'))
        stack.enter_context(bridge(f'udpin://127.0.0.1:{port}'))
        client = stack.enter_context(Client(bench.domain))
        client.meet('/illuminator/enable')
        for rate in RATES:
            _, before = udp_queue(port)
            took = []
            with contextlib.ExitStack() as beside:
                autopilot = beside.enter_context(
                    peer('autopilot', str(port), str(rate))) if rate else None
                time.sleep(bench.amount(0.5, 0.0))
                for number in range(bench.amount(CALLS, 4)):
                    seconds, answer = client.call('/illuminator/enable', number % 2 == 0)
                    if answer is None or not answer.success:
                        raise RuntimeError(f'~/enable: {answer}')
                    took.append(seconds * 1e3)
            lost = udp_queue(port)[1] - before
            sent = int(autopilot.log.rpartition('frames ')[2]) if autopilot else 0
            found = quantiles(took)
            quiet = quiet or found
            yield Row(f'~/enable beside {rate:,} frames/s of others', 'ms', found,
                      {'beside none': quiet} if rate else {},
                      [at_most(lost, 0, 'frames lost')],
                      f'{sent:,} frames' if rate else '')
