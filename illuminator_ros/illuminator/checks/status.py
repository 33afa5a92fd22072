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

"""Requirements on ILLUMINATOR_STATUS."""

from __future__ import annotations

from functools import partial
import math

from .tester import CONFIGURE, ILLUMINATOR, LightTester, ON_OFF, status_text
from ..messages import IlluminatorStatus
from ..model import ErrorFlag, flag_names, KNOWN_FLAGS, Mode, Status
from ...payload.checks.component_requirements import none_of
from ...payload.checks.requirement import Requirement, requirement
from ...payload.checks.session import Failed, Skipped
from ...payload.checks.specification import MESSAGES

# Smallest rise of temperature that explains a flag, K.
STEP = 0.5
THERMAL = (ErrorFlag.THERMAL_THROTTLING, ErrorFlag.OVER_TEMPERATURE_SHUTDOWN)

reports = partial(requirement, specification=MESSAGES, section='ILLUMINATOR_STATUS')


async def _status(tester: LightTester) -> Status:
    idle = tester.session.idle(IlluminatorStatus)
    status = Status.from_message(idle[-1][1]) if idle else await tester.status()
    if status is None:
        raise Skipped('no ILLUMINATOR_STATUS was received')
    return status


@reports('status-content', 'reports a valid value in every field of ILLUMINATOR_STATUS')
async def content(tester: LightTester) -> None:
    """Look for values out of range."""
    status = await _status(tester)
    if status.invalid:
        raise Failed(', '.join(status.invalid))


@reports('status-mode', 'lists its current mode in mode_bitmask')
async def mode(tester: LightTester) -> str:
    """Accept both conventions of existing lights: the value of the enum, and 1 << value."""
    status = await _status(tester)
    if status.mode is Mode.UNKNOWN:
        raise Skipped('it reports mode unknown')
    if not status.mode_bitmask & (status.mode | 1 << status.mode):
        raise Failed(f'mode {status.mode.label} ({int(status.mode)}) is not in mode_bitmask '
                     f'0x{status.mode_bitmask:x}')
    return f'0x{status.mode_bitmask:x}'


@reports('strobe-limits', 'reports a min_strobe_period that is at most max_strobe_period')
async def limits(tester: LightTester) -> str:
    """Compare the limits."""
    status = await _status(tester)
    low, high = status.limits.min_strobe_period, status.limits.max_strobe_period
    if low == high == 0:
        raise Skipped('both are 0: it reports no strobe limits')
    if not (math.isfinite(low) and math.isfinite(high) and 0 <= low <= high):
        raise Failed(f'{low:g} to {high:g} s')
    return f'{low:g} to {high:g} s'


@requirement('flags-at-rest', 'reports no error flag before the first command', ILLUMINATOR,
             'ILLUMINATOR_ERROR_FLAGS')
async def flags(tester: LightTester) -> None:
    """Read the flags of a cold light."""
    status = await _status(tester)
    if status.error_flags & ~KNOWN_FLAGS:
        raise Failed(f'undefined flags: 0x{status.error_flags & ~KNOWN_FLAGS:x}')
    if status.error_flags:
        raise Failed(f'{", ".join(flag_names(status.error_flags))}: the light is defective, or '
                     f'too hot for the checks ({status_text(status)})')


@reports('uptime', 'counts uptime_ms in real time and never backwards', whole_run=True)
async def uptime(tester: LightTester) -> str:
    """Compare it with our clock."""
    seen = [(at, one.uptime_ms) for at, one in tester.session.received(IlluminatorStatus)]
    if len(seen) < 2 or seen[-1][0] - seen[0][0] < 2:
        raise Skipped('too few statuses')
    for (_, one), (_, other) in zip(seen, seen[1:], strict=False):
        back = (one - other) % (1 << 32)
        if 0 < back < 1 << 31:
            raise Failed(f'it went back from {one} to {other} ms: the light has restarted, or '
                         'sends statuses late')
    (begin, first), (end, last) = seen[0], seen[-1]
    passed = ((last - first) % (1 << 32)) / 1000
    if abs(passed - (end - begin)) > 0.5 + 0.05 * (end - begin):
        raise Failed(f'it advanced by {passed:.1f} s in {end - begin:.1f} s')
    return f'{passed:.1f} s in {end - begin:.1f} s'


def _compared(name: str, title: str, *, accepted: bool) -> Requirement[LightTester]:
    """Return a requirement on the status after the accepted, or after the rejected changes."""
    kind = 'accepted' if accepted else 'rejected'

    @requirement(name, title, ILLUMINATOR, 'STATUS', whole_run=True)
    async def check(tester: LightTester) -> str:
        count = sum(one.expected and one.command in (ON_OFF, CONFIGURE) and one.result is not None
                    and one.accepted == accepted for one in tester.session.transactions)
        if not count:
            raise Skipped(f'no change was {kind}')
        return none_of(tester.disagreements if accepted else tester.rejected_but_applied,
                       count, f'{kind} changes')
    return check


agrees = _compared(
    'status-agrees', 'shows every accepted change in ILLUMINATOR_STATUS', accepted=True)
unchanged = _compared(
    'status-unchanged', 'shows no change after a rejected command', accepted=False)


@requirement('thermal-flags', 'sets thermal error flags according to its temperature', ILLUMINATOR,
             'ILLUMINATOR_ERROR_FLAGS', needs_consent=True)
async def thermal(tester: LightTester) -> str:
    """Keep it at 100 % for some time, then off for as long, and compare."""
    heat = tester.conditions.options['heat']
    if not heat:
        raise Skipped('disabled by --heat 0')
    await tester.baseline()
    start = await tester.status()
    if start is None or start.temperature is None:
        raise Skipped('it reports no temperature')
    if start.error_flags & ErrorFlag.THERMISTOR_FAILURE:
        raise Skipped('its temperature sensor has failed')
    await tester.configure(brightness=100.0)
    on = (await tester.switch(True)).transaction
    if not on.accepted:
        raise Skipped(f'it cannot be switched on: {on.answer}')
    seen = [start, *await _sample(tester, heat)]
    await tester.switch(False)
    seen += await _sample(tester, heat)
    return _judge([one for one in seen if one.temperature is not None], heat)


async def _sample(tester: LightTester, heat: float) -> list[Status]:
    samples, until = [], tester.session.now + heat
    while tester.session.now < until:
        samples.append(await tester.status())
        await tester.session.runner.sleep(min(0.5, heat / 5))
    return [one for one in samples if one is not None]


def _judge(seen: list[Status], seconds: float) -> str:
    """
    Return the temperatures at which flags were set.

    A flag must not be set at a temperature at which it was not set at first. Consecutive samples
    are not compared: between them a small light may heat up and cool down.

    :raises Failed: if a flag was.
    """
    start, hottest = seen[0].temperature or 0.0, max(one.temperature or 0.0 for one in seen)
    if not any(one.temperature for one in seen):
        raise Skipped('it reports no temperature')
    ranges = []
    for flag in THERMAL:
        flagged = [one.temperature or 0.0 for one in seen if one.error_flags & flag]
        if not flagged or seen[0].error_flags & flag:
            continue
        name = flag_names(flag)[0]
        if min(flagged) < start + STEP:
            raise Failed(f'{name} at {min(flagged):.1f} degC; it was not set at '
                         f'{start:.1f} degC before')
        ranges.append(f'{name} from {min(flagged):.1f} to {max(flagged):.1f} degC')
    if not ranges:
        raise Skipped(f'{seconds:g} s at 100 % heated it from {start:.1f} to {hottest:.1f} degC '
                      'and set no flag; try a longer --heat')
    return ', '.join(ranges)
