# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The reports of one light's node on /diagnostics, and log lines on error flags. No ROS calls."""

from __future__ import annotations

from dataclasses import asdict, dataclass
import math

from ..events import LightSnapshot
from ..model import flag_names, KNOWN_FLAGS
from ...mavlink.dialect import mavlink
from ...mavlink.durations import format_seconds
from ...mavlink.messages import Address
from ...ros import diagnostics
from ...ros.command_sources import holder_values

# s without a status from a light that has sent some; one is requested every 2.5 s.
STATUS_SILENCE = 10.0
# s between two log lines on one flag.
FLAG_PAUSE = 5.0

# The consequence of each flag for the user of the light.
FLAG_LEVELS: dict[int, tuple[bytes, str]] = {
    mavlink.ILLUMINATOR_ERROR_FLAGS_THERMAL_THROTTLING: (
        diagnostics.WARN, 'dimmed because it is hot'),
    mavlink.ILLUMINATOR_ERROR_FLAGS_OVER_TEMPERATURE_SHUTDOWN: (
        diagnostics.ERROR, 'switched off because it is too hot'),
    mavlink.ILLUMINATOR_ERROR_FLAGS_THERMISTOR_FAILURE: (
        diagnostics.WARN, 'temperature sensor failed'),
}


def flag_findings(flags: int) -> dict[int, diagnostics.Finding]:
    """Return the finding on each error flag; the unknown ones share one."""
    found: dict[int, diagnostics.Finding] = {
        flag: finding for flag, finding in FLAG_LEVELS.items() if flags & flag}
    if unknown := flags & ~KNOWN_FLAGS:
        found[~KNOWN_FLAGS] = (diagnostics.WARN, flag_names(unknown)[0])
    return found


class FlagLog:
    """
    Reports when each flag is set and cleared, at most every :data:`FLAG_PAUSE`.

    A change within the pause is reported after it, so that the last line on a flag is true.
    """

    def __init__(self) -> None:
        # By flag, the name in its last line, '' if that reported it as cleared, and the time, s.
        self._reported: dict[int, tuple[str, float]] = {}

    def note(self, flags: int, now: float) -> list[diagnostics.Finding]:
        """
        Return the lines to log, of level OK for a flag that was cleared.

        :param flags: the error flags of a status; all unknown bits share one line.
        :param now: when it was received, s.
        """
        lines: list[diagnostics.Finding] = []
        found = flag_findings(flags)
        for flag in {**self._reported, **found}:
            name = ', '.join(flag_names(flags & flag))
            reported, reported_at = self._reported.get(flag, ('', -math.inf))
            if name == reported or now < reported_at + FLAG_PAUSE:
                continue
            self._reported[flag] = (name, now)
            if name:
                severity, text = found[flag]
                lines.append((severity, text if text == name else f'{name}: {text}'))
            else:
                lines.append((diagnostics.OK, f'{reported} cleared'))
        return lines


@dataclass(frozen=True)
class LightsHeard:
    """
    The lights on a link.

    :param some: the first few, including lights that are not served.
    :param unanswering: the first few that send heartbeats, and no status or answer.
    :param limit_reached: whether there are more than are taken.
    """

    count: int
    some: tuple[Address, ...]
    unanswering: tuple[Address, ...]
    limit_reached: bool


def why_no_light(link: diagnostics.LinkDiagnostics, heard: LightsHeard) -> str:
    """Return why the node has no light, for people."""
    if link.failure:
        return link.failure
    if heard.some:
        return (f'{", ".join(map(str, heard.some))} heard, none of which is the target: set '
                'target_system and target_component')
    if heard.unanswering:
        return (f'{", ".join(map(str, heard.unanswering))} heard, without an answer or an '
                'ILLUMINATOR_STATUS so far: check the line to it, and whether it requires signed '
                'messages')
    return (f'none heard yet on {link.names}: '
            + diagnostics.why_nothing_is_heard(link, 'a light'))


