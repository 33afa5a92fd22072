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
from illuminator_ros.mavlink.messages import Heartbeat, Message
from illuminator_ros.payload.checks.component_requirements import with_common
from illuminator_ros.payload.checks.requirement import PayloadChecks, requirement
from illuminator_ros.payload.checks.session import Session, Transaction
from illuminator_ros.payload.checks.specifications import MESSAGES
from payloads.winch import WinchStatus


class WinchSession(Session):
    """Releases line, and winds it in at the end."""

    messages = (*Session.messages, WinchStatus)
    before: float | None = None

    def is_device(self, message: Message) -> bool:
        """See :class:`Session`."""
        return isinstance(message, Heartbeat) and message.type == mavlink.MAV_TYPE_WINCH

    async def length(self) -> float | None:
        """Return the released length, m; None if the winch does not report it."""
        status = await self.request(WinchStatus)
        return status.line_length if status else None

    async def release(self, length: float) -> Transaction:
        """Release line, m."""
        return await self.command(
            mavlink.MAV_CMD_DO_WINCH, 1, mavlink.WINCH_RELATIVE_LENGTH_CONTROL, length)

    async def save(self) -> bool:
        """See :class:`Session`."""
        self.before = await self.length()
        return self.before is not None

    @property
    def saved(self) -> str:
        """See :class:`Session`."""
        return f'{self.before} m'

    async def restore(self) -> list[str]:
        """See :class:`Session`."""
        await self.release((self.before or 0.0) - (await self.length() or 0.0))
        return [] if await self.length() == self.before else ['line_length']


@requirement(
    'release', 'releases line when commanded', MESSAGES, 'MAV_CMD_DO_WINCH', changes=True)
async def release(winch: WinchSession) -> None:
    """Release 2 m, and compare the status."""
    before = await winch.length()
    one = await winch.release(2.0)
    after = await winch.length()
    if before is None or after != before + 2.0:
        raise one.failure(f'{before} m, then {after} m')


CHECKS = PayloadChecks('winch', 'winch', WinchSession, 'HEARTBEAT with MAV_TYPE_WINCH',
                       with_common((release,), WinchStatus))
