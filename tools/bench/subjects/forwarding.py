# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Frames of others that are forwarded: delay, CPU and loss."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import importlib.util
from pathlib import Path
import socket
import statistics
import sys
import tempfile
import threading
import time

from support.processes import Program
from support.waiting import eventually, PATIENCE

from ..rig import alternate, Bench, bridge, cpu, cpu_share, interleaved, peer, settle
from ..rows import at_most, Row, times
from ..traffic import frames, Line

OURS, MAVPROXY, BARE = 'bridge', 'MAVProxy', 'bare UDP forwarder'
# Frames a second, and in a block of the measurement.
RATE, BLOCK = 5000, 10_000
# More than the bridge takes for copies of each other, and a multiple of 256.
PREPARED = 8192
# s between two frames whose delay is measured.
PERIOD = 0.004


class Sink:
    """
    A UDP socket that notes when frames arrive.

    :ivar arrived: when each frame arrived last, s.
    :ivar count: of the frames that :attr:`expected` has.
    """

    def __init__(self, expected: frozenset[bytes]) -> None:
        self.arrived: dict[bytes, float] = {}
        self.count = 0
        self._expected = expected
        self._socket = socket.socket(type=socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        self._socket.bind(('127.0.0.1', 0))
        self.port: int = self._socket.getsockname()[1]
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Sink:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        with socket.socket(type=socket.SOCK_DGRAM) as last:
            last.sendto(b'', ('127.0.0.1', self.port))
        self._thread.join()
        self._socket.close()

    def _run(self) -> None:
        while data := self._socket.recv(65536):
            now = time.monotonic()
            for frame in split(data):
                if frame in self._expected:
                    self.count += 1
                    self.arrived[frame] = now


def split(data: bytes) -> Iterator[bytes]:
    """Yield the unsigned frames of MAVLink 2 of which some bytes consist; leave out the rest."""
    while len(data) > 1 and len(data) >= data[1] + 12:
        size = data[1] + 12
        yield data[:size]
        data = data[size:]


def forward(bench: Bench) -> Iterator[Row]:
    """Measure between two UDP ports."""
    prepared = frames(count=PREPARED)
    with contextlib.ExitStack() as stack:
        names = [OURS, BARE] + [MAVPROXY] * (importlib.util.find_spec('MAVProxy') is not None)
        lines, sinks, programs = {}, {}, {}
        for name in names:
            line = lines[name] = stack.enter_context(Line('UDP'))
            sink = sinks[name] = stack.enter_context(Sink(frozenset(prepared)))
            programs[name] = stack.enter_context(forwarder(name, line, sink.port))
            line.feed(prepared, 1000, bench.amount(500, 10))
        yield delay(bench, prepared, lines, sinks)
        yield from load(bench, prepared, lines, sinks,
                        {name: program.pid for name, program in programs.items()})


@contextlib.contextmanager
def forwarder(name: str, line: Line, to: int) -> Iterator[Program]:
    """Run a program that forwards the frames of a line to a port."""
    if name == OURS:
        with bridge(line.urls[0], forward_urls=f"['udpout://127.0.0.1:{to}']") as program:
            yield program
    elif name == BARE:
        with peer('forwarder', line.urls[2][1], to) as program:
            yield program
    else:
        with tempfile.TemporaryDirectory() as directory:
            program = Program(
                sys.executable, '-u', '-m', 'MAVProxy.mavproxy', '--daemon', '--non-interactive',
                '--no-state', '--mav20', '--default-modules=output', f'--master={line.urls[1]}',
                f'--out=udpout:127.0.0.1:{to}', cwd=Path(directory))
            try:
                program.wait_for('Waiting', PATIENCE)
                yield program
            finally:
                # At a signal it ends with another status than 0.
                program.kill()


def delay(
    bench: Bench, prepared: list[bytes], lines: dict[str, Line], sinks: dict[str, Sink],
) -> Row:
    """Measure the time from a port to the other of single frames."""
    def path(name: str) -> float:
        time.sleep(PERIOD)
        sink = sinks[name]
        frame, began = lines[name].next_of(prepared), time.monotonic()
        before = sink.count
        lines[name].feed(prepared, 0, 1)
        eventually(lambda: sink.count > before, f'{name} forwards')
        return sink.arrived[frame] - began

    found = alternate({OURS: lambda: [path(OURS)], BARE: lambda: [path(BARE)]},
                      bench.amount(400, 3), bench.amount(50, 1))
    return Row('delay of a forwarded frame, UDP to UDP', 'ms', found[OURS], {BARE: found[BARE]},
               [times(found[OURS], found[BARE], 2, 'p50')])


def load(
    bench: Bench, prepared: list[bytes], lines: dict[str, Line], sinks: dict[str, Sink],
    pids: dict[str, int],
) -> Iterator[Row]:
    """Measure the CPU time and the loss at 5,000 frames a second."""
    count = bench.amount(BLOCK, 50)
    cost: dict[str, list[float]] = {name: [] for name in lines}
    lost = dict.fromkeys(lines, 0)
    idle = {name: cpu_share(pid, bench.amount(1.0, 0.05)) / 100 for name, pid in pids.items()}
    for name in interleaved([*lines], bench.amount(3, 1)):
        arrived, before, began = sinks[name].count, cpu(pids[name]), time.monotonic()
        lines[name].feed(prepared, RATE, count)
        settle(pids[name])
        rest = idle[name] * (time.monotonic() - began)
        cost[name].append((cpu(pids[name]) - before - rest) / count * 1e6)
        lost[name] += count - (sinks[name].count - arrived)
    found = {name: {'': statistics.median(values)} for name, values in cost.items()}
    ours = found.pop(OURS)
    targets = [times(ours, found[MAVPROXY], 0.5)] if MAVPROXY in found else []
    yield Row(f'CPU for a forwarded frame, UDP to UDP, {RATE:,} frames/s', 'us', ours,
              {name: found[name] for name in (MAVPROXY, BARE) if name in found}, targets)
    shares = {name: {'': 100 * number / (count * len(cost[name]))}
              for name, number in lost.items()}
    yield Row(f'frames lost of {count * len(cost[OURS]):,} at {RATE:,} frames/s', '%',
              shares.pop(OURS), shares, [at_most(lost[OURS], 0, 'frames')])
