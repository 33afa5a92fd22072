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
Frames lost from a burst over loopback UDP, with the buffers that each program requests.

The bridge reports its count in the diagnostics; the peer is pymavlink's ``recv_match``.
"""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
from pathlib import Path
import time

from diagnostic_msgs.msg import DiagnosticArray

from ..rig import Bench, bridge, Client, free_port, interleaved, PATIENCE, peer, settle
from ..rows import at_most, one, Row
from ..traffic import COMMON, frames, udp_line

OURS, RECV_MATCH = 'bridge', 'recv_match'
BURST, AT_ONCE, INTERVAL = 20_000, 1000, 0.05
LINK = 'illuminator: link'
# Bytes of the largest receive buffer that the kernel grants; the bridge requests 4 MiB.
RMEM_MAX = Path('/proc/sys/net/core/rmem_max')


def measure(bench: Bench) -> Iterator[Row]:
    """Send bursts to both, in alternate order."""
    size = bench.amount(BURST, 200)
    prepared = frames(COMMON)
    ports = {OURS: free_port(), RECV_MATCH: free_port()}
    sent = dict.fromkeys(ports, 0)
    arrays: list[DiagnosticArray] = []
    with contextlib.ExitStack() as stack:
        programs = {
            OURS: stack.enter_context(bridge(f'udpin://127.0.0.1:{ports[OURS]}',
                                             diagnostics_period=0.25)),
            RECV_MATCH: stack.enter_context(
                peer('recv_match', f'udpin:127.0.0.1:{ports[RECV_MATCH]}'))}
        client = stack.enter_context(Client(bench.domain))
        client.subscribe(DiagnosticArray, '/diagnostics', arrays.append, 10)
        lines = {name: udp_line(port) for name, port in ports.items()}
        for line in lines.values():
            stack.callback(line.close)
        for name in interleaved(list(ports), bench.amount(2, 1)):
            began = time.monotonic()
            for number in range(size // AT_ONCE or 1):
                time.sleep(max(began + number * INTERVAL - time.monotonic(), 0.0))
                # A rate above that of any sender: all frames are sent at once.
                lines[name].feed(prepared, 1e9, min(AT_ONCE, size))
            settle(programs[name].pid)
            sent[name] += size
        programs[RECV_MATCH].end()
        _, _, theirs = programs[RECV_MATCH].log.rpartition('frames ')
        ours = int(link_values(arrays)['frames_received'])
    lost = {OURS: sent[OURS] - ours, RECV_MATCH: sent[RECV_MATCH] - int(theirs)}
    share = {name: 100 * lost[name] / sent[name] for name in lost}
    yield Row(f'frames lost of bursts of {size:,}, {AT_ONCE:,} per {INTERVAL * 1e3:g} ms', '%',
              one(share[OURS]), {RECV_MATCH: one(share[RECV_MATCH])},
              [at_most(lost[OURS], 0, 'frames')],
              f'{lost[OURS]:,} and {lost[RECV_MATCH]:,} of {sent[OURS]:,} each; '
              f'net.core.rmem_max is {int(RMEM_MAX.read_text()):,}')


def link_values(arrays: list[DiagnosticArray]) -> dict[str, str]:
    """Return the values of the link in the next diagnostics."""
    known, until = len(arrays), time.monotonic() + PATIENCE
    # Take the second one: the first may have been sent before.
    while len(arrays) < known + 2 and time.monotonic() < until:
        time.sleep(0.01)
    stamp = arrays[-1].header.stamp
    (values,) = (status.values for status in arrays[-1].status if status.name == LINK)
    return {'at': str(stamp.sec + stamp.nanosec / 1e9),
            **{value.key: value.value for value in values}}
