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

"""
What an operator is told on /diagnostics: two statuses, one for the link and one for the lamp.

Pure functions: from the state of link and light to DiagnosticStatus (REP 107). Keys bear their
unit, and a value that is a number is nothing but that number, so that it can be plotted. ``now``
and ``started``, when the node was, are s on the link's clock.
"""

from __future__ import annotations

from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from ..illuminator.client import IlluminatorClient
from ..illuminator.error_flags import ErrorFlag, flag_names, KNOWN_FLAGS
from ..illuminator.light import Light
from ..mavlink.command import format_seconds
from ..mavlink.component import Component
from ..mavlink.link_state import LinkState

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR

# s in which a light may be looked for before its absence is an error.
DISCOVERY_GRACE = 10.0
# s without a status from a light that has sent some: it is asked for one every 2.5 s.
STATUS_SILENCE = 10.0
# % of the frames of a light that may be lost before it is worth a warning.
LOSS_WARNING = 5.0

# What each flag means for whoever trusts the light.
FLAG_LEVELS: dict[ErrorFlag, tuple[bytes, str]] = {
    ErrorFlag.THERMAL_THROTTLING: (WARN, 'dimmed because it is hot'),
    ErrorFlag.OVER_TEMPERATURE_SHUTDOWN: (ERROR, 'switched off because it is too hot'),
    ErrorFlag.THERMISTOR_FAILURE: (WARN, 'temperature sensor failed'),
}

Finding = tuple[bytes, str]


def _status(name: str, hardware_id: str, findings: list[Finding], fine: str,
            values: dict[str, Any]) -> DiagnosticStatus:
    worst_first = sorted(findings, key=lambda finding: finding[0], reverse=True)
    return DiagnosticStatus(
        level=level(findings), name=name, hardware_id=hardware_id,
        message='; '.join(text for _, text in worst_first) or fine,
        values=[KeyValue(key=key, value=_text(value)) for key, value in values.items()
                if value is not None])


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f'{value:.6g}' if isinstance(value, float) else str(value)


def level(findings: list[Finding]) -> bytes:
    """Return the worst level among findings."""
    return max((finding[0] for finding in findings), default=OK)


def why_nothing_is_heard(state: LinkState) -> str:
    """Return the likeliest reason why an open link brings no light, for people."""
    signing = state.signing
    if signing.bad:
        return f'{signing.bad} frames refused for their signature, made with another key'
    if signing.unsigned and not state.traffic.frames_received:
        return f'{signing.unsigned} frames refused because they are not signed'
    if state.traffic.frames_received:
        return f'{state.traffic.frames_received} frames came, none from an illuminator'
    if state.traffic.bytes_received:
        return f'{state.traffic.bytes_received} bytes came and no good frame, as with a wrong ' \
               'baud rate'
    return 'nothing comes in'


def why_no_light(state: LinkState, client: IlluminatorClient) -> str:
    """Return why the node has no light, for people."""
    if state.failure:
        return state.failure
    others = ', '.join(map(str, [*client.lights, *client.left_alone][:8]))
    if others:
        return f'{others} heard, none of which is the target'
    return f'none heard yet on {state.name}: {why_nothing_is_heard(state)}'


def flag_findings(flags: int) -> dict[int, Finding]:
    """Return what error flags mean, by flag; the unknown ones are one."""
    found: dict[int, Finding] = {
        flag: finding for flag, finding in FLAG_LEVELS.items() if flags & flag}
    if unknown := flags & ~KNOWN_FLAGS:
        found[~KNOWN_FLAGS] = (WARN, flag_names(unknown)[0])
    return found


def link_findings(
    state: LinkState, component: Component, client: IlluminatorClient, light: Light | None, *,
    now: float, started: float,
) -> list[Finding]:
    """Return what is wrong with the link, as seen by the node of one light (None: of none yet)."""
    findings: list[Finding] = []
    if not state.is_open:
        findings.append((ERROR, f'not open: {state.reason}'))
    if component.address_conflict(now):
        findings.append((ERROR, f'another sender uses our address {component.address}'))
    if light is None:
        severity = WARN if now - started < DISCOVERY_GRACE else ERROR
        # A link that is not open has been found above.
        why = f': {why_no_light(state, client)}' if state.is_open else ''
        findings.append(
            (severity, f'no light connected for {format_seconds(now - started)}{why}'))
    if state.signing.unchecked and light and light.address in component.commands.unanswering:
        findings.append((WARN, 'commands go unanswered, and the others sign their frames while '
                               'signing_mode is off'))
    if client.passed_over:
        findings.append((WARN, f'more than {len(client.lights)} lights, some passed over'))
    counter = state.traffic.sources.get(light.address) if light else None
    if counter and counter.recent_loss(now) > LOSS_WARNING:
        findings.append((WARN, f'{counter.recent_loss(now):.0f} % of the frames lost'))
    return findings


