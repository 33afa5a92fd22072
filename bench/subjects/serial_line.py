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
A light on a serial line at 57,600 and 921,600 baud, of which others fill 60 %.

The line is a pseudo-terminal behind which bytes take the time that they would.
"""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
from pathlib import Path
import tempfile
import time

from diagnostic_msgs.msg import DiagnosticArray

from .burst import link_values
from ..rig import Bench, bridge, Client, cpu, peer
from ..rows import at_most, one, quantiles, Row

BAUDS = (57_600, 921_600)
SHARE = 0.6
# Bytes of the command, its acknowledgement and the status that verifies it: the least that a
# verified command takes on an empty line.
LEAST = 44 + 22 + 47
CALLS = 80
MEASURED = 3.0


def measure(bench: Bench) -> Iterator[Row]:
    """Use each line."""
    for baud in BAUDS:
        yield from at(bench, baud)


def at(bench: Bench, baud: int) -> Iterator[Row]:
    """Use a line of one speed."""
    arrays: list[DiagnosticArray] = []
    with contextlib.ExitStack() as stack:
        path = Path(stack.enter_context(tempfile.TemporaryDirectory())) / 'ttyLIGHT'
        stack.enter_context(peer('serial_light', str(path), str(baud), str(SHARE)))
        program = stack.enter_context(bridge(f'serial://{path}:{baud}', diagnostics_period=0.25))
        client = stack.enter_context(Client(bench.domain))
        client.subscribe(DiagnosticArray, '/diagnostics', arrays.append, 10)
        client.meet('/illuminator/enable')
        link_values(arrays)
        before, began = cpu(program.pid), time.monotonic()
        first = link_values(arrays)
        time.sleep(bench.amount(MEASURED, 0.1))
        last = link_values(arrays)
        share = 100 * (cpu(program.pid) - before) / (time.monotonic() - began)
        took, failed = [], 0
        for number in range(bench.amount(CALLS, 4)):
            seconds, answer = client.call('/illuminator/enable', number % 2 == 0)
            failed += answer is None or not answer.success
            took.append(seconds * 1e3)
        end = link_values(arrays)
    speed = f'{baud:,} baud, {SHARE:.0%} used by others'
    rate = (int(last['bytes_received']) - int(first['bytes_received'])) / (
        float(last['at']) - float(first['at']))
    found = quantiles(took)
    yield Row(f'~/enable over serial, {speed}', 'ms', found,
              {'least on an empty line': dict.fromkeys(found, LEAST * 10 / baud * 1000.0)},
              note=f'{failed} of {len(took)} failed, '
                   f'{end["commands_resent"]} commands sent again')
    yield Row(f'CPU of the bridge, serial, {speed}', '%', one(share),
              note=f'{rate:,.0f} B/s come in')
    lost, wrong = int(end['frames_lost']), int(end['crc_errors'])
    yield Row(f'frames of the light lost, serial, {speed}', 'frames', one(lost),
              targets=[at_most(lost, 0, 'frames')],
              note=f'{wrong} times something looked like a frame and was none')
