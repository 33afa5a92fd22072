# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
/diagnostics (REP 107): findings, statuses, and the status of the link.

Snapshots are made in the link's thread; everything else is a pure function of them. Keys have
their unit, and a numeric value is a plain number, so that it can be plotted. Times are s on the
link's clock.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
import functools
from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from ..mavlink import link_state
from ..mavlink.component import Component
from ..mavlink.device_kind import DeviceKind
from ..mavlink.durations import format_seconds
from ..mavlink.forwarding.duplicate_filter import OWN
from ..mavlink.link import Link
from ..mavlink.message_traits import name_of
from ..mavlink.messages import Address, Heartbeat
from ..mavlink.search.component_kinds import described
from ..mavlink.transport.udp import MAX_PEERS

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR

SIGNING_NEEDED = ('commands are not answered, and others sign their frames while signing_mode is '
                  'off')

# s until the absence of a device is an error.
DISCOVERY_GRACE = 10.0
# % of lost frames of a device above which there is a warning.
LOSS_WARNING = 5.0
# Messages that are named in the status of a line.
MAX_NAMED = 8

# A level and a text for people.
Finding = tuple[bytes, str]
Value = str | int | float | bool | None


class Report(NamedTuple):
    """
    The content of one DiagnosticStatus.

    :param name: without the node's name, such as ``link``.
    :param fine: the message where there is no finding.
    :param values: returns the values by key; None is left out.
    """

    name: str
    hardware_id: str
    findings: Sequence[Finding]
    fine: str
    values: Callable[[], Mapping[str, Value]]

    @property
    def level(self) -> bytes:
        """Return the worst level."""
        return max((level for level, _ in self.findings), default=OK)

    def message(self, node: str) -> DiagnosticStatus:
        """Return the message of a node, given its name with its namespace."""
        worst_first = sorted(self.findings, key=lambda finding: finding[0], reverse=True)
        values = []
        for key, value in {**self.values(), 'node': node}.items():
            if value is not None:
                text = f'{value:.6g}' if isinstance(value, float) else str(value)
                values.append(KeyValue(
                    key=key, value=text.lower() if isinstance(value, bool) else text))
        # /diagnostics is one topic for all namespaces, and tools know a status by its name alone.
        return DiagnosticStatus(
            level=self.level, name=f'{node.removeprefix("/")}: {self.name}',
            hardware_id=self.hardware_id,
            message='; '.join(text for _, text in worst_first) or self.fine, values=values)


def _known(value: Value) -> Value:
    return 'unknown' if value is None else value


@dataclass(frozen=True)
class LinkDiagnostics:
    """
    The link at one moment, for any thread.

    :param lines: each of its lines, the first one first.
    :param loops: the texts on copies of frames that come over each line.
    :param address_conflict: see :meth:`~..mavlink.component.Component.address_conflict`.
    :param unanswering: the devices whose last command got no acknowledgement.
    :param clock_fault: see :class:`~..mavlink.command_sender.CommandSender`.
    :param values: the values of the status of each line that are the same for all devices.
    :param devices: values of single devices, by address.
    :param heartbeats: see :attr:`~..mavlink.component.Component.heartbeats`.
    :param known: the devices of payloads.
    """

    lines: Sequence[link_state.LinkSnapshot]
    loops: Sequence[Sequence[str]]
    taken_at: float
    address: Address
    address_conflict: str
    unanswering: frozenset[Address]
    clock_fault: str
    values: Sequence[Mapping[str, Value]]
    devices: Mapping[Address, Mapping[str, Value]]
    heartbeats: Mapping[Address, Heartbeat]
    known: Collection[DeviceKind]

    @property
    def state(self) -> link_state.LinkSnapshot:
        """Return the first line; the counts of sources and signatures are those of all lines."""
        return self.lines[0]

    @property
    def failure(self) -> str:
        """Return why no line is open, for people; '' if one is."""
        return '' if any(line.is_open for line in self.lines) else self.state.failure

    @property
    def names(self) -> str:
        """Return the names of all lines, for people."""
        return ' and '.join(line.name for line in self.lines)

    @property
    def frames_received(self) -> int:
        """Return how many frames all lines have received."""
        return sum(line.traffic.frames_received for line in self.lines)

    @property
    def bytes_received(self) -> int:
        """Return how many bytes all lines have received."""
        return sum(line.traffic.bytes_received for line in self.lines)


