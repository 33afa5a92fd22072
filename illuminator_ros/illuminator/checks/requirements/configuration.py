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

"""MAV_CMD_DO_ILLUMINATOR_CONFIGURE."""

from __future__ import annotations

from ..bench import Bench, DIM, LOW
from ..comparison import same
from ..consent import dark, dimmed
from ..requirement import fail_if, ILLUMINATOR, MESSAGES, requirement, Skipped
from ..transaction import Transaction
from ...model import float32, Limits, Mode
from ....mavlink.messages import MavCmd, MavResult

CONFIGURE = MavCmd.DO_ILLUMINATOR_CONFIGURE
INTERNAL = float(Mode.INTERNAL_CONTROL)
STROBE = ('strobe_period', 'strobe_duty_cycle')
NAN, INF = float('nan'), float('inf')


def _all_made(transactions: list[Transaction], *names: str) -> None:
    fail_if([one.unmet(*names) for one in transactions])


async def _all_refused(bench: Bench, values: list[tuple[float, ...]]) -> None:
    await bench.baseline()
    fail_if([await bench.refused(CONFIGURE, value) for value in values])


async def _synchronised(bench: Bench) -> Transaction:
    """Configure it to external sync, dark unless it may strobe as another signal has it."""
    return await bench.configure(Mode.EXTERNAL_SYNC, brightness=LOW if bench.consent else 0.0)


@requirement('mode-internal', 'takes internal control', ILLUMINATOR, 'MODES', changes=True)
async def internal(bench: Bench) -> None:
    """Configure it to that mode, from the other one if it takes that."""
    await bench.baseline()
    await _synchronised(bench)
    before = await bench.status()
    # Another brightness, since in a light that knows one mode only the mode would show nothing.
    one = await bench.configure(Mode.INTERNAL_CONTROL, brightness=DIM)
    after = await bench.status()
    if before and after and same(before, after):
        fail_if([one.disagreement])
    _all_made([one], 'mode')


@requirement('mode-external', 'takes external sync, if mode_bitmask has it', ILLUMINATOR,
             'MODES', changes=True)
async def external(bench: Bench) -> None:
    """Configure it to that mode."""
    await bench.baseline()
    status = await bench.status()
    one = await _synchronised(bench)
    bitmask = status.mode_bitmask if status else 0
    # Lights differ in whether 2 stands for this mode or, as 1 << 1, for the other.
    if one.result == MavResult.DENIED and bitmask not in (3, 6):
        raise Skipped(f'denied, and mode_bitmask 0x{bitmask:x} need not mean that it has it')
    _all_made([one], 'mode')


@requirement('mode-values', 'denies mode 0 (unknown), and those that do not exist', MESSAGES,
             'MAV_CMD_DO_ILLUMINATOR_CONFIGURE', changes=True)
async def modes(bench: Bench) -> None:
    """Try them."""
    await _all_refused(bench, [(mode, LOW, 0.0, 0.0) for mode in (0.0, -1.0, 3.0, 1.5, 255.0)])


@requirement('brightness', 'takes a brightness', ILLUMINATOR, 'CONFIGURE', changes=True)
async def brightness(bench: Bench) -> str:
    """Try some, 100 % only if that may be."""
    await bench.baseline()
    values = (50.0, 100.0, 33.3) if bench.consent else (5.0, DIM)
    _all_made([await bench.configure(brightness=value) for value in values], 'brightness')
    return ', '.join(f'{value:g} %' for value in values)


@requirement('brightness-values', 'denies a brightness that is not 0 to 100 %', MESSAGES,
             'MAV_CMD_DO_ILLUMINATOR_CONFIGURE', changes=True)
async def brightness_values(bench: Bench) -> None:
    """Try them."""
    await dark(bench)
    await _all_refused(bench, [(INTERNAL, value, 0.0, 0.0) for value in (-1.0, 101.0)])


async def _limits(bench: Bench) -> Limits:
    status = await bench.status()
    if status is None or not status.limits.known:
        raise Skipped('it reports no strobe limits: it does not say, or does not strobe')
    return status.limits


def _usable(limits: Limits) -> tuple[float, float]:
    """Return two strobe periods that a light with these limits has to take."""
    low, high = limits.min_strobe_period, limits.max_strobe_period
    return float32(min(max(1.0, low), high)), float32(min(max(0.5, low), high))


@requirement('strobe', 'takes a strobe', ILLUMINATOR, 'CONFIGURE', dazzles=True)
async def strobe(bench: Bench) -> str:
    """Try two periods and duty cycles, and the end of it."""
    await bench.baseline()
    first, second = _usable(await _limits(bench))
    _all_made([
        await bench.configure(period=first, duty=50.0),
        await bench.configure(period=second, duty=25.0),
        await bench.configure()], *STROBE)
    return f'{first:g} s, {second:g} s'


@requirement('strobe-limit-values', 'takes the strobe periods that it reports as its limits',
             MESSAGES, 'ILLUMINATOR_STATUS', dazzles=True)
async def strobe_limits(bench: Bench) -> str:
    """Try both ends; 0 is no period but the end of strobing."""
    await bench.baseline()
    limits = await _limits(bench)
    periods = [one for one in (limits.min_strobe_period, limits.max_strobe_period) if one]
    _all_made([await bench.configure(period=period, duty=50.0) for period in periods],
              'strobe_period')
    return ', '.join(f'{period:g} s' for period in periods)


@requirement('strobe-values', 'denies a strobe period outside its limits', MESSAGES,
             'MAV_CMD_DO_ILLUMINATOR_CONFIGURE', dazzles=True)
async def strobe_values(bench: Bench) -> str:
    """Try below and above."""
    limits = await _limits(bench)
    values = [-1.0, limits.max_strobe_period * 1.5]
    if limits.min_strobe_period:
        values.append(limits.min_strobe_period / 2)
    await _all_refused(bench, [(INTERNAL, LOW, value, 50.0) for value in values])
    return ', '.join(f'{value:g} s' for value in values)


@requirement('duty-cycle', 'takes a strobe duty cycle of 0 and of 100 %', MESSAGES,
             'MAV_CMD_DO_ILLUMINATOR_CONFIGURE', dazzles=True)
async def duty(bench: Bench) -> None:
    """Try both ends."""
    await bench.baseline()
    period, _ = _usable(await _limits(bench))
    _all_made([await bench.configure(period=period, duty=value) for value in (0.0, 100.0)],
              'strobe_duty_cycle')


@requirement('duty-cycle-values', 'denies a strobe duty cycle that is not 0 to 100 %', MESSAGES,
             'MAV_CMD_DO_ILLUMINATOR_CONFIGURE', dazzles=True)
async def duty_values(bench: Bench) -> None:
    """Try them."""
    period, _ = _usable(await _limits(bench))
    await _all_refused(bench, [(INTERNAL, LOW, period, value) for value in (-1.0, 101.0)])


@requirement('not-a-number', 'denies NaN and infinity in every parameter', MESSAGES,
             'MAV_CMD_DO_ILLUMINATOR_CONFIGURE', changes=True)
async def not_a_number(bench: Bench) -> None:
    """Try them one by one: comparisons with NaN are all false, so naive checks let it in."""
    await dark(bench)
    await dimmed(bench)
    wrong = []
    for value in (NAN, INF, -INF):
        wrong.append(await bench.refused(MavCmd.ILLUMINATOR_ON_OFF, (value,)))
        for position in range(4):
            params = [INTERNAL, LOW, 0.0, 0.0]
            params[position] = value
            wrong.append(await bench.refused(CONFIGURE, tuple(params)))
    fail_if(wrong)
