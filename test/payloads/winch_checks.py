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

"""The checks that the winch adds to those of every component."""

from __future__ import annotations

from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Heartbeat
from illuminator_ros.payload.checks import component_requirements as component
from illuminator_ros.payload.checks import requirement as base
from illuminator_ros.payload.checks.requirement import MESSAGES
from illuminator_ros.payload.checks.session import Session
from payloads.winch import WinchStatus


class WinchTester:
    """Releases line, and winds it in at the end."""

    def __init__(self, session: Session, conditions: base.Conditions) -> None:
        self.session = session
        self.conditions = conditions
        self.saved = ''

    async def length(self) -> float:
        """Return the released length, m; NaN if the winch does not report it."""
        status = await self.session.request(WinchStatus)
        return status.line_length if status else float('nan')

    async def save(self) -> bool:
        """See :class:`Tester`."""
        self.saved = self.saved or str(await self.length())
        return self.saved != 'nan'

    async def restore(self) -> list[str]:
        """See :class:`Tester`."""
        change = float(self.saved) - await self.length()
        await self.session.command(mavlink.MAV_CMD_DO_WINCH, 1,
                                   mavlink.WINCH_RELATIVE_LENGTH_CONTROL, change)
        return [] if await self.length() == float(self.saved) else ['line_length']


@base.requirement(
    'release', 'releases line when commanded', MESSAGES, 'MAV_CMD_DO_WINCH', changes=True)
async def release(tester: WinchTester) -> None:
    """Release 2 m, and compare the status."""
    before = await tester.length()
    one = await tester.session.command(mavlink.MAV_CMD_DO_WINCH, 1,
                                       mavlink.WINCH_RELATIVE_LENGTH_CONTROL, 2.0)
    after = await tester.length()
    if after != before + 2.0:
        raise one.failure(f'{before} m, then {after} m')


REQUIREMENTS: tuple[base.Requirement[WinchTester], ...] = (
    component.heartbeat, component.heartbeat_autopilot, component.unknown_command,
    *component.interval_requirements(WinchStatus), release, *component.ACKNOWLEDGEMENTS)
CHECKS = base.PayloadChecks(
    'winch', 'winch', (WinchStatus,),
    lambda message: isinstance(message, Heartbeat) and message.type == mavlink.MAV_TYPE_WINCH,
    'HEARTBEAT with MAV_TYPE_WINCH', WinchTester, REQUIREMENTS)
