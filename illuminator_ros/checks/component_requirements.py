# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Requirements on any component: heartbeat, commands, status stream, identity, whole run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from itertools import pairwise
import math
from statistics import median_high

from .outcomes import fail_if, Failed, Skipped
from .requirements import Requirement, requirement, T
from .session import REJECTIONS, Session, Transaction
from .specifications import COMMAND, HEARTBEAT, MESSAGES, ROUTING, SERIALIZATION, Specification
from ..mavlink.dialect import mavlink, raw
from ..mavlink.messages import Address, ComponentInformationBasic, Heartbeat, Message

# s
HEARTBEAT_TIMEOUT = 5.0
MAX_HEARTBEAT_GAP = 2.6
INTERVAL = 0.25
WATCH_TIME = 2.5
DEFAULT_TIMEOUT = 5.0
PROMPT = 1.0
# Not a MAV_CMD, and far from the range in which new commands are defined.
UNKNOWN_COMMAND = 65000
# HIL_STATE (90), which only a simulator sends.
UNKNOWN_MESSAGE = 90
# The most failures that are quoted.
MAX_QUOTED = 3
# Results with which a device leaves out an optional command or message.
UNAVAILABLE = (mavlink.MAV_RESULT_UNSUPPORTED, mavlink.MAV_RESULT_DENIED)


def periods(received: Iterable[tuple[float, object]]) -> list[float]:
    """Return the differences of the times of consecutive messages, s."""
    return [later - earlier for (earlier, _), (later, _) in pairwise(received)]


# The heartbeat protocol, and the address

@requirement('heartbeat', 'sends HEARTBEAT', HEARTBEAT, 'HEARTBEAT Broadcast Frequency',
             presence=True)
async def heartbeat(session: Session) -> str:
    """Wait for a HEARTBEAT."""
    received = session.received(Heartbeat)
    if not await session.until(lambda: received, HEARTBEAT_TIMEOUT):
        raise Failed(f'no HEARTBEAT in {HEARTBEAT_TIMEOUT:g} s')
    return f'from {session.device}'


def _heartbeat_field(
    field: str, title: str, value: int, consequence: str,
) -> Requirement[Session]:
    """Return the requirement on a field of the latest HEARTBEAT."""
    @requirement(f'heartbeat-{field}', title, HEARTBEAT, 'Component Identity')
    async def check(session: Session) -> None:
        if not (received := session.received(Heartbeat)):
            raise Skipped('no HEARTBEAT was received')
        if (found := getattr(received[-1][1], field)) != value:
            raise Failed(f'MAV_{field.upper()} {found}: clients will {consequence}')
    return check


def heartbeat_type(mav_type: int, name: str, device: str) -> Requirement[Session]:
    """Return the requirement on HEARTBEAT.type of a device."""
    return _heartbeat_field('type', f'identifies itself as MAV_TYPE_{name} ({mav_type:d})',
                            mav_type, f'not recognise it as {device}')


heartbeat_autopilot = _heartbeat_field(
    'autopilot', 'sets autopilot to MAV_AUTOPILOT_INVALID (8)', mavlink.MAV_AUTOPILOT_INVALID,
    'take it for a flight controller')


@requirement('address', 'has a system ID and a component ID other than 0', ROUTING,
             'ID allocation')
async def address(session: Session) -> str:
    """Read the address of the device; 0 is the broadcast address."""
    if 0 in session.device:
        raise Failed(
            f'it sends from {session.device}: 0 means broadcast, so routers cannot find it')
    return f'{session.device}'


# The command protocol

@requirement('unknown-command', 'answers an unknown command with MAV_RESULT_UNSUPPORTED',
             MESSAGES, 'MAV_RESULT')
async def unknown_command(session: Session) -> None:
    """Send a command that does not exist."""
    one = await session.command(UNKNOWN_COMMAND)
    if one.result != mavlink.MAV_RESULT_UNSUPPORTED:
        raise one.failure()


@requirement('unknown-message', 'rejects a request for a message that it does not have',
             MESSAGES, 'MAV_CMD_REQUEST_MESSAGE')
async def unknown_message(session: Session) -> str:
    """Request a message that a real device does not send."""
    one = await session.command(mavlink.MAV_CMD_REQUEST_MESSAGE, UNKNOWN_MESSAGE)
    if one.result is None or one.accepted:
        raise one.failure()
    return one.answer


