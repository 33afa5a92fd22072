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

"""MAV_CMD_ILLUMINATOR_ON_OFF."""

from __future__ import annotations

from ..bench import Bench
from ..consent import dimmed
from ..requirement import fail_if, ILLUMINATOR, MESSAGES, requirement, Skipped
from ....mavlink.messages import MavCmd


@requirement('on', 'is switched on', ILLUMINATOR, 'ON/OFF', changes=True)
async def on(bench: Bench) -> None:
    """Switch it on at low brightness."""
    await dimmed(bench)
    await _switch(bench, True)


@requirement('off', 'is switched off', ILLUMINATOR, 'ON/OFF', changes=True)
async def off(bench: Bench) -> None:
    """Switch it off, from on: nothing is seen of it in a light that is off."""
    status = await bench.status()
    if status is not None and not status.enabled:
        await dimmed(bench)
        await bench.switch(True)
    await _switch(bench, False)


async def _switch(bench: Bench, on: bool) -> None:
    before = await bench.status()
    one = await bench.switch(on)
    fail_if([one.unmet('enable')])
    if before is not None and before.enabled is on:
        state, other = ('on', 'off') if on else ('off', 'on')
        raise Skipped(f'accepted, but it was {state} already and could not be switched {other} '
                      'before')


@requirement('on-off-values', 'denies to be switched to anything but 0 and 1', MESSAGES,
             'MAV_CMD_ILLUMINATOR_ON_OFF', changes=True)
async def values(bench: Bench) -> None:
    """Try what is neither."""
    await dimmed(bench)
    fail_if([await bench.refused(MavCmd.ILLUMINATOR_ON_OFF, (value,))
             for value in (-1.0, 2.0, 0.5, 255.0)])
