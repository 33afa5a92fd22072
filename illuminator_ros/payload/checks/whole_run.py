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

"""Requirements that are judged from the messages of a whole run."""

from __future__ import annotations

from collections.abc import Sequence

from .requirement import (
    COMMAND,
    Failed,
    HEARTBEAT,
    median,
    periods,
    requirement,
    SERIALIZATION,
    Skipped,
    Tester,
)
from .session import Session
from .transaction import Finding, Transaction
from ...mavlink.messages import Heartbeat, MavResult, result_name

# s
MAX_HEARTBEAT_GAP = 2.6
PROMPT = 1.0
FINISHED = 2.0
# Findings that are quoted.
MAX_QUOTED = 3


@requirement('heartbeat-rate', 'sends HEARTBEAT at about 1 Hz', HEARTBEAT,
             'HEARTBEAT Broadcast Frequency', whole_run=True)
async def heartbeat_rate(tester: Tester) -> str:
    """Measure all intervals, and the time since the latest."""
    times = [at for at, _ in tester.session.received(Heartbeat)]
    gaps = periods(times)
    if not gaps:
        raise Skipped('fewer than two were received')
    text = f'every {median(gaps):.2f} s, at most {max(gaps):.2f} s apart'
    last_gap = tester.session.now - times[-1]
    if not 0.4 < median(gaps) < 2.0 or max(*gaps, last_gap) > MAX_HEARTBEAT_GAP:
        raise Failed(text)
    return text


def none_of(findings: Sequence[Finding], total: int, objects: str) -> str:
    """
    Return how many objects were examined.

    :raises Failed: if there are findings.
    """
    if findings:
        more = len(findings) - MAX_QUOTED
        raise Failed(
            f'{len(findings)} of {total} {objects}: '
            + '; '.join(one.text for one in findings[:MAX_QUOTED])
            + (f'; and {more} more' if more > 0 else ''),
            [line for one in findings[:MAX_QUOTED] for line in one.lines])
    return f'{total} {objects}'


def _expected(session: Session) -> list[Transaction]:
    expected = [one for one in session.transactions if one.expected]
    if not expected:
        raise Skipped('no command was sent')
    return expected


@requirement('acknowledged', 'acknowledges every command at the first attempt', COMMAND,
             'COMMAND_LONG sequence', whole_run=True)
async def acknowledged(tester: Tester) -> str:
    """Count the attempts; on a lossy link they show the link's loss."""
    every = _expected(tester.session)
    return none_of([Finding(f'{one.text} ({len(one.sent)} attempts, {one.answer})', one.lines)
                    for one in every if len(one.sent) > 1 or not one.acks],
                   len(every), 'commands')


@requirement('acknowledged-once', 'acknowledges every command once', COMMAND,
             'COMMAND_LONG sequence', whole_run=True)
async def acknowledged_once(tester: Tester) -> str:
    """Count the acknowledgements."""
    every = _expected(tester.session)
    return none_of([Finding(f'{one.text} ({len(one.finals)} acknowledgements)', one.lines)
                    for one in every if len(one.finals) > len(one.sent)],
                   len(every), 'commands')


@requirement('acknowledged-promptly', f'acknowledges every command within {PROMPT:g} s', COMMAND,
             'COMMAND_INT sequence', whole_run=True)
async def acknowledged_promptly(tester: Tester) -> str:
    """Measure those that were sent once."""
    every = [(one, one.acks[0].at - one.sent[0]) for one in _expected(tester.session)
             if len(one.sent) == 1 and one.acks]
    if not every:
        raise Skipped('no command was acknowledged at the first attempt')
    count = none_of([Finding(f'{one.text} ({seconds:.2f} s)', one.lines)
                     for one, seconds in every if seconds > PROMPT], len(every), 'commands')
    return f'{count}, the slowest {max(seconds for _, seconds in every) * 1000:.0f} ms'


@requirement('acknowledged-to-us',
             'addresses acknowledgements to the sender, or leaves their target 0', COMMAND,
             'Message/Enum Summary', whole_run=True)
async def acknowledged_to_us(tester: Tester) -> str:
    """Read the target fields, which are extensions and may be missing."""
    system, component = tester.session.address
    every = [(one, ack.target) for one in _expected(tester.session) for ack in one.acks]
    return none_of([Finding(f'{one.text} (to {target})', one.lines) for one, target in every
                    if target.system not in (0, system) or target.component not in (0, component)],
                   len(every), 'acknowledgements')


@requirement('finished', f'completes every change within {FINISHED:g} s', COMMAND,
             'Long Running Commands', whole_run=True)
async def finished(tester: Tester) -> str:
    """Measure those that were reported to be in progress."""
    every = _expected(tester.session)
    findings = []
    for one in every:
        reports = [ack for ack in one.acks if ack.result == MavResult.IN_PROGRESS]
        if not reports:
            continue
        if not one.finals:
            findings.append(Finding(f'{one.text} never', one.lines))
        elif (seconds := one.finals[-1].at - one.sent[0]) > FINISHED:
            findings.append(Finding(f'{one.text} after {seconds:.1f} s', one.lines))
        elif any(100 < ack.progress < 255 for ack in reports):
            findings.append(Finding(f'{one.text} with a progress above 100 %', one.lines))
    return none_of(findings, len(every), 'commands')


@requirement('not-busy', 'never rejects a command temporarily while it is idle', COMMAND,
             'Long Running Commands', whole_run=True)
async def not_busy(tester: Tester) -> str:
    """Read the results; commands are never sent in parallel here."""
    every = _expected(tester.session)
    return none_of([Finding(f'{one.text}: {result_name(ack.result)}', one.lines)
                    for one in every for ack in one.acks
                    if ack.result == MavResult.TEMPORARILY_REJECTED], len(every), 'commands')


@requirement('checksums', 'sends frames with correct checksums', SERIALIZATION, 'Checksum',
             whole_run=True)
async def checksums(tester: Tester) -> None:
    """Count the frames that the link has dropped; noise on a line counts, too."""
    if count := tester.conditions.checksum_errors():
        raise Failed(f'{count} {"frame" if count == 1 else "frames"} with a wrong checksum')


ACKNOWLEDGEMENTS = (acknowledged, acknowledged_once, acknowledged_promptly, acknowledged_to_us,
                    finished, not_busy)
