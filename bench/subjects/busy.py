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

from ..rig import Bench, bridge, Client, free_port, interleaved, peer, simulator, udp_queue
from ..rows import at_most, quantiles, Row

RATES = (0, 500, 5000)
CALLS = 150


def measure(bench: Bench) -> Iterator[Row]:
    """Call at each rate of frames."""
    port = free_port()
    took: dict[str, list[float]] = {str(rate): [] for rate in RATES}
    sent, lost = dict.fromkeys(took, 0), dict.fromkeys(took, 0)
    with contextlib.ExitStack() as stack:
        stack.enter_context(simulator(f'udpout://127.0.0.1:{port}'))
        stack.enter_context(bridge(f'udpin://127.0.0.1:{port}'))
        client = stack.enter_context(Client(bench.domain))
        client.meet('/illuminator/enable')
        for rate in interleaved(list(took), bench.amount(2, 1)):
            _, before = udp_queue(port)
            with contextlib.ExitStack() as beside:
                autopilot = beside.enter_context(
                    peer('autopilot', str(port), rate)) if rate != '0' else None
                time.sleep(bench.amount(0.3, 0.0))
                for number in range(bench.amount(CALLS, 4)):
                    seconds, answer = client.call('/illuminator/enable', number % 2 == 0)
                    if answer is None or not answer.success:
                        raise RuntimeError(f'~/enable: {answer}')
                    took[rate].append(seconds * 1e3)
            lost[rate] += udp_queue(port)[1] - before
            sent[rate] += int(autopilot.log.rpartition('frames ')[2]) if autopilot else 0
    quiet, *others = (quantiles(values) for values in took.values())
    yield Row('~/enable beside no frames of others', 'ms', quiet)
    for frames, found in zip(RATES[1:], others, strict=True):
        name = str(frames)
        yield Row(f'~/enable beside {frames:,} frames/s of others', 'ms', found,
                  {'beside none': quiet}, [at_most(lost[name], 0, 'frames lost')],
                  f'{sent[name]:,} frames')
