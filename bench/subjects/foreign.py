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
CPU time for a frame of another component, on a link that an autopilot uses too.

The receivers are the bridge, pymavlink's ``recv_match`` and a loop that only reads; the CPU time
of each at rest is subtracted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import time

from ..rig import Bench, bridge, cpu, free_port, interleaved, peer, Program, settle
from ..rows import middle, one, Row, times
from ..traffic import frames, Line, SerialPort, TcpListener, udp_line

OURS, RECV_MATCH, BARE = 'bridge', 'recv_match', 'bare receive loop'
BAUD = 921_600
# Frames a second (0: as many as the receiver takes) -> frames in a block.
RATES = {500: 350, 5000: 2500, 0: 6000}
# The rates with targets: at 500 frames a second, waking up takes more CPU time than a frame.
BUSY = (5000, 0)
TARGETS = {'UDP': 1 / 4, 'TCP': 1 / 8, 'serial': 1 / 8}


class Receiver:
    """A receiver and its CPU time."""

    def __init__(self, program: Program, line: Line) -> None:
        self.program, self.line = program, line
        self.costs: dict[int, list[float]] = {rate: [] for rate in RATES}
        self._idle = 0.0

    def rest(self, seconds: float) -> None:
        """Measure the CPU time at rest."""
        before, began = cpu(self.program.pid), time.monotonic()
        time.sleep(seconds)
        self._idle = (cpu(self.program.pid) - before) / (time.monotonic() - began)

    @property
    def at_rest(self) -> float:
        """Return the CPU time at rest, % of a core."""
        return 100 * self._idle

    def measure(self, prepared: list[bytes], rate: int, count: int) -> None:
        """Send frames and measure the CPU time of each."""
        before, began = cpu(self.program.pid), time.monotonic()
        self.line.feed(prepared, rate, count)
        settle(self.program.pid)
        idle = self._idle * (time.monotonic() - began)
        self.costs[rate].append((cpu(self.program.pid) - before - idle) / count * 1e6)


def receivers(transport: str, stack: contextlib.ExitStack) -> dict[str, Receiver]:
    """Start the three receivers, each with a line of its own."""
    found = {}
    for name in (OURS, RECV_MATCH, BARE):
        make_line: Callable[[], Line]
        if transport == 'UDP':
            port = free_port()
            urls = f'udpin://127.0.0.1:{port}', f'udpin:127.0.0.1:{port}', ('udp', str(port))

            def make_line(port: int = port) -> Line:
                return udp_line(port)
        elif transport == 'TCP':
            listener = TcpListener()
            make_line, port = listener.line, listener.port
            urls = f'tcpout://127.0.0.1:{port}', f'tcp:127.0.0.1:{port}', ('tcp', str(port))
        else:
            serial = SerialPort()
            make_line, path = serial.line, serial.path
            urls = f'serial://{path}:{BAUD}', f'{path},{BAUD}', ('serial', path)
        program = stack.enter_context(
            bridge(urls[0]) if name == OURS
            else peer('recv_match', urls[1]) if name == RECV_MATCH
            else peer('bare_receiver', *urls[2]))
        line = make_line()
        stack.callback(line.close)
        found[name] = Receiver(program, line)
    return found


def measure(bench: Bench) -> Iterator[Row]:
    """Send frames to all three receivers over each transport at each rate."""
    for transport in TARGETS:
        yield from over(bench, transport)


def over(bench: Bench, transport: str) -> Iterator[Row]:
    """Send frames to all three receivers over one transport."""
    prepared = frames()
    with contextlib.ExitStack() as stack:
        fed = receivers(transport, stack)
        for receiver in fed.values():
            receiver.line.feed(prepared, 2000, bench.amount(500, 10))
        time.sleep(bench.amount(1.0, 0.0))
        for receiver in fed.values():
            settle(receiver.program.pid)
        for receiver in fed.values():
            receiver.rest(bench.amount(1.0, 0.05))
        for rate, count in RATES.items():
            for name in interleaved(list(fed), bench.amount(2, 1)):
                fed[name].measure(prepared, rate, bench.amount(count, 20))
    rest = {name: receiver.at_rest for name, receiver in fed.items()}
    yield Row(f'CPU with nothing coming in, {transport}', '%', one(rest[OURS]),
              {RECV_MATCH: one(rest[RECV_MATCH]), BARE: one(rest[BARE])})
    for rate in RATES:
        ours, *others = (middle(receiver.costs[rate]) for receiver in fed.values())
        peers = dict(zip((RECV_MATCH, BARE), others, strict=True))
        speed = f'{rate:,} frames/s' if rate else 'saturated'
        targets = [times(ours, peers[RECV_MATCH], TARGETS[transport])] if rate in BUSY else []
        yield Row(f'CPU for a foreign frame, {transport}, {speed}', 'us', ours, peers, targets)