def _broadcast(status: type[Message]) -> Requirement[Session]:
    """Return the requirement on broadcast commands; the command requests the status."""
    @requirement('broadcast', 'answers commands that are broadcast to its system and to all '
                 'systems', ROUTING, 'Routing Detail')
    async def check(session: Session) -> None:
        failures = []
        for target in (Address(session.device.system, 0), Address(0, 0)):
            one = await session.command(mavlink.MAV_CMD_REQUEST_MESSAGE, status.id, target=target)
            if one.result is None:
                failures.append(one.failure(f'to {target}: {one.answer}'))
        fail_if(failures)
    return check


def check_command_int(one: Transaction) -> None:
    """Raise Skipped if a device does not take COMMAND_INT, which is optional."""
    if not one.acks or one.result == mavlink.MAV_RESULT_UNSUPPORTED:
        raise Skipped(f'COMMAND_INT: {one.answer}; it may take COMMAND_LONG only')


# Messages on request: the status, and the identity

def sent_on_request(
    name: str, cls: type[Message], specification: Specification, section: str,
    measurement: Callable[[Session], str] = lambda session: '', *, optional: bool = False,
) -> Requirement[Session]:
    """
    Return the requirement that a device sends a message on request.

    :param optional: whether a device may reject the request.
    """
    @requirement(name, f'sends {cls.msgname} on request', specification, section)
    async def check(session: Session) -> str:
        one, message = await session.ask(cls)
        if optional and one.result in UNAVAILABLE:
            raise Skipped(one.answer)
        if not one.accepted:
            raise Failed(one.answer)
        if message is None and await session.request(cls) is None:
            raise Failed(f'MAV_RESULT_ACCEPTED, but no {cls.msgname}')
        return measurement(session)
    return check


def _identity_strings(
    name: str, title: str, deviation: Callable[[str, bytes], str],
) -> Requirement[Session]:
    """
    Return a requirement on each string of COMPONENT_INFORMATION_BASIC.

    :param deviation: returns the error in a field, '' if there is none; takes its name and value.
    """
    @requirement(name, title, MESSAGES, ComponentInformationBasic.msgname)
    async def check(session: Session) -> None:
        received = session.received(ComponentInformationBasic)
        message = received[-1][1] if received else await session.required(
            ComponentInformationBasic)
        if wrong := [text for one in message.fieldnames
                     if isinstance(value := raw(message, one), bytes)
                     and (text := deviation(one, value))]:
            raise Failed(', '.join(wrong))
    return check


def _unprintable(name: str, value: bytes) -> str:
    text = value.partition(b'\0')[0]
    # The length limit may have cut the last character.
    shown = text.decode('utf-8', errors='ignore')
    cut = len(text) - len(shown.encode())
    return '' if shown.isprintable() and cut <= 3 else f'{name} {text!r}'


IDENTITY_STRINGS = (
    _identity_strings(
        'information-terminated', 'terminates every identity string with NUL',
        lambda name, value: '' if b'\0' in value else f'{name} has no terminator'),
    _identity_strings(
        'information-text', 'sends printable text in every identity string', _unprintable),
)


# The status stream, and its interval

def status_stream(
    status: type[Message], specification: Specification, section: str, *, optional: bool = False,
) -> Requirement[Session]:
    """
    Return the requirement on the regularity of the status.

    :param optional: whether a device may send it on request only.
    """
    @requirement('status-stream', f'sends {status.msgname} at a regular rate', specification,
                 section)
    async def check(session: Session) -> str:
        times = periods(session.idle(status))
        if not times:
            text = 'it sends at most one without a request'
            raise Skipped(text) if optional else Failed(text)
        if max(times) > 2 * median_high(times) + 0.1:
            raise Failed(f'irregular: intervals of {min(times):.2f} to {max(times):.2f} s')
        return f'every {median_high(times):.2f} s'
    return check