def loops(
    copies: Mapping[tuple[int, int], int], urls: Sequence[str],
) -> dict[tuple[int, int], str]:
    """
    Return texts on copies of frames, for people.

    :param copies: see :meth:`~..mavlink.lines.Lines.copies`.
    """
    def text(first: int, second: int) -> str:
        if first == OWN.line:
            return (f'our own frames return over {urls[second]}: there is a loop, or another '
                    'sender uses our address')
        if first == second:
            return (f'copies of frames come over two senders on {urls[first]}: there is a loop, '
                    'or a component is behind both')
        return (f'copies of frames from {urls[first]} come over {urls[second]}: there is a loop, '
                'or a component is on both')

    return {lines: text(*lines) for lines in copies}


def link_diagnostics(
    link: Link, component: Component, urls: Sequence[str], known: Collection[DeviceKind],
    now: float,
) -> LinkDiagnostics:
    """
    Return a snapshot of the link; call it in the link's thread.

    :param urls: of its lines.
    :param known: the devices of payloads.
    """
    lines = link.lines.snapshots(now)
    commands, copies = component.commands, link.lines.copies(now)
    devices: dict[Address, Mapping[str, Value]] = {}
    for address, counter in lines[0].traffic.sources.items():
        trip = commands.round_trips.get(address)
        devices[address] = {
            'frames_lost': _known(counter.lost),
            'frames_duplicate': counter.duplicate,
            'frames_reordered': counter.reordered,
            'loss_percent': _known(counter.recent_loss),
            'round_trip_ms': None if trip is None else trip * 1000,
        }
    own: dict[str, Value] = {
        'commands_sent': commands.counters.sent,
        'commands_resent': commands.counters.resent,
        'commands_unanswered': commands.counters.unanswered,
        'signatures_good': lines[0].signing.good,
        'signatures_bad': lines[0].signing.bad,
        'signatures_replayed': lines[0].signing.replayed,
        'unsigned_frames': lines[0].signing.unsigned,
        'signatures_unchecked': lines[0].signing.unchecked,
    }
    values = [_line_values(line, url, now, sum(
        count for (_, second), count in copies.items() if second == index))
        for index, (line, url) in enumerate(zip(lines, urls, strict=True))]
    texts = loops(copies, urls)
    return LinkDiagnostics(
        lines, [[text for (_, second), text in texts.items() if second == index]
                for index in range(len(lines))], now, component.address,
        component.address_conflict(now), frozenset(commands.unanswering),
        commands.clock_fault(), [{**values[0], **own}, *values[1:]], devices,
        {**component.heartbeats}, known)


def _line_values(
    line: link_state.LinkSnapshot, url: str, now: float, copies: int,
) -> Mapping[str, Value]:
    traffic = line.traffic
    most = sorted(line.not_forwarded.items(), key=lambda one: -one[1])[:MAX_NAMED]
    return {
        'url': url,
        'open': line.is_open,
        'since_s': now - line.since,
        'openings': line.openings,
        'peers': line.peers,
        'frames_received': traffic.frames_received,
        'frames_sent': traffic.frames_sent,
        'frames_dropped': traffic.frames_dropped,
        'bytes_received': traffic.bytes_received,
        'bytes_sent': traffic.bytes_sent,
        'bytes_received_per_s': traffic.received_rate,
        'bytes_sent_per_s': traffic.sent_rate,
        'crc_errors': line.decoding.crc_errors,
        'frames_forwarded': line.forwarded,
        'frames_not_forwarded': sum(line.not_forwarded.values()),
        'not_forwarded': ', '.join(f'{name_of(id_)} {count}' for id_, count in most),
        'copies_received': copies,
    }


