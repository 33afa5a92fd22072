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

"""What a light reports when it is left alone, and on request."""

from __future__ import annotations

import math

from ..bench import Bench
from ..describe import status_text
from ..requirement import Failed, ILLUMINATOR, MESSAGES, requirement, Skipped
from ..timing import median, periods
from ...error_flags import flag_names, KNOWN_FLAGS
from ...model import Mode, Status
from ....mavlink.messages import MavCmd, STATUS_ID


@requirement('status-stream', 'sends ILLUMINATOR_STATUS at a regular rate', ILLUMINATOR,
             'Message/Command/Enum Summary')
async def stream(bench: Bench) -> str:
    """Look at what came while nothing was asked for."""
    times = periods([at for at, _ in bench.rest])
    if not times:
        raise Failed('it sends none, or only one, by itself')
    if max(times) > 2 * median(times) + 0.1:
        raise Failed(f'irregular: {min(times):.2f} to {max(times):.2f} s between them')
    return f'every {median(times):.2f} s'


@requirement('status-request', 'sends ILLUMINATOR_STATUS on request', ILLUMINATOR,
             'Illuminator Connection')
async def on_request(bench: Bench) -> None:
    """Ask with MAV_CMD_REQUEST_MESSAGE."""
    before = len(bench.statuses)
    one = await bench.command(MavCmd.REQUEST_MESSAGE, STATUS_ID)
    if not one.accepted:
        raise Failed(one.answer)
    if not await bench.until(lambda: len(bench.statuses) > before, 3.0):
        raise Failed('MAV_RESULT_ACCEPTED, but it does not come')


async def _status(bench: Bench) -> Status:
    status = bench.rest[-1][1] if bench.rest else await bench.status()
    if status is None:
        raise Skipped('there is no ILLUMINATOR_STATUS')
    return status


@requirement('status-content', 'every field of the status is within its range', MESSAGES,
             'ILLUMINATOR_STATUS')
async def content(bench: Bench) -> None:
    """Look for what cannot be."""
    status = await _status(bench)
    if status.invalid:
        raise Failed(', '.join(status.invalid))


@requirement('status-mode', 'mode_bitmask has the mode that it is in', MESSAGES,
             'ILLUMINATOR_STATUS')
async def mode(bench: Bench) -> str:
    """Accept both conventions in the field: the values of the enum, and 1 << value."""
    status = await _status(bench)
    if status.mode is Mode.UNKNOWN:
        raise Skipped('its mode is unknown')
    if not status.mode_bitmask & (status.mode | 1 << status.mode):
        raise Failed(f'mode {status.mode.label} ({int(status.mode)}) is not in mode_bitmask '
                     f'0x{status.mode_bitmask:x}')
    return f'0x{status.mode_bitmask:x}'


@requirement('strobe-limits', 'min_strobe_period is not above max_strobe_period', MESSAGES,
             'ILLUMINATOR_STATUS')
async def limits(bench: Bench) -> str:
    """Look whether the limits make sense."""
    status = await _status(bench)
    low, high = status.limits.min_strobe_period, status.limits.max_strobe_period
    if low == high == 0:
        raise Skipped('both are 0: it does not say, or does not strobe')
    if not (math.isfinite(low) and math.isfinite(high) and 0 <= low <= high):
        raise Failed(f'{low:g} to {high:g} s')
    return f'{low:g} to {high:g} s'


@requirement('flags-at-rest', 'reports no error where there is none', ILLUMINATOR,
             'ILLUMINATOR_ERROR_FLAGS')
async def flags(bench: Bench) -> None:
    """Look at the flags of a light that nobody has heated."""
    status = await _status(bench)
    if status.error_flags & ~KNOWN_FLAGS:
        raise Failed(f'flags that do not exist: 0x{status.error_flags & ~KNOWN_FLAGS:x}')
    if status.error_flags:
        raise Failed(f'{", ".join(flag_names(status.error_flags))}: the light is defective, or '
                     f'too hot to be checked ({status_text(status)})')
