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

"""What shows only over the whole of a run."""

from __future__ import annotations

from ..bench import Bench
from ..requirement import (
    COMMAND,
    Failed,
    ILLUMINATOR,
    MESSAGES,
    requirement,
    SERIALIZATION,
    Skipped,
)
from ..timing import median, periods
from ..transaction import Transaction
from ....mavlink.messages import Address, MavResult, result_name

# s
LONGEST_HEARTBEAT_GAP = 2.6
PROMPT = 1.0
FINISHED = 2.0


@requirement('heartbeat-rate', 'sends HEARTBEAT about once a second', ILLUMINATOR,
             'Illuminator Connection')
async def heartbeat_rate(bench: Bench) -> str:
    """Measure all of them."""
    times = [at for at, _ in bench.heartbeats]
    gaps = periods(times)
    if not gaps:
        raise Skipped('there were no two')
    text = f'every {median(gaps):.2f} s, at the most {max(gaps):.2f} s apart'
    if not 0.4 < median(gaps) < 2.0 or max([*gaps, bench.now - times[-1]]) > LONGEST_HEARTBEAT_GAP:
        raise Failed(text)
    return text


@requirement('uptime', 'uptime_ms runs, and never goes back', MESSAGES, 'ILLUMINATOR_STATUS')
async def uptime(bench: Bench) -> str:
    """Compare it with our clock."""
    seen = bench.statuses
    if len(seen) < 2 or seen[-1][0] - seen[0][0] < 2:
        raise Skipped('too few statuses')
    for (_, one), (_, other) in zip(seen, seen[1:], strict=False):
        back = (one.uptime_ms - other.uptime_ms) % (1 << 32)
        if 0 < back < 1 << 31:
            raise Failed(f'it went back from {one.uptime_ms} to {other.uptime_ms} ms: the light '
                         'has restarted, or sends late')
    (begin, first), (end, last) = seen[0], seen[-1]
    passed = ((last.uptime_ms - first.uptime_ms) % (1 << 32)) / 1000
    if abs(passed - (end - begin)) > 0.5 + 0.05 * (end - begin):
        raise Failed(f'it went on by {passed:.1f} s in {end - begin:.1f} s')
    return f'{passed:.1f} s in {end - begin:.1f} s'


def _expected(bench: Bench) -> list[Transaction]:
    expected = [one for one in bench.transactions if one.expected]
    if not expected:
        raise Skipped('no command was sent')
    return expected


def _none_of(wrong: list[tuple[str, list[str]]], total: int, what: str) -> str:
    """Raise if there is anything wrong; else return how much was looked at."""
    if wrong:
        texts = [text for text, _ in wrong]
        more = f'; and {len(wrong) - 3} more' if len(wrong) > 3 else ''
        raise Failed(f'{len(wrong)} of {total} {what}: {"; ".join(texts[:3])}{more}',
                     [line for _, lines in wrong[:3] for line in lines])
    return f'{total} {what}'


@requirement('acknowledged', 'acknowledges every command when it comes for the first time',
             COMMAND, 'COMMAND_LONG sequence')
async def acknowledged(bench: Bench) -> str:
    """Count the resends; on a link that loses frames they are the link's."""
    every = _expected(bench)
    return _none_of([(f'{one.text} ({len(one.sent)} tries, {one.answer})', one.lines)
                     for one in every if len(one.sent) > 1 or not one.acks],
                    len(every), 'commands')


@requirement('acknowledged-once', 'acknowledges every command once', COMMAND,
             'COMMAND_LONG sequence')
async def acknowledged_once(bench: Bench) -> str:
    """Count the acknowledgements."""
    every = _expected(bench)
    return _none_of([(f'{one.text} ({len(one.finals)} acknowledgements)', one.lines)
                     for one in every if len(one.finals) > len(one.sent)],
                    len(every), 'commands')


@requirement('acknowledged-promptly', f'acknowledges every command within {PROMPT:g} s', COMMAND,
             'COMMAND_INT sequence')
async def acknowledged_promptly(bench: Bench) -> str:
    """Take the time of those that were sent once."""
    every = [(one, one.acks[0][0] - one.sent[0]) for one in _expected(bench)
             if len(one.sent) == 1 and one.acks]
    if not every:
        raise Skipped('no command was acknowledged at its first try')
    count = _none_of([(f'{one.text} ({seconds:.2f} s)', one.lines)
                      for one, seconds in every if seconds > PROMPT], len(every), 'commands')
    return f'{count}, the slowest {max(seconds for _, seconds in every) * 1000:.0f} ms'


@requirement('acknowledged-to-us', 'acknowledges to the sender, or to nobody in particular',
             COMMAND, 'Message/Enum Summary')
async def acknowledged_to_us(bench: Bench) -> str:
    """Look at the target fields, which may be missing."""
    system, component = bench.identity
    every = [(one, Address(ack.target_system, ack.target_component))
             for one in _expected(bench) for _, ack in one.acks]
    return _none_of([(f'{one.text} (to {to})', one.lines) for one, to in every
                     if to.system not in (0, system) or to.component not in (0, component)],
                    len(every), 'acknowledgements')


@requirement('finished', f'finishes every change within {FINISHED:g} s', COMMAND,
             'Long Running Commands')
async def finished(bench: Bench) -> str:
    """Take the time of those that were reported to be in progress."""
    every = _expected(bench)
    wrong = []
    for one in every:
        reports = [(at, ack) for at, ack in one.acks if ack.result == MavResult.IN_PROGRESS]
        if not reports:
            continue
        if not one.finals:
            wrong.append((f'{one.text} never', one.lines))
        elif one.finals[-1][0] - one.sent[0] > FINISHED:
            wrong.append((f'{one.text} after {one.finals[-1][0] - one.sent[0]:.1f} s', one.lines))
        elif any(100 < ack.progress < 255 for _, ack in reports):
            wrong.append((f'{one.text} with a progress above 100', one.lines))
    return _none_of(wrong, len(every), 'commands')


@requirement('not-busy', 'rejects nothing temporarily that could be done at once', COMMAND,
             'Long Running Commands')
async def not_busy(bench: Bench) -> str:
    """Look at the results: commands are never sent in parallel here."""
    every = _expected(bench)
    return _none_of([(f'{one.text}: {result_name(ack.result)}', one.lines)
                     for one in every for _, ack in one.acks
                     if ack.result == MavResult.TEMPORARILY_REJECTED], len(every), 'commands')


def _changes(bench: Bench, *, accepted: bool) -> int:
    count = sum(1 for one in _expected(bench) if one.command in (405, 406)
                and one.result is not None and one.accepted == accepted)
    if not count:
        raise Skipped('there were none')
    return count


@requirement('status-agrees', 'the status shows every change that was accepted', ILLUMINATOR,
             'STATUS')
async def status_agrees(bench: Bench) -> str:
    """Look at what was noted on the way."""
    return _none_of(bench.disagreements, _changes(bench, accepted=True), 'accepted changes')


@requirement('status-unchanged', 'the status shows no change that was refused', ILLUMINATOR,
             'STATUS')
async def status_unchanged(bench: Bench) -> str:
    """Look at what was noted on the way."""
    return _none_of(bench.disobediences, _changes(bench, accepted=False), 'refused changes')


@requirement('checksums', 'the checksum of every frame is right', SERIALIZATION, 'Checksum')
async def checksums(bench: Bench) -> None:
    """Count what the link has thrown away; noise on a line counts too."""
    if count := bench.checksum_errors():
        raise Failed(f'{count} {"frame" if count == 1 else "frames"} with a wrong one')
