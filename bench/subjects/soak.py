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

"""Whether memory stays flat: a light at 10 Hz, with a command now and then."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import statistics
import time

from std_msgs.msg import Float64

from .status import STATE
from ..rig import Bench, bridge, Client, free_port, memory, simulator
from ..rows import at_most, one, Row

INTERVAL = 0.1
# Looks at the memory, whatever the length.
LOOKS, FEWEST = 40, 8
# Share of the looks that it may take until all is loaded that ever is.
WARM_UP = 0.25
# MB; what one does not tell from the allocator's own ups and downs.
LIMIT = 1.0


def measure(bench: Bench) -> Iterator[Row]:
    """Look at the memory of the bridge while it serves."""
    seconds = bench.amount(bench.soak, 0.4)
    port = free_port()
    looks: list[tuple[float, float]] = []
    with contextlib.ExitStack() as stack:
        stack.enter_context(simulator(f'udpout://127.0.0.1:{port}', '--status-interval',
                                      str(INTERVAL)))
        program = stack.enter_context(bridge(f'udpin://127.0.0.1:{port}'))
        client = stack.enter_context(Client(bench.domain))
        client.subscribe(Float64, '/illuminator/uptime', lambda message: None, STATE)
        client.meet('/illuminator/enable')
        began = said = time.monotonic()
        while (now := time.monotonic()) < began + seconds or len(looks) < FEWEST:
            looks.append((now - began, memory(program.pid)['Rss']))
            client.call('/illuminator/enable', len(looks) % 2 == 0)
            if now - said > 60.0:
                said = now
                bench.say(f'{now - began:.0f} s: {looks[-1][1]:.2f} MB')
            time.sleep(seconds / LOOKS)
    late = looks[int(WARM_UP * len(looks)):]
    slope, _ = statistics.linear_regression(*zip(*late, strict=True))
    growth = late[-1][1] - late[0][1]
    yield Row(f'memory gained in {seconds:g} s at 10 Hz, after the first quarter', 'MB',
              one(growth), targets=[at_most(growth, LIMIT, 'MB')],
              note=f'{slope * 3600:.2f} MB/h by regression; {late[-1][1]:.1f} MB at the end',
              curves={'soak': (seconds, {'bridge': late[-1][1]})})