def _interval_requirements(status: type[Message]) -> tuple[Requirement[Session], ...]:
    """
    Return the requirements ``interval``, ``interval-stop`` and ``interval-default``.

    A device may reject the command.
    """
    on_interval = partial(requirement, specification=MESSAGES,
                          section='MAV_CMD_SET_MESSAGE_INTERVAL', changes=True)

    async def set_interval(session: Session, microseconds: float) -> None:
        one = await session.command(
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, status.id, microseconds)
        if one.result in UNAVAILABLE:
            raise Skipped(one.answer)
        one.expect(accepted=True)

    @on_interval('interval', f'sends {status.msgname} at the requested interval')
    async def requested(session: Session) -> str:
        usual = periods(session.idle(status))
        # The requested interval must differ from the default.
        is_near = usual and INTERVAL / 2 < median_high(usual) < 2 * INTERVAL
        interval = 2 * INTERVAL if is_near else INTERVAL
        await set_interval(session, interval * 1e6)
        times = periods(await session.receive_more(
            status, WATCH_TIME, round(10 * WATCH_TIME / interval)))
        if not times:
            raise Failed(f'accepted, but at most one was received in {WATCH_TIME:g} s')
        text = f'requested {interval:g} s, received every {median_high(times):.2f} s'
        if not 0.6 * interval < median_high(times) < 1.6 * interval:
            raise Failed(text)
        return text

    @on_interval('interval-stop', 'stops the stream on interval -1')
    async def stopped(session: Session) -> None:
        await set_interval(session, -1)
        # A message may be under way.
        await session.sleep(0.3)
        before = session.received(status).total
        await session.sleep(WATCH_TIME)
        if count := session.received(status).total - before:
            raise Failed(f'accepted, but still received in {WATCH_TIME:g} s: {count}')

    @on_interval('interval-default', 'returns to its default rate on interval 0')
    async def default(session: Session) -> None:
        await set_interval(session, 0)
        if len(await session.receive_more(status, DEFAULT_TIMEOUT, 2)) >= 2:
            return
        if not session.idle(status):
            raise Skipped('none was received, also not before the first command')
        raise Failed(f'accepted, but at most one was received in {DEFAULT_TIMEOUT:g} s')

    return requested, stopped, default


async def restore_interval(session: Session, status: type[Message]) -> None:
    """Restore the interval that the status had before the first command."""
    set_interval = partial(session.command, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, status.id)
    before = periods(session.idle(status))
    if not before:
        await set_interval(-1)
        return
    period = median_high(before)
    await set_interval(0)
    times = periods(await session.receive_more(status, 3.5 * period + 0.5, 3))
    if not times or not math.isclose(median_high(times), period, rel_tol=0.25, abs_tol=0.02):
        await set_interval(round(period, 3) * 1e6)


# The messages of a whole run

@requirement('heartbeat-rate', 'sends HEARTBEAT at about 1 Hz', HEARTBEAT,
             'HEARTBEAT Broadcast Frequency', whole_run=True)
async def heartbeat_rate(session: Session) -> str:
    """Measure all intervals, and the time since the latest HEARTBEAT."""
    received = session.received(Heartbeat)
    gaps = periods(received)
    if not gaps:
        raise Skipped('fewer than two were received')
    text = f'every {median_high(gaps):.2f} s, at most {max(gaps):.2f} s apart'
    last_gap = session.now - received[-1][0]
    if not 0.4 < median_high(gaps) < 2.0 or max(*gaps, last_gap) > MAX_HEARTBEAT_GAP:
        raise Failed(text)
    return text


def uptime(cls: type[Message], field: str) -> Requirement[Session]:
    """Return the requirement on the time since start, ms, in a field of a message."""
    @requirement('uptime', f'counts {field} in real time and never backwards', MESSAGES,
                 cls.msgname, whole_run=True)
    async def check(session: Session) -> str:
        seen = [(at, getattr(one, field)) for at, one in session.received(cls)]
        if len(seen) < 2 or seen[-1][0] - seen[0][0] < 2:
            raise Skipped('too few statuses')
        for (_, one), (_, other) in pairwise(seen):
            if 0 < (one - other) % (1 << 32) < 1 << 31:
                raise Failed(f'it went back from {one} to {other} ms: the device has restarted, '
                             'or sends statuses late')
        (begin, first), (end, last) = seen[0], seen[-1]
        passed = ((last - first) % (1 << 32)) / 1000
        if abs(passed - (end - begin)) > 0.5 + 0.05 * (end - begin):
            raise Failed(f'it advanced by {passed:.1f} s in {end - begin:.1f} s')
        return f'{passed:.1f} s in {end - begin:.1f} s'
    return check


def none_of(failures: Sequence[Failed], total: int, objects: str) -> str:
    """
    Return how many objects were examined.

    :raises Failed: if there are failures.
    """
    if failures:
        quoted, more = failures[:MAX_QUOTED], len(failures) - MAX_QUOTED
        raise Failed(f'{len(failures)} of {total} {objects}: {"; ".join(map(str, quoted))}'
                     + (f'; and {more} more' if more > 0 else ''),
                     [line for one in quoted for line in one.lines or ()])
    return f'{total} {objects}'


