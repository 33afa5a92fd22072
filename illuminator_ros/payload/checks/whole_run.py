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

from collections.abc import Callable, Sequence

from . import requirement as base
from .requirement import Failed, median, periods, Requirement, requirement, Skipped, Tester
from .transaction import Finding, Transaction
from ...mavlink.messages import Heartbeat, MavResult, result_name

# s
MAX_HEARTBEAT_GAP = 2.6
PROMPT = 1.0
FINISHED = 2.0
# Findings that are quoted.
MAX_QUOTED = 3


@requirement('heartbeat-rate', 'sends HEARTBEAT at about 1 Hz', base.HEARTBEAT,
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
        texts = '; '.join(one.text for one in findings[:MAX_QUOTED])
        raise Failed(f'{len(findings)} of {total} {objects}: {texts}'
                     + (f'; and {more} more' if more > 0 else ''),
                     [line for one in findings[:MAX_QUOTED] for line in one.lines])
    return f'{total} {objects}'


def _for_each_command(
    name: str, title: str, section: str, deviation: Callable[[Transaction, Tester], str],
    measurement: Callable[[Sequence[Transaction]], str] = lambda every: '',
) -> Requirement[Tester]:
    """
    Return a requirement on the acknowledgements of every command.

    :param deviation: returns what is wrong, '' if nothing.
    :param measurement: returns a text that follows the number of commands.
    """
    @requirement(name, title, base.COMMAND, section, whole_run=True)
    async def check(tester: Tester) -> str:
        every = [one for one in tester.session.transactions if one.expected]
        if not every:
            raise Skipped('no command was sent')
        return none_of([Finding(f'{one.text} ({wrong})', one.lines) for one in every
                        if (wrong := deviation(one, tester))],
                       len(every), 'commands') + measurement(every)
    return check


def _not_at_first(one: Transaction, tester: Tester) -> str:
    # On a lossy link the attempts show the link's loss.
    return f'{len(one.sent)} attempts, {one.answer}' if len(one.sent) > 1 or not one.acks else ''


def _more_than_once(one: Transaction, tester: Tester) -> str:
    return f'{len(one.finals)} acknowledgements' if len(one.finals) > len(one.sent) else ''


def _delay(one: Transaction) -> float:
    # After a repetition it is not known which attempt was acknowledged.
    return one.acks[0].at - one.sent[0] if len(one.sent) == 1 and one.acks else 0.0


def _late(one: Transaction, tester: Tester) -> str:
    return f'{_delay(one):.2f} s' if _delay(one) > PROMPT else ''


def _to_others(one: Transaction, tester: Tester) -> str:
    # The target fields are extensions, so they may be missing.
    system, component = tester.session.address
    return ', '.join(f'to {ack.target}' for ack in one.acks if ack.target.system not in (0, system)
                     or ack.target.component not in (0, component))


def _unfinished(one: Transaction, tester: Tester) -> str:
    reports = [ack for ack in one.acks if ack.result == MavResult.IN_PROGRESS]
    if not reports:
        return ''
    if not one.finals:
        return 'never'
    if (seconds := one.finals[-1].at - one.sent[0]) > FINISHED:
        return f'after {seconds:.1f} s'
    return 'progress above 100 %' if any(100 < ack.progress < 255 for ack in reports) else ''


def _busy(one: Transaction, tester: Tester) -> str:
    # Commands are never sent in parallel here.
    return ', '.join(result_name(ack.result) for ack in one.acks
                     if ack.result == MavResult.TEMPORARILY_REJECTED)


ACKNOWLEDGEMENTS = (
    _for_each_command('acknowledged', 'acknowledges every command at the first attempt',
                      'COMMAND_LONG sequence', _not_at_first),
    _for_each_command('acknowledged-once', 'acknowledges every command once',
                      'COMMAND_LONG sequence', _more_than_once),
    _for_each_command('acknowledged-promptly', f'acknowledges every command within {PROMPT:g} s',
                      'COMMAND_INT sequence', _late, lambda every:
                      f', the slowest {max(map(_delay, every)) * 1000:.0f} ms'),
    _for_each_command('acknowledged-to-us', 'addresses acknowledgements to the sender, or leaves '
                      'their target 0', 'Message/Enum Summary', _to_others),
    _for_each_command('finished', f'completes every change within {FINISHED:g} s',
                      'Long Running Commands', _unfinished),
    _for_each_command('not-busy', 'never rejects a command temporarily while it is idle',
                      'Long Running Commands', _busy),
)


@requirement('checksums', 'sends frames with correct checksums', base.SERIALIZATION, 'Checksum',
             whole_run=True)
async def checksums(tester: Tester) -> None:
    """Count the frames that the link has dropped; noise on a line counts, too."""
    if count := tester.conditions.checksum_errors():
        raise Failed(f'{count} {"frame" if count == 1 else "frames"} with a wrong checksum')
