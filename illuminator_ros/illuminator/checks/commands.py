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

"""Requirements on the commands that switch and configure a light."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import astuple

from .tester import Change, CONFIGURE, DIM, ILLUMINATOR, LightTester, LOW, ON_OFF, same
from ..model import float32, Limits, Mode
from ...mavlink.messages import Address, MavResult
from ...payload.checks.requirement import Requirement, requirement
from ...payload.checks.session import fail_if, Failed, Skipped
from ...payload.checks.specification import COMMAND, MESSAGES, ROUTING, Specification

CONFIGURE_SECTION = 'MAV_CMD_DO_ILLUMINATOR_CONFIGURE'
INTERNAL = float(Mode.INTERNAL_CONTROL)


# The command protocol, with commands that switch the light

@requirement('other-target', 'ignores commands for other components and systems', ROUTING,
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
    failures = []
    for other in others:
        one = await session.send_to_other(other, ON_OFF, 1)
        status = await tester.status()
        if status is not None and status.enabled:
            failures.append(one.failure(f'switched on by a command for {other}'))
            await tester.baseline()
        elif one.acks:
            failures.append(one.failure(f'answered a command for {other}: {one.answer}'))
    fail_if(failures)


@requirement('command-int', 'accepts COMMAND_INT, or answers MAV_RESULT_COMMAND_LONG_ONLY',
             COMMAND, 'Use COMMAND_INT or COMMAND_LONG?', changes=True)
async def command_int(tester: LightTester) -> str:
    """Switch it on with COMMAND_INT."""
    await tester.ensure_dim()
    change = await tester.switch(True, as_int=True)
    one = change.transaction
    if not one.accepted and one.result != MavResult.COMMAND_LONG_ONLY:
        raise Failed(f'COMMAND_INT {one.text}: {one.answer}', one.lines)
    fail_if([change.contradiction])
    return one.answer


@requirement('repeated', 'handles a repeated command like the first one', COMMAND,
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
    again = await tester.session.command(ON_OFF, 1, confirmation=1)
    status = await tester.status()
    if not again.accepted:
        raise Failed(f'the second {again.text}: {again.answer}')
    if status is not None and status.enabled is False:
        raise Failed(f'the second {again.text} switched it off')


# Switching and configuring

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


async def _synchronise(tester: LightTester) -> Change:
    """Configure external sync; at 0 % without consent, because another signal may strobe it."""
    brightness = LOW if tester.conditions.consent else 0.0
    return await tester.configure(Mode.EXTERNAL_SYNC, brightness=brightness)


@requirement('mode-internal', 'accepts mode internal_control', ILLUMINATOR, 'MODES', changes=True)
async def internal(tester: LightTester) -> None:
    """Configure it to that mode, from the other one if it accepts that."""
    await tester.baseline()
    await _synchronise(tester)
    before = await tester.status()
    # With another brightness, because a light that has only one mode would show no change.
    one = await tester.configure(Mode.INTERNAL_CONTROL, brightness=DIM)
    after = await tester.status()
    if before and after and same(before, after):
        fail_if([one.contradiction])
    fail_if([one.unmet('mode')])


@requirement('mode-external', 'accepts mode external_sync if mode_bitmask lists it', ILLUMINATOR,
             'MODES', changes=True)
async def external(tester: LightTester) -> None:
    """Configure it to that mode."""
    await tester.baseline()
    status = await tester.status()
    one = await _synchronise(tester)
    bitmask = status.mode_bitmask if status else 0
    # Bit value 2 means this mode, or as 1 << 1 the other one: lights differ in it.
    if one.transaction.result == MavResult.DENIED and bitmask not in (3, 6):
        raise Skipped(f'MAV_RESULT_DENIED, and mode_bitmask 0x{bitmask:x} is ambiguous')
    fail_if([one.unmet('mode')])


@requirement('brightness', 'applies a brightness', ILLUMINATOR, 'CONFIGURE', changes=True)
async def brightness(tester: LightTester) -> str:
    """Set several, 100 % only with consent."""
    await tester.baseline()
    values = (50.0, 100.0, 33.3) if tester.conditions.consent else (5.0, DIM)
    fail_if([(await tester.configure(brightness=value)).unmet('brightness') for value in values])
    return ', '.join(f'{value:g} %' for value in values)


# Invalid parameters

def _rejects(
    name: str, title: str, *commands: tuple[float, ...],
    state: Sequence[Callable[[LightTester], Awaitable[None]]] = (LightTester.baseline,),
    section: str = CONFIGURE_SECTION,
) -> Requirement[LightTester]:
    """
    Return the requirement that a light rejects some commands.

    :param commands: each a MAV_CMD and its parameters.
    :param state: steps that bring the light to the state in which they are sent.
    """
    @requirement(name, title, MESSAGES, section, changes=True)
    async def check(tester: LightTester) -> None:
        for step in state:
            await step(tester)
        fail_if([await tester.rejected(int(command), *params) for command, *params in commands])
    return check


on_off_values = _rejects(
    'on-off-values', 'rejects ON_OFF values other than 0 and 1',
    *((ON_OFF, value) for value in (-1.0, 2.0, 0.5, 255.0)), state=(LightTester.ensure_dim,),
    section='MAV_CMD_ILLUMINATOR_ON_OFF')
mode_values = _rejects(
    'mode-values', 'rejects mode 0 (unknown) and undefined modes',
    *((CONFIGURE, mode, LOW, 0.0, 0.0) for mode in (0.0, -1.0, 3.0, 1.5, 255.0)))
brightness_values = _rejects(
    'brightness-values', 'rejects a brightness outside 0 to 100 %',
    *((CONFIGURE, INTERNAL, value, 0.0, 0.0) for value in (-1.0, 101.0)),
    state=(LightTester.ensure_unlit, LightTester.baseline))
# One by one: every comparison with NaN is false, so it passes range checks.
not_a_number = _rejects(
    'not-a-number', 'rejects NaN and infinity in every parameter',
    *(command for value in map(float, ('nan', 'inf', '-inf')) for command in (
        (ON_OFF, value), (CONFIGURE, value, LOW, 0.0, 0.0), (CONFIGURE, INTERNAL, value, 0.0, 0.0),
        (CONFIGURE, INTERNAL, LOW, value, 0.0), (CONFIGURE, INTERNAL, LOW, 0.0, value))),
    state=(LightTester.ensure_unlit, LightTester.ensure_dim))


# Strobe, which needs consent

def _strobe(
    name: str, title: str, specification: Specification, section: str,
    values: Callable[[Limits], list[tuple[float, float]]], *shown: str,
) -> Requirement[LightTester]:
    """
    Return a requirement on strobe periods and duty cycles.

    :param values: returns them, in s and %, from the limits that the light reports.
    :param shown: the fields in which the status must show them; if none, the light must reject
        them.
    """
    @requirement(name, title, specification, section, needs_consent=True)
    async def check(tester: LightTester) -> str:
        await tester.baseline()
        status = await tester.status()
        if status is None or not status.limits.known:
            raise Skipped('it reports no strobe limits')
        sent = values(status.limits)
        fail_if([
            (await tester.configure(period=period, duty=duty)).unmet(*shown) if shown
            else await tester.rejected(CONFIGURE, INTERNAL, LOW, period, duty)
            for period, duty in sent])
        return ', '.join(f'{period:g} s' for period in dict.fromkeys(one[0] for one in sent))
    return check


def _within(period: float, limits: Limits) -> float:
    return float32(min(max(period, limits.min_strobe_period), limits.max_strobe_period))


STROBE = (
    _strobe('strobe', 'applies a strobe period and duty cycle', ILLUMINATOR, 'CONFIGURE',
            lambda limits: [
                (_within(1.0, limits), 50.0), (_within(0.5, limits), 25.0), (0.0, 0.0)],
            'strobe_period', 'strobe_duty_cycle'),
    _strobe('strobe-limit-values', 'accepts the strobe periods that it reports as its limits',
            MESSAGES, 'ILLUMINATOR_STATUS',
            # Except 0, which means no strobe.
            lambda limits: [(one, 50.0) for one in astuple(limits) if one],
            'strobe_period'),
    _strobe('strobe-values', 'rejects a strobe period outside its limits',
            MESSAGES, CONFIGURE_SECTION,
            # Half of a smallest period of 0 would be 0, which means no strobe.
            lambda limits: [(period, 50.0) for period in (
                -1.0, limits.max_strobe_period * 1.5, limits.min_strobe_period / 2) if period]),
    _strobe('duty-cycle', 'accepts strobe duty cycles of 0 % and 100 %',
            MESSAGES, CONFIGURE_SECTION,
            lambda limits: [(_within(1.0, limits), duty) for duty in (0.0, 100.0)],
            'strobe_duty_cycle'),
    _strobe('duty-cycle-values', 'rejects a duty cycle outside 0 to 100 %',
            MESSAGES, CONFIGURE_SECTION,
            lambda limits: [(_within(1.0, limits), duty) for duty in (-1.0, 101.0)]),
)
