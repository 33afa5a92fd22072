# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Frames of others that are forwarded: delay, CPU and loss, and a slow line."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import importlib.util
import os
from pathlib import Path
import socket
import statistics
import sys
import tempfile
import threading
import time

from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import decode, mavlink
from support.frames import Codec
from support.processes import Program

from ..devices import SerialEnd
from ..rig import (
    alternate,
    Bench,
    bridge,
    cpu,
    cpu_share,
    interleaved,
    PATIENCE,
    peer,
    settle,
    wait_until,
)
from ..rows import at_most, quantiles, Row, times
from ..traffic import frames, Line

OURS, MAVPROXY, BARE = 'bridge', 'MAVProxy', 'bare UDP forwarder'
# Frames a second, and in a block of the measurement.
RATE, BLOCK = 5000, 10_000
# More than the bridge takes for copies of each other, and a multiple of 256.
PREPARED = 8192
# s between two frames whose delay is measured.
PERIOD = 0.004
# The far end of the slow line, and a ground station that commands it.
FAR, STATION = mav.Address(42, 1), mav.Address(255, 190)
# bytes/s
LINE_RATE = 57600 / 10


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
    """Measure between two UDP ports, then over a slow line."""
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
    yield slow_line(bench, prepared)


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
        wait_until(lambda: sink.count > before, f'{name} forwards')
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


class SlowLine(SerialEnd):
    """
    The far end of a serial line of 57,600 baud, on which a component is heard.

    Each byte takes the time of the line, from its arrival or from the end of the byte before.

    :ivar sent: when the last byte of each command was sent, s, by its first parameter.
    """

    def __init__(self) -> None:
        super().__init__()
        self.sent: dict[float, float] = {}
        self._codec = Codec()
        self._free_at = 0.0

    def beat(self) -> None:
        """Send a heartbeat of the component."""
        os.write(self.far, self._codec.frame(FAR, mav.heartbeat(mavlink.MAV_TYPE_GENERIC)))

    def take(self, data: bytes) -> None:
        """Note when commands were sent."""
        self._free_at = max(self._free_at, time.monotonic()) + len(data) / LINE_RATE
        for frame in self._codec.decoder.feed(data):
            if frame.message_id == mav.CommandLong.id:
                self.sent[decode(mav.CommandLong, frame.payload).param1] = self._free_at


def slow_line(bench: Bench, prepared: list[bytes]) -> Row:
    """Measure the delay of commands through a line that cannot carry the other frames."""
    began: dict[float, float] = {}
    with contextlib.ExitStack() as stack:
        slow = stack.enter_context(SlowLine())
        telemetry = stack.enter_context(Line('UDP'))
        stack.enter_context(bridge(
            telemetry.urls[0], forward_urls=f"['serial://{slow.device}:57600']"))
        station = stack.enter_context(socket.socket(type=socket.SOCK_DGRAM))
        codec = Codec()

        def command() -> None:
            number = float(len(began))
            began[number] = time.monotonic()
            station.sendto(codec.frame(STATION, mav.CommandLong(
                *FAR, mavlink.MAV_CMD_DO_SET_MODE, 0, number, 0, 0, 0, 0, 0, 0)),
                ('127.0.0.1', telemetry.port))

        for _ in range(bench.amount(100, 3)):
            slow.beat()
            telemetry.feed(prepared, RATE, RATE // 5)
            command()
        wait_until(lambda: slow.sent.keys() >= began.keys(), 'all commands have arrived')
    delays = quantiles([1e3 * (slow.sent[number] - at) for number, at in began.items()], 0.5, 1)
    return Row('delay of a COMMAND_LONG over a line of 57,600 baud, beside '
               f'{RATE:,} frames/s for it', 'ms', delays)
