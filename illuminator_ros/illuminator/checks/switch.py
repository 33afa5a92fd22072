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

"""Requirements on MAV_CMD_ILLUMINATOR_ON_OFF, and on commands that switch the light."""

from __future__ import annotations

from .specification import ILLUMINATOR
from .tester import LightTester
from ...mavlink.messages import Address, MavCmd, MavResult
from ...payload.checks import requirement as base
from ...payload.checks.requirement import fail_if, Failed, requirement, Skipped


@requirement('other-target', 'ignores commands for other components and systems', base.ROUTING,
             'Routing Detail', changes=True)
async def other_target(tester: LightTester) -> None:
    """Send ON to addresses that do not exist: another component, and another system."""
    await tester.ensure_dim()
    session = tester.session
    taken = session.heard | {session.address, session.device}
    system, component = session.device
    systems = {one.system for one in taken}
    others = (
        next(one for one in (Address(system, n) for n in range(200, 256)) if one not in taken),
        next(Address(n, component or 200) for n in range(240, 0, -1) if n not in systems))
    findings = []
    for other in others:
        one = await session.send_to_other(other, MavCmd.ILLUMINATOR_ON_OFF, 1)
        status = await tester.status()
        if status is not None and status.enabled:
            findings.append(one.finding(f'switched on by a command for {other}'))
            await tester.baseline()
        elif one.acks:
            findings.append(one.finding(f'answered a command for {other}: {one.answer}'))
    fail_if(findings)


@requirement('command-int', 'accepts COMMAND_INT, or answers MAV_RESULT_COMMAND_LONG_ONLY',
             base.COMMAND, 'Use COMMAND_INT or COMMAND_LONG?', changes=True)
async def command_int(tester: LightTester) -> str:
    """Switch it on with COMMAND_INT."""
    await tester.ensure_dim()
    change = await tester.switch(True, as_int=True)
    one = change.transaction
    if not one.accepted and one.result != MavResult.COMMAND_LONG_ONLY:
        raise Failed(f'COMMAND_INT {one.text}: {one.answer}', one.lines)
    fail_if([change.contradiction])
    return one.answer


@requirement('repeated', 'handles a repeated command like the first one', base.COMMAND,
             'COMMAND_LONG sequence', changes=True)
async def repeated(tester: LightTester) -> None:
    """Repeat ON, as after a lost acknowledgement."""
    await tester.ensure_dim()
    first = (await tester.switch(True)).transaction
    if not first.accepted:
        raise Skipped(f'it cannot be switched on: {first.answer}')
    status = await tester.status()
    if status is None or not status.enabled:
        raise Skipped('the status does not show it on after the first command')
    again = await tester.session.command(MavCmd.ILLUMINATOR_ON_OFF, 1, confirmation=1)
    status = await tester.status()
    if not again.accepted:
        raise Failed(f'the second {again.text}: {again.answer}')
    if status is not None and status.enabled is False:
        raise Failed(f'the second {again.text} switched it off')


@requirement('on', 'can be switched on', ILLUMINATOR, 'ON/OFF', changes=True)
async def on(tester: LightTester) -> None:
    """Switch it on at low brightness."""
    await tester.ensure_dim()
    await _switch(tester, True)


@requirement('off', 'can be switched off', ILLUMINATOR, 'ON/OFF', changes=True)
async def off(tester: LightTester) -> None:
    """Switch it off while it is on; a light that is already off shows no change."""
    status = await tester.status()
    if status is not None and not status.enabled:
        await tester.ensure_dim()
        await tester.switch(True)
    await _switch(tester, False)


async def _switch(tester: LightTester, on: bool) -> None:
    before = await tester.status()
    change = await tester.switch(on)
    fail_if([change.unmet('enable')])
    if before is not None and before.enabled is on:
        state, other = ('on', 'off') if on else ('off', 'on')
        raise Skipped(f'accepted, but it was {state} and could not be switched {other} before')


@requirement('on-off-values', 'rejects ON_OFF values other than 0 and 1', base.MESSAGES,
             'MAV_CMD_ILLUMINATOR_ON_OFF', changes=True)
async def values(tester: LightTester) -> None:
    """Send values below, between and above."""
    await tester.ensure_dim()
    fail_if([await tester.rejected(MavCmd.ILLUMINATOR_ON_OFF, value)
             for value in (-1.0, 2.0, 0.5, 255.0)])
