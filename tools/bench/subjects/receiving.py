# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Frames of others: their cost, bursts, noise."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
import contextlib
from pathlib import Path
import queue
import random
import statistics
import time

from diagnostic_msgs.msg import DiagnosticArray
from illuminator_ros.mavlink.frame import Decoder
from pymavlink.dialects.v20 import ardupilotmega
from rclpy.qos import QoSProfile
from support.waiting import PATIENCE

from ..rig import Bench, bridge, Client, cpu, cpu_share, interleaved, peer, settle
from ..rows import at_most, Row, times
from ..traffic import COMMON, frames, Line

OURS, RECV_MATCH, BARE = 'bridge', 'recv_match', 'bare receive loop'
# Frames a second (0: as many as the receiver takes) -> frames in a block.
RATES = {5000: 2500, 0: 6000}
TARGETS = {'UDP': 1 / 4, 'TCP': 1 / 7, 'serial': 1 / 8}


def foreign(bench: Bench) -> Iterator[Row]:
    """
    Measure the CPU time for a frame of another component, as on a link of an autopilot.

    The receivers are the bridge, pymavlink's ``recv_match`` and a loop that only reads; the CPU
    time of each at rest is subtracted.
    """
    for transport in TARGETS:
        yield from over(bench, transport)


def over(bench: Bench, transport: str) -> Iterator[Row]:
    """Send frames to all three receivers over one transport."""
    prepared = frames()
    lines: dict[str, Line] = {}
    pids: dict[str, int] = {}
    costs: dict[tuple[int, str], list[float]] = {
        (rate, name): [] for rate in RATES for name in (OURS, RECV_MATCH, BARE)}
    with contextlib.ExitStack() as stack:
        for name in (OURS, RECV_MATCH, BARE):
            line = lines[name] = stack.enter_context(Line(transport))
            ours, theirs, bare = line.urls
            pids[name] = stack.enter_context(
                bridge(ours) if name == OURS else peer('recv_match', theirs) if name == RECV_MATCH
                else peer('bare_receiver', *bare)).pid
            line.feed(prepared, 2000, bench.amount(500, 10))
        time.sleep(bench.amount(1.0, 0.0))
        for pid in pids.values():
            settle(pid)
        idle = {name: cpu_share(pid, bench.amount(1.0, 0.05)) / 100 for name, pid in pids.items()}
        for rate, count in RATES.items():
            count = bench.amount(count, 20)
            for name in interleaved([*lines], bench.amount(2, 1)):
                before, began = cpu(pids[name]), time.monotonic()
                lines[name].feed(prepared, rate, count)
                settle(pids[name])
                rest = idle[name] * (time.monotonic() - began)
                costs[rate, name].append((cpu(pids[name]) - before - rest) / count * 1e6)
    for rate in RATES:
        found = {name: {'': statistics.median(costs[rate, name])} for name in lines}
        speed = f'{rate:,} frames/s' if rate else 'saturated'
        yield Row(f'CPU for a foreign frame, {transport}, {speed}', 'us', found.pop(OURS), found,
                  [times({'': statistics.median(costs[rate, OURS])}, found[RECV_MATCH],
                         TARGETS[transport])])


BURST, AT_ONCE, INTERVAL = 20_000, 1000, 0.05
# Bytes of the largest receive buffer that the kernel grants; the bridge requests 4 MiB.
RMEM_MAX = Path('/proc/sys/net/core/rmem_max')


def burst(bench: Bench) -> Iterator[Row]:
    """
    Count frames lost from bursts over loopback UDP, with the buffers that programs request.

    The bridge reports its count in the diagnostics; the peer is pymavlink's ``recv_match``.
    """
    size, rounds = bench.amount(BURST, 200), bench.amount(2, 1)
    prepared = frames(COMMON)
    arrays: queue.SimpleQueue[DiagnosticArray] = queue.SimpleQueue()
    with contextlib.ExitStack() as stack:
        lines = {name: stack.enter_context(Line('UDP')) for name in (OURS, RECV_MATCH)}
        programs = {
            OURS: stack.enter_context(bridge(lines[OURS].urls[0], diagnostics_period=0.25)),
            RECV_MATCH: stack.enter_context(peer('recv_match', lines[RECV_MATCH].urls[1]))}
        client = stack.enter_context(Client(bench))
        client.subscribe(DiagnosticArray, '/diagnostics', arrays.put, QoSProfile(depth=10))
        for name in interleaved([*lines], rounds):
            began = time.monotonic()
            for number in range(size // AT_ONCE or 1):
                time.sleep(max(began + number * INTERVAL - time.monotonic(), 0.0))
                # A rate above that of any sender: all frames are sent at once.
                lines[name].feed(prepared, 1e9, min(AT_ONCE, size))
            settle(programs[name].pid)
        programs[RECV_MATCH].end()
        theirs = int(programs[RECV_MATCH].log.rpartition('frames ')[2])
        while not arrays.empty():
            arrays.get()
        # Take the second one: the first may have been sent before.
        arrays.get(timeout=PATIENCE)
        [ours] = [int(value.value) for status in arrays.get(timeout=PATIENCE).status
                  for value in status.values
                  if (status.name, value.key) == ('illuminator: link', 'frames_received')]
    sent = size * rounds
    yield Row(f'frames lost of bursts of {size:,}, {AT_ONCE:,} per {INTERVAL * 1e3:g} ms', '%',
              {'': 100 * (sent - ours) / sent}, {RECV_MATCH: {'': 100 * (sent - theirs) / sent}},
              [at_most(sent - ours, 0, 'frames')],
              f'net.core.rmem_max is {int(RMEM_MAX.read_text()):,}')


MOST_NOISE = 40
# Bytes of one read.
PIECE = 512
# Longer than any frame, so that the parser waits for no further bytes at the end.
END = bytes(300)


def noise(bench: Bench) -> Iterator[Row]:
    """Find good frames in a stream with 0 to 40 bytes of noise between them."""
    good = frames(COMMON, bench.amount(20_000, 200))
    draw = random.Random('noise')
    stream = b''.join(draw.randbytes(draw.randint(0, MOST_NOISE)) + frame for frame in good) + END
    pieces = [stream[at:at + PIECE] for at in range(0, len(stream), PIECE)]
    decoder = Decoder()
    ours = Counter((frame.message_id, frame.sequence, frame.payload)
                   for piece in pieces for frame in decoder.feed(piece))
    parser = ardupilotmega.MAVLink(None)
    parser.robust_parsing = True
    theirs = Counter(bytes(message.get_msgbuf()) for piece in pieces
                     for message in parser.parse_buffer(piece) or [])
    wanted = Counter((frame[7] | frame[8] << 8 | frame[9] << 16, frame[4], frame[10:-2])
                     for frame in good)
    # A frame that noise happens to form must not count as recovered.
    missing, theirs_missing = (wanted - ours).total(), (Counter(good) - theirs).total()
    yield Row('good frames recovered from noise', '%', {'': 100 * (1 - missing / len(good))},
              {"pymavlink's parser": {'': 100 * (1 - theirs_missing / len(good))}},
              [at_most(missing, 0, 'frames missing')])
