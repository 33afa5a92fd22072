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

"""Requirements on MAV_CMD_DO_ILLUMINATOR_CONFIGURE."""

from __future__ import annotations

from functools import partial

from .specification import ILLUMINATOR
from .tester import Change, DIM, LightTester, LOW, same
from ..model import float32, Limits, Mode
from ...mavlink.messages import MavCmd, MavResult
from ...payload.checks.requirement import fail_if, MESSAGES, requirement, Skipped

CONFIGURE = MavCmd.DO_ILLUMINATOR_CONFIGURE
INTERNAL = float(Mode.INTERNAL_CONTROL)
STROBE = ('strobe_period', 'strobe_duty_cycle')
NAN, INF = float('nan'), float('inf')

configures = partial(
    requirement, specification=MESSAGES, section='MAV_CMD_DO_ILLUMINATOR_CONFIGURE')


def _all_shown(changes: list[Change], *names: str) -> None:
    fail_if([one.unmet(*names) for one in changes])


async def _all_rejected(tester: LightTester, values: list[tuple[float, ...]]) -> None:
    await tester.baseline()
    fail_if([await tester.rejected(CONFIGURE, *value) for value in values])


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
    _all_shown([one], 'mode')


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
    _all_shown([one], 'mode')


@configures('mode-values', 'rejects mode 0 (unknown) and undefined modes', changes=True)
async def modes(tester: LightTester) -> None:
    """Send values outside the range."""
    await _all_rejected(tester, [(mode, LOW, 0.0, 0.0) for mode in (0.0, -1.0, 3.0, 1.5, 255.0)])


@requirement('brightness', 'applies a brightness', ILLUMINATOR, 'CONFIGURE', changes=True)
async def brightness(tester: LightTester) -> str:
    """Set several, 100 % only with consent."""
    await tester.baseline()
    values = (50.0, 100.0, 33.3) if tester.conditions.consent else (5.0, DIM)
    _all_shown([await tester.configure(brightness=value) for value in values], 'brightness')
    return ', '.join(f'{value:g} %' for value in values)


@configures('brightness-values', 'rejects a brightness outside 0 to 100 %', changes=True)
async def brightness_values(tester: LightTester) -> None:
    """Send values outside the range."""
    await tester.ensure_unlit()
    await _all_rejected(tester, [(INTERNAL, value, 0.0, 0.0) for value in (-1.0, 101.0)])


async def _limits(tester: LightTester) -> Limits:
    status = await tester.status()
    if status is None or not status.limits.known:
        raise Skipped('it reports no strobe limits')
    return status.limits


def _usable(limits: Limits) -> tuple[float, float]:
    """Return two strobe periods that a light with these limits must accept."""
    low, high = limits.min_strobe_period, limits.max_strobe_period
    return float32(min(max(1.0, low), high)), float32(min(max(0.5, low), high))


@requirement('strobe', 'applies a strobe period and duty cycle', ILLUMINATOR, 'CONFIGURE',
             needs_consent=True)
async def strobe(tester: LightTester) -> str:
    """Set two periods and duty cycles, then no strobe."""
    await tester.baseline()
    first, second = _usable(await _limits(tester))
    _all_shown([
        await tester.configure(period=first, duty=50.0),
        await tester.configure(period=second, duty=25.0),
        await tester.configure()], *STROBE)
    return f'{first:g} s, {second:g} s'


@requirement('strobe-limit-values', 'accepts the strobe periods that it reports as its limits',
             MESSAGES, 'ILLUMINATOR_STATUS', needs_consent=True)
async def strobe_limits(tester: LightTester) -> str:
    """Set both limits, except 0, which means no strobe."""
    await tester.baseline()
    limits = await _limits(tester)
    periods = [one for one in (limits.min_strobe_period, limits.max_strobe_period) if one]
    _all_shown([await tester.configure(period=period, duty=50.0) for period in periods],
              'strobe_period')
    return ', '.join(f'{period:g} s' for period in periods)


@configures('strobe-values', 'rejects a strobe period outside its limits', needs_consent=True)
async def strobe_values(tester: LightTester) -> str:
    """Send periods below and above."""
    limits = await _limits(tester)
    values = [-1.0, limits.max_strobe_period * 1.5]
    if limits.min_strobe_period:
        values.append(limits.min_strobe_period / 2)
    await _all_rejected(tester, [(INTERNAL, LOW, value, 50.0) for value in values])
    return ', '.join(f'{value:g} s' for value in values)


@configures('duty-cycle', 'accepts strobe duty cycles of 0 % and 100 %', needs_consent=True)
async def duty(tester: LightTester) -> None:
    """Set both."""
    await tester.baseline()
    period, _ = _usable(await _limits(tester))
    _all_shown([await tester.configure(period=period, duty=value) for value in (0.0, 100.0)],
              'strobe_duty_cycle')


@configures('duty-cycle-values', 'rejects a duty cycle outside 0 to 100 %', needs_consent=True)
async def duty_values(tester: LightTester) -> None:
    """Send values outside the range."""
    period, _ = _usable(await _limits(tester))
    await _all_rejected(tester, [(INTERNAL, LOW, period, value) for value in (-1.0, 101.0)])


@configures('not-a-number', 'rejects NaN and infinity in every parameter', changes=True)
async def not_a_number(tester: LightTester) -> None:
    """Send them one by one: every comparison with NaN is false, so it passes range checks."""
    await tester.ensure_unlit()
    await tester.ensure_dim()
    findings = []
    for value in (NAN, INF, -INF):
        findings.append(await tester.rejected(MavCmd.ILLUMINATOR_ON_OFF, value))
        for position in range(4):
            params = [INTERNAL, LOW, 0.0, 0.0]
            params[position] = value
            findings.append(await tester.rejected(CONFIGURE, *params))
    fail_if(findings)