def _for_each_command(
    name: str, title: str, section: str, deviation: Callable[[Transaction, Address], str],
    measurement: Callable[[Sequence[Transaction]], str] = lambda every: '',
) -> Requirement[Session]:
    """
    Return a requirement on the acknowledgements of every command.

    :param deviation: returns the error of a command from our address, '' if there is none.
    :param measurement: returns a text that follows the number of commands.
    """
    @requirement(name, title, COMMAND, section, whole_run=True)
    async def check(session: Session) -> str:
        every = [one for one in session.transactions if one.expected]
        if not every:
            raise Skipped('no command was sent')
        return none_of([Failed(f'{one.text} ({wrong})', one.lines) for one in every
                        if (wrong := deviation(one, session.address))],
                       len(every), 'commands') + measurement(every)
    return check


def _not_at_first(one: Transaction, own: Address) -> str:
    # On a lossy link more attempts show the loss of the link.
    return f'{len(one.sent)} attempts, {one.answer}' if len(one.sent) > 1 or not one.acks else ''


def _more_than_once(one: Transaction, own: Address) -> str:
    return f'{len(one.finals)} acknowledgements' if len(one.finals) > len(one.sent) else ''


def _delay(one: Transaction) -> float:
    # After a repetition it is not known which attempt was acknowledged.
    return one.acks[0].at - one.sent[0] if len(one.sent) == 1 and one.acks else 0.0


def _late(one: Transaction, own: Address) -> str:
    return f'{_delay(one):.2f} s' if _delay(one) > PROMPT else ''


def _to_others(one: Transaction, own: Address) -> str:
    # The target fields are extensions, so they may be missing.
    return ', '.join(f'to {ack.target}' for ack in one.acks if not ack.target.includes(own))


def _unfinished(one: Transaction, own: Address) -> str:
    reports = [ack for ack in one.acks if ack.result == mavlink.MAV_RESULT_IN_PROGRESS]
    if reports and not one.finals:
        return 'never'
    return 'progress above 100 %' if any(100 < ack.progress < 255 for ack in reports) else ''


def _busy(one: Transaction, own: Address) -> str:
    # The session never sends commands in parallel.
    return (f'{one.answer} at each of {one.rejections} attempts'
            if one.rejections == REJECTIONS else '')


_ACKNOWLEDGEMENTS = (
    _for_each_command('acknowledged', 'acknowledges every command at the first attempt',
                      'COMMAND_LONG sequence', _not_at_first),
    _for_each_command('acknowledged-once', 'acknowledges every command once',
                      'COMMAND_LONG sequence', _more_than_once),
    _for_each_command('acknowledged-promptly', f'acknowledges every command within {PROMPT:g} s',
                      'COMMAND_INT sequence', _late, lambda every:
                      f', the slowest {max(map(_delay, every)) * 1000:.0f} ms'),
    _for_each_command('acknowledged-to-us', 'addresses acknowledgements to the sender, or leaves '
                      'their target 0', 'Message/Enum Summary', _to_others),
    _for_each_command('finished', 'ends every command whose progress it reports with a result',
                      'Long Running Commands', _unfinished),
    _for_each_command('not-busy', 'takes a command that it rejected temporarily when it is '
                      'repeated', 'Long Running Commands', _busy),
)


@requirement('checksums', 'sends frames with correct checksums', SERIALIZATION, 'Checksum',
             whole_run=True)
async def checksums(session: Session) -> None:
    """Count the frames that the link has dropped; noise on a serial line counts, too."""
    if count := session.conditions.checksum_errors():
        raise Failed(f'{count} {"frame" if count == 1 else "frames"} with a wrong checksum')


# All of them

def with_common(
    own: Sequence[Requirement[T]], status: type[Message], requested: type[Message] | None = None,
) -> tuple[Requirement[T], ...]:
    """
    Return the requirements on a device that takes commands: its own, and those on any component.

    :param status: the message that it streams.
    :param requested: a message that it sends on request; by default the status.
    """
    return (
        heartbeat, address, unknown_command, unknown_message, _broadcast(requested or status),
        *(one for one in own if not one.whole_run), *_interval_requirements(status),
        heartbeat_rate, *(one for one in own if one.whole_run), *_ACKNOWLEDGEMENTS, checksums)
