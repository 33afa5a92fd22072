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

from .describe import status_text
from .specification import ILLUMINATOR
from .tester import CHANGES, LightTester
from ..messages import IlluminatorStatus
from ..model import flag_names, KNOWN_FLAGS, Mode, Status
from ...payload.checks.requirement import Failed, MESSAGES, requirement, Skipped
from ...payload.checks.whole_run import none_of

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


def _count(tester: LightTester, *, accepted: bool) -> int:
    count = sum(one.expected and one.command in CHANGES and one.result is not None
                and one.accepted == accepted for one in tester.session.transactions)
    if not count:
        raise Skipped('no change was ' + ('accepted' if accepted else 'rejected'))
    return count


@requirement('status-agrees', 'shows every accepted change in ILLUMINATOR_STATUS', ILLUMINATOR,
             'STATUS', whole_run=True)
async def agrees(tester: LightTester) -> str:
    """Count the contradictions that the tester recorded."""
    return none_of(tester.disagreements, _count(tester, accepted=True), 'accepted changes')


@requirement('status-unchanged', 'shows no change after a rejected command', ILLUMINATOR,
             'STATUS', whole_run=True)
async def unchanged(tester: LightTester) -> str:
    """Count the changes that the tester recorded."""
    return none_of(
        tester.rejected_but_applied, _count(tester, accepted=False), 'rejected changes')