def line_reports(link: LinkDiagnostics) -> list[Report]:
    """Return the status of each further line."""
    return [
        Report(f'link {index + 1}', str(link.values[index]['url']), line_findings(link, index),
               f'open: {link.lines[index].name}', functools.partial(dict, link.values[index]))
        for index in range(1, len(link.lines))]


def line_findings(link: LinkDiagnostics, index: int) -> list[Finding]:
    """Return the findings on one line."""
    line = link.lines[index]
    return [*([] if line.is_open else [(ERROR, f'not open: {line.reason}')]),
            *([] if line.peers <= MAX_PEERS else [(WARN, (
                f'{line.peers} peers send, and only the first {MAX_PEERS} get an answer'))]),
            *((WARN, text) for text in link.loops[index])]


def _clash(link: LinkDiagnostics) -> str:
    return (f'another sender uses our address {link.address} ({link.address_conflict}): set the '
            'parameter component_id to an id that is free')


def why_nothing_is_heard(link: LinkDiagnostics, device: str) -> str:
    """
    Return the likeliest reason why no device is found on an open link, for people.

    :param device: such as ``a light``.
    """
    if silence := next((line.silence for line in link.lines if line.silence), ''):
        return silence
    signing, frames, bytes_ = link.state.signing, link.frames_received, link.bytes_received
    if link.address_conflict:
        return _clash(link)
    if signing.replayed and signing.replayed >= max(signing.bad, signing.unsigned):
        return (f'{signing.replayed} frames refused as replayed: their time stamps are not newer '
                'than the last; compare the clocks')
    if signing.bad:
        return (f'{signing.bad} frames refused for their signature, made with another '
                'key: both sides need the same key')
    if signing.unsigned and not frames:
        return (f'{signing.unsigned} frames refused because they are not signed: sign them at the '
                'other side, or set signing_mode to sign')
    unset = [str(one) for one in link.state.traffic.sources if not one.system]
    if unset:
        return (f'{", ".join(unset[:5])} heard, whose system id 0 cannot be addressed: set its '
                'system id, such as 1')
    if frames:
        heard = described(link.state.traffic.sources, link.heartbeats, link.known)
        return (f'{frames} frames from {heard}, none from {device}: check that it is on, and that '
                'routers forward its frames; discover names the node for each device')
    if bytes_:
        return f'{bytes_} bytes received, no valid frame; check the baud rate (discover)'
    return ('nothing is received: check that the device is on, and that it, or a router, sends '
            'to this address or line; on a serial line, that TX and RX are not swapped')


def link_report(
    link: LinkDiagnostics, device: Address | None, *, kind: str, absence: str, started: float,
    count: int | None = None, limit_reached: bool = False,
) -> Report:
    """
    Return the status of the link, as seen by the node of one device.

    :param device: the device of the node, None if there is none yet.
    :param kind: of device, such as ``light``.
    :param absence: why the node has no device, for people.
    :param started: when the node was started, s.
    :param count: how many devices of this kind are known, None where there is one at most.
    :param limit_reached: whether there are more, which are ignored.
    """
    findings = line_findings(link, 0)
    if link.address_conflict:
        findings.append((ERROR, _clash(link)))
    waited = link.taken_at - started
    if device is None:
        findings.append((
            ERROR if waited > DISCOVERY_GRACE else WARN,
            f'no {kind} connected for {format_seconds(waited)}'
            + (f': {absence}' if not link.failure else '')))
    if link.clock_fault:
        findings.append((WARN, link.clock_fault))
    if device in link.unanswering and link.state.signing.unchecked:
        findings.append((WARN, SIGNING_NEEDED))
    counts = link.state.traffic.sources.get(device) if device else None
    if counts and (counts.recent_loss or 0.0) > LOSS_WARNING:
        findings.append((WARN, f'{counts.recent_loss:.0f} % of the frames lost'))
    if limit_reached:
        findings.append((WARN, f'more than {count} {kind}s, some ignored'))
    known = {} if count is None else {f'{kind}s': count}
    own = link.devices.get(device, {}) if device else {}
    values = link.values[0]
    return Report('link', str(values['url']), findings, f'open: {link.state.name}',
                  lambda: {**values, **known, **own})
