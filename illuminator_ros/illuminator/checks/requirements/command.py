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

"""What the command protocol asks of a light, whatever the command."""

from __future__ import annotations

from ..bench import Bench
from ..consent import dimmed
from ..requirement import COMMAND, fail_if, Failed, MESSAGES, requirement, ROUTING, Skipped
from ....mavlink.messages import Address, MavCmd, MavResult, STATUS_ID

# No MAV_CMD, and none that will be one soon.
UNKNOWN_COMMAND = 65000
# HIL_STATE (90): a simulator's message, which no light sends.
UNKNOWN_MESSAGE = 90


@requirement('unknown-command', 'answers an unknown command with MAV_RESULT_UNSUPPORTED',
             MESSAGES, 'MAV_RESULT')
async def unknown_command(bench: Bench) -> None:
    """Send a command that does not exist."""
    one = await bench.command(UNKNOWN_COMMAND)
    if one.result != MavResult.UNSUPPORTED:
        raise Failed(f'{one.text}: {one.answer}')


@requirement('unknown-message', 'does not accept a request for a message that it does not have',
             MESSAGES, 'MAV_CMD_REQUEST_MESSAGE')
async def unknown_message(bench: Bench) -> str:
    """Request what no light has."""
    one = await bench.command(MavCmd.REQUEST_MESSAGE, UNKNOWN_MESSAGE)
    if one.result is None or one.accepted:
        raise Failed(f'{one.text}: {one.answer}')
    return one.answer


@requirement('broadcast', 'answers what is for its system, and for all systems', ROUTING,
             'Routing Detail')
async def broadcast(bench: Bench) -> None:
    """Request the status of everybody: other lights are not changed by it."""
    wrong = []
    for target in (Address(bench.light.system, 0), Address(0, 0)):
        one = await bench.command(MavCmd.REQUEST_MESSAGE, STATUS_ID, target=target)
        if one.result is None:
            wrong.append(one.finding(f'to {target}: {one.answer}'))
    fail_if(wrong)


@requirement('other-target', 'neither answers nor does what is for others', ROUTING,
             'Routing Detail', changes=True)
async def other_target(bench: Bench) -> None:
    """Switch on what does not exist: another component, and another system."""
    await dimmed(bench)
    taken = bench.heard | {bench.identity, bench.light}
    system, component = bench.light
    others = [
        next(one for one in (Address(system, n) for n in range(200, 256)) if one not in taken),
        next(one for one in (Address(n, component or 200) for n in range(240, 0, -1))
             if one.system not in {source.system for source in taken})]
    wrong = []
    for other in others:
        one = await bench.overheard(other, MavCmd.ILLUMINATOR_ON_OFF, 1)
        status = await bench.status()
        if status is not None and status.enabled:
            wrong.append((f'switched on by what was for {other}', [*one.lines, bench.log[-1]]))
            await bench.baseline()
        elif one.acks:
            wrong.append((f'answered what was for {other}: {one.answer}', one.lines))
    fail_if(wrong)


@requirement('command-int', 'takes COMMAND_INT, or says MAV_RESULT_COMMAND_LONG_ONLY', COMMAND,
             'Use COMMAND_INT or COMMAND_LONG?', changes=True)
async def command_int(bench: Bench) -> str:
    """Switch it on with one."""
    await dimmed(bench)
    one = await bench.switch(True, as_int=True)
    if not one.accepted and one.result != MavResult.COMMAND_LONG_ONLY:
        raise Failed(f'COMMAND_INT {one.text}: {one.answer}', one.lines)
    if one.disagreement:
        fail_if([one.disagreement])
    return one.answer


@requirement('repeated', 'does the same when a command comes a second time', COMMAND,
             'COMMAND_LONG sequence', changes=True)
async def repeated(bench: Bench) -> None:
    """Send what a lost acknowledgement makes everybody send again."""
    await dimmed(bench)
    first = await bench.switch(True)
    if not first.accepted:
        raise Skipped(f'it cannot be switched on: {first.answer}')
    status = await bench.status()
    if status is None or not status.enabled:
        raise Skipped('the status does not show it on after the first')
    again = await bench.command(MavCmd.ILLUMINATOR_ON_OFF, 1, confirmation=1)
    status = await bench.status()
    if not again.accepted:
        raise Failed(f'the second {again.text}: {again.answer}')
    if status is not None and status.enabled is False:
        raise Failed(f'the second {again.text} switched it off')
