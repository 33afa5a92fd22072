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

"""MAV_CMD_SET_MESSAGE_INTERVAL."""

from __future__ import annotations

from ..bench import Bench
from ..requirement import Failed, MESSAGES, requirement, Skipped
from ..timing import median, periods
from ....mavlink.messages import MavCmd, STATUS_ID

# s
INTERVAL = 0.25
WATCH = 2.5


@requirement('interval', 'sends ILLUMINATOR_STATUS at the interval that was set', MESSAGES,
             'MAV_CMD_SET_MESSAGE_INTERVAL', changes=True)
async def honoured(bench: Bench) -> str:
    """Set one that is nobody's default, and measure."""
    one = await bench.command(MavCmd.SET_MESSAGE_INTERVAL, STATUS_ID, INTERVAL * 1e6)
    if not one.accepted:
        raise Failed(f'{one.text}: {one.answer}')
    times = periods([at for at, _ in await bench.watch(WATCH)])
    if not times:
        raise Failed(f'{INTERVAL:g} s was accepted, but no two came in {WATCH:g} s')
    if not 0.6 * INTERVAL < median(times) < 1.6 * INTERVAL:
        raise Failed(f'{INTERVAL:g} s was accepted, but they come every {median(times):.2f} s')
    return f'asked for {INTERVAL:g} s, every {median(times):.2f} s'


@requirement('interval-stop', 'stops its stream when told to (interval -1)', MESSAGES,
             'MAV_CMD_SET_MESSAGE_INTERVAL', changes=True)
async def stopped(bench: Bench) -> None:
    """Stop it, and listen."""
    one = await bench.command(MavCmd.SET_MESSAGE_INTERVAL, STATUS_ID, -1)
    if not one.accepted:
        raise Failed(f'{one.text}: {one.answer}')
    # What was under way may still come.
    await bench.sleep(0.3)
    if came := await bench.watch(WATCH):
        raise Failed(f'-1 was accepted, but {len(came)} came in {WATCH:g} s')


@requirement('interval-default', 'streams again at its default rate (interval 0)', MESSAGES,
             'MAV_CMD_SET_MESSAGE_INTERVAL', changes=True)
async def default(bench: Bench) -> str:
    """Ask for the default, which may be no stream."""
    one = await bench.command(MavCmd.SET_MESSAGE_INTERVAL, STATUS_ID, 0)
    if not one.accepted:
        raise Failed(f'{one.text}: {one.answer}')
    before = len(bench.statuses)
    if await bench.until(lambda: len(bench.statuses) >= before + 2, 5.0):
        return ''
    if not bench.rest:
        raise Skipped('none came, and none came before anything was asked for')
    raise Failed('0 was accepted, but no two came in 5 s')