def reports(
    link: diagnostics.LinkDiagnostics, *, light: LightSnapshot | None, heard: LightsHeard,
    hardware_id: str, started: float, mount_absence: str = '',
) -> list[diagnostics.Report]:
    """
    Return the reports of a node.

    :param light: the node's light, None if there is none yet.
    :param hardware_id: of the light, '' while its identity is not settled.
    :param started: when the node was started, s on the link's clock.
    :param mount_absence: why the direction of its gimbal is not known, '' if it is.
    """
    made = [diagnostics.link_report(
        link, light.address if light else None, kind='light', absence=why_no_light(link, heard),
        started=started, count=heard.count, limit_reached=heard.limit_reached)]
    if light is not None and hardware_id:
        on = light.status.enabled if light.status else None
        findings = lamp_findings(light, link.taken_at)
        if mount_absence:
            findings.append((diagnostics.WARN, mount_absence))
        made.append(diagnostics.Report(
            'lamp', hardware_id, findings, {True: 'on', False: 'off', None: 'connected'}[on],
            lambda: _lamp_values(light, link.taken_at)))
    return made


def changing_states(address: Address) -> str:
    """Describe a state that goes back and forth without a command of ours."""
    return (f'{address} reports changing states: several lights with this address, or another '
            'controller')


def shared_address(light: LightSnapshot) -> str:
    """Return that several lights have one address, for people, '' if one has."""
    serials = light.shared_serials
    count = 'two' if len(serials) == 2 else len(serials)
    return serials and f'{count} lights use {light.address}: serials {", ".join(serials)}' or ''


def lamp_findings(light: LightSnapshot, now: float) -> list[diagnostics.Finding]:
    """Return the findings on a light."""
    if not light.connected:
        return [(diagnostics.ERROR, light.unreachable)]
    findings: list[diagnostics.Finding] = []
    status = light.status
    if status is not None:
        findings += flag_findings(status.error_flags).values()
        silence = now - light.status_at
        if silence > max(STATUS_SILENCE, 3 * light.status_interval):
            findings.append((diagnostics.WARN, f'no status for {format_seconds(silence)}'))
        if status.invalid:
            findings.append((diagnostics.WARN, f'implausible: {", ".join(status.invalid)}'))
    if shared := shared_address(light):
        findings.append((diagnostics.ERROR, shared))
    if light.states_are_changing:
        findings.append((diagnostics.WARN, changing_states(light.address)))
    if light.limit_exceeded.impossible:
        findings.append((diagnostics.ERROR, light.limit_exceeded.impossible))
    findings += [(diagnostics.WARN, text) for text in light.limit_exceeded.excess]
    if light.limit_exceeded.is_again:
        findings.append((diagnostics.WARN, 'does not keep the limit'))
    if light.discrepancy:
        findings.append((diagnostics.WARN, light.discrepancy))
    return findings


def _lamp_values(light: LightSnapshot, now: float) -> dict[str, diagnostics.Value]:
    status, identity = light.status, light.identity
    values: dict[str, diagnostics.Value] = {
        'address': str(light.address),
        'connected': light.connected,
        'heard_s_ago': now - light.heard_at if math.isfinite(light.heard_at) else None,
        'restarts': light.restarts,
        'states_are_changing': light.states_are_changing,
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
    if math.isfinite(light.off_at):
        values['off_in_s'] = max(light.off_at - now, 0.0)
    values |= holder_values(light.holder, light.held_since, now)
    if light.configuration:
        values['agreed'] = light.configuration.describe()
    if identity is not None:
        values |= asdict(identity)
    return values


def hardware_id(light: LightSnapshot) -> str:
    """Return the id of a light: its serial number, else its address as ``mavlink:1/243``."""
    serial = light.identity.serial_number if light.identity else ''
    return serial or f'mavlink:{light.address}'
