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

"""What is done to a light without consent: it is switched on only where it cannot dazzle."""

from __future__ import annotations

from .bench import Bench, DIM, LOW
from .requirement import Skipped
from ..error_flags import DIMMING_FLAGS
from ..model import Mode, Status
from ...mavlink.messages import MavCmd

NOT_AGREED = 'not agreed to; see --yes'


async def dimmed(bench: Bench) -> None:
    """
    Bring the light to where it may be switched on: off, dim, without strobe.

    A light that takes no configuration stays as bright as somebody has left it.

    :raises Skipped: if it might dazzle, switched on, and nobody has agreed to that.
    """
    await bench.baseline()
    if bench.consent:
        return
    one = await bench.configure()
    status = await bench.status()
    if status is not None and status.enabled:
        # Where brightness and switch are one.
        await bench.command(MavCmd.ILLUMINATOR_ON_OFF, 0.0)
    if one.accepted and not one.disagreement:
        return
    if reason := _dazzling(status):
        raise Skipped(f'switched on, {reason}, and that cannot be changed: {NOT_AGREED}')


async def dark(bench: Bench) -> None:
    """
    Bring the light to where a brightness that it must not take cannot be seen.

    :raises Skipped: if it is switched on by its brightness, and nobody has agreed to dazzle.
    """
    await bench.baseline()
    if bench.consent:
        return
    await bench.configure(brightness=LOW / 2)
    status = await bench.status()
    if status is None or status.enabled is not False:
        raise Skipped('its brightness switches it on, so what it must not take might dazzle: '
                      + NOT_AGREED)


def _dazzling(status: Status | None) -> str:
    """Return what a light might do when it is switched on, '' if nothing that hurts."""
    # Off, a light that is switched by its brightness reports 0, and was brighter before.
    if status is None or not status.brightness or status.error_flags & DIMMING_FLAGS:
        return 'it might be of any brightness'
    if status.brightness > DIM:
        return f'it would shine at {status.brightness:g} %'
    if status.strobe_period != 0.0 and status.strobe_duty_cycle not in (0.0, 100.0):
        return 'it might strobe'
    if status.mode is Mode.EXTERNAL_SYNC:
        return 'it might strobe as another signal has it'
    return ''
