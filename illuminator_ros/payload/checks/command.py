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

"""Requirements of the command protocol that need no command of the payload."""

from __future__ import annotations

from .requirement import fail_if, Failed, MESSAGES, Requirement, requirement, ROUTING, Tester
from ...mavlink.messages import Address, MavCmd, MavResult, Message

# Not a MAV_CMD, and far from the range in which new ones are defined.
UNKNOWN_COMMAND = 65000
# HIL_STATE (90), which only a simulator sends.
UNKNOWN_MESSAGE = 90


@requirement('unknown-command', 'answers an unknown command with MAV_RESULT_UNSUPPORTED',
             MESSAGES, 'MAV_RESULT')
async def unknown_command(tester: Tester) -> None:
    """Send a command that does not exist."""
    one = await tester.session.command(UNKNOWN_COMMAND)
    if one.result != MavResult.UNSUPPORTED:
        raise Failed(f'{one.text}: {one.answer}')


@requirement('unknown-message', 'rejects a request for a message that it does not have',
             MESSAGES, 'MAV_CMD_REQUEST_MESSAGE')
async def unknown_message(tester: Tester) -> str:
    """Request a message that a real device does not send."""
    one = await tester.session.command(MavCmd.REQUEST_MESSAGE, UNKNOWN_MESSAGE)
    if one.result is None or one.accepted:
        raise Failed(f'{one.text}: {one.answer}')
    return one.answer


def broadcast(status: type[Message]) -> Requirement[Tester]:
    """Return the requirement on broadcast commands; the one sent requests the status."""
    @requirement('broadcast', 'answers commands that are broadcast to its system and to all '
                 'systems', ROUTING, 'Routing Detail')
    async def check(tester: Tester) -> None:
        session, findings = tester.session, []
        for target in (Address(session.device.system, 0), Address(0, 0)):
            one = await session.command(MavCmd.REQUEST_MESSAGE, status.id, target=target)
            if one.result is None:
                findings.append(one.finding(f'to {target}: {one.answer}'))
        fail_if(findings)
    return check