def link_status(
    node_name: str, url: str, state: LinkState, component: Component, client: IlluminatorClient,
    light: Light | None, *, now: float, started: float,
) -> DiagnosticStatus:
    """Return the status of the link, as seen by the node of one light (None: of none yet)."""
    findings = link_findings(state, component, client, light, now=now, started=started)
    counter = state.traffic.sources.get(light.address) if light else None
    traffic, decoding, signing = state.traffic, state.decoding, state.signing
    trip = component.commands.round_trip(light.address) if light else None
    seconds = [trip.quantile(0.5), trip.quantile(0.95)] if trip else [None, None]
    return _status(f'{node_name}: link', url, findings, f'open: {state.name}', {
        'url': url,
        'open': state.is_open,
        'since_s': now - state.since,
        'openings': state.openings,
        'peers': state.peers,
        'lights': len(client.lights),
        'frames_received': traffic.frames_received,
        'frames_sent': traffic.frames_sent,
        'frames_dropped': traffic.frames_dropped,
        'bytes_received': traffic.bytes_received,
        'bytes_sent': traffic.bytes_sent,
        'bytes_received_per_s': traffic.received_rate(now),
        'bytes_sent_per_s': traffic.sent_rate(now),
        'crc_errors': decoding.crc_errors,
        'frames_lost': counter.lost if counter else None,
        'frames_duplicate': counter.duplicate if counter else None,
        'frames_reordered': counter.reordered if counter else None,
        'loss_percent': counter.recent_loss(now) if counter else None,
        'round_trip_p50_ms': None if seconds[0] is None else seconds[0] * 1000,
        'round_trip_p95_ms': None if seconds[1] is None else seconds[1] * 1000,
        'commands_sent': component.commands.counters.sent,
        'commands_resent': component.commands.counters.resent,
        'commands_unanswered': component.commands.counters.unanswered,
        'signatures_good': signing.good,
        'signatures_bad': signing.bad,
        'signatures_replayed': signing.replayed,
        'unsigned_frames': signing.unsigned,
        'signatures_unchecked': signing.unchecked,
    })


def lamp_findings(light: Light, now: float) -> list[Finding]:
    """Return what is wrong with a light, without looking at anything slow: it is asked often."""
    if not light.connected:
        return [(ERROR, light.unreachable(now))]
    findings: list[Finding] = []
    status = light.status
    if status is not None:
        findings += flag_findings(status.error_flags).values()
        silence = now - light.status_at
        if silence > max(STATUS_SILENCE, 3 * light.settings.status_interval):
            findings.append((WARN, f'no status for {format_seconds(silence)}'))
        if status.invalid:
            findings.append((WARN, f'not believable: {", ".join(status.invalid)}'))
    if light.sharing.recognised:
        findings.append((WARN, f'several lights answer as {light.address}: their statuses '
                               'contradict one another'))
    if light.agreement.discrepancy:
        findings.append((WARN, light.agreement.discrepancy))
    return findings


def lamp_status(node_name: str, hardware_id: str, light: Light, now: float) -> DiagnosticStatus:
    """Return the status of a light."""
    status, identity = light.status, light.identification.identity
    values: dict[str, Any] = {
        'address': str(light.address),
        'connected': light.connected,
        'heard_s_ago': now - light.heard_at,
        'restarts': light.restarts,
        'shared_address': light.sharing.recognised,
    }
    if status is not None:
        values |= {
            'enabled': status.enabled,
            'mode': status.mode.label,
            'brightness_percent': status.brightness,
            'strobe_period_s': status.strobe_period,
            'strobe_duty_cycle_percent': status.strobe_duty_cycle,
            'temperature_c': light.temperature,
            'error_flags': status.error_flags,
            'uptime_s': status.uptime_ms / 1000.0,
            'status_s_ago': now - light.status_at,
        }
    if light.agreement.agreed:
        values['agreed'] = light.agreement.agreed.describe()
    if identity is not None:
        values |= {
            'vendor': identity.vendor, 'model': identity.model,
            'software_version': identity.software_version,
            'hardware_version': identity.hardware_version,
            'serial_number': identity.serial_number}
    fine = {True: 'on', False: 'off', None: 'connected'}[status.enabled if status else None]
    return _status(
        f'{node_name}: lamp', hardware_id, lamp_findings(light, now), fine, values)


def hardware_id(light: Light) -> str:
    """Return the id of a light: its serial number, else its address as ``mavlink:1/243``."""
    identity = light.identification.identity
    return (identity.serial_number if identity else '') or f'mavlink:{light.address}'
