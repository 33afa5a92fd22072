# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The values and findings of a gimbal in /diagnostics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math

from ..axes import CONDITIONS, other_signs
from ..commands import Control
from ..events import GimbalKey, GimbalSnapshot
from ..gimbal_reports import STATUS_REQUEST_DELAY
from ...geometry.mount_attitude import AXES
from ...mavlink.dialect import entry_names, flag_names, mavlink
from ...mavlink.durations import format_seconds
from ...mavlink.messages import Address
from ...ros import diagnostics
from ...ros.command_sources import holder_values

# s; a longer silence of the device is reported: attitudes come about five times a second. A status
# that does not come is requested first.
ATTITUDE_SILENCE = 2.0
STATUS_SILENCE = STATUS_REQUEST_DELAY + 1.5
# s after the end of a rate after which a gimbal that turns is reported.
STOP_TIME = 1.0
NO_GEOID = ('geoid_separation is not set, so the altitude of the place is taken as above mean sea '
            'level, and is above the ellipsoid')
_ERRORS = 'GIMBAL_DEVICE_ERROR_FLAGS'


def why_no_gimbal(
    link: diagnostics.LinkDiagnostics, heard: Mapping[GimbalKey, str],
    without_id: Sequence[Address], known: str,
) -> str:
    """
    Return why a node has no gimbal, for people.

    :param heard: the announced gimbals, each with the reason why it is not connected, else ''.
    :param without_id: the managers that announce a gimbal with the id 0.
    :param known: the reason that a manager in this process gives, else ''.
    """
    if link.failure:
        return link.failure
    if known and link.frames_received:
        return known
    if heard:
        return '; '.join(
            f'gimbal {key} is announced, but {why or "gimbal_device_id selects another one"}'
            for key, why in heard.items())
    if without_id:
        return (f'manager {", ".join(map(str, without_id))} announces a gimbal with '
                'gimbal_device_id 0, which names none: it may not have found its gimbal device')
    return ('no component announces a gimbal: '
            f'{diagnostics.why_nothing_is_heard(link, "a gimbal manager")}')


def reports(
    link: diagnostics.LinkDiagnostics, *, gimbal: GimbalSnapshot | None,
    heard: Mapping[GimbalKey, str], without_id: Sequence[Address], known: str,
    limit_reached: bool, interval: float, started: float, geoid_is_known: bool,
    off_target: str,
) -> list[diagnostics.Report]:
    """
    Return the reports of a node.

    :param gimbal: the node's gimbal, None if there is none yet.
    :param without_id, known: see :func:`why_no_gimbal`.
    :param interval: the requested s between attitudes, 0 for the device's own interval.
    :param started: when the node was started, s on the link's clock.
    :param geoid_is_known: whether ``geoid_separation`` is set.
    :param off_target: why it is not on target, '' if it is.
    """
    manager = gimbal.managers[0] if gimbal else None
    made = [diagnostics.link_report(
        link, manager, kind='gimbal', started=started,
        absence=why_no_gimbal(link, heard, without_id, known), count=len(heard),
        limit_reached=limit_reached)]
    if gimbal is not None:
        fine = 'in control' if gimbal.in_control else 'connected'
        hardware_id = (f'{gimbal.identity.uid:x}' if gimbal.identity and gimbal.identity.uid else
                       f'mavlink:{gimbal.key.address.system}/{gimbal.key.device_id}')
        made.append(diagnostics.Report(
            'device', hardware_id, device_findings(
                gimbal, link.taken_at, interval, geoid_is_known=geoid_is_known), fine,
            lambda: {**_values(gimbal, link.taken_at), 'off_target': off_target or 'none'}))
    return made


def attitude_limit(interval: float) -> float:
    """Return the age beyond which an attitude is out of date, given the requested interval, s."""
    return max(ATTITUDE_SILENCE, 3 * interval)


def device_findings(
    gimbal: GimbalSnapshot, now: float, interval: float, *, geoid_is_known: bool,
) -> list[diagnostics.Finding]:
    """Return the findings on a gimbal."""
    limit_of_attitudes = attitude_limit(interval)
    findings: list[diagnostics.Finding] = []
    if gimbal.unstopped_since is not None and now - gimbal.unstopped_since > STOP_TIME:
        ago = f'{format_seconds(now - gimbal.unstopped_since)} after the end of its rate'
        findings.append(
            (diagnostics.ERROR, f'turns {ago}')
            if gimbal.turns and now - gimbal.attitude_at <= limit_of_attitudes else
            (diagnostics.WARN, f'its motion is unknown {ago}: no attitude comes'))
    if gimbal.unreachable:
        return [(diagnostics.ERROR, gimbal.unreachable), *findings]
    findings += [(diagnostics.WARN if flag & CONDITIONS else diagnostics.ERROR, name)
                 for flag, name in _single(gimbal.errors)]
    if others := gimbal.managers[1:]:
        findings.append((
            diagnostics.WARN, f'managers {", ".join(map(str, others))} announce the gimbal too: '
            f'only {gimbal.managers[0]} is used'))
    for name, at, limit in (
            ('GIMBAL_DEVICE_ATTITUDE_STATUS', gimbal.attitude_at, limit_of_attitudes),
            ('GIMBAL_MANAGER_STATUS', gimbal.status_at, STATUS_SILENCE)):
        if now - at > limit:
            since = f' for {format_seconds(now - at)}' if math.isfinite(at) else ''
            findings.append((diagnostics.WARN, f'no {name}{since}'))
    if gimbal.attitude_problem:
        findings.append((diagnostics.WARN, f'attitude unknown: {gimbal.attitude_problem}'))
    if gimbal.has_place and not geoid_is_known:
        findings.append((diagnostics.WARN, NO_GEOID))
    if not gimbal.enforces_control:
        findings.append((diagnostics.OK, 'ArduPilot records who has control and obeys others '
                                         'too: exclusive control is not guaranteed'))
    return findings


def _single(errors: int) -> list[tuple[int, str]]:
    flags = [flag for flag in entry_names(_ERRORS) if flag & errors]
    unknown = errors & ~sum(flags)
    return [(flag, name) for flag in (*flags, unknown) for name in flag_names(_ERRORS, flag)]


def controller(control: Control | None) -> str:
    """Return the components in control, for people; ``unknown`` if they are not known."""
    return 'unknown' if control is None else str(control)


def _ago(at: float, now: float) -> float | None:
    return now - at if math.isfinite(at) else None


def _values(gimbal: GimbalSnapshot, now: float) -> dict[str, diagnostics.Value]:
    attitude, capabilities = gimbal.attitude, gimbal.capabilities
    return {
        'address': str(gimbal.key.address),
        'gimbal_device_id': gimbal.key.device_id,
        'manager': str(gimbal.managers[0]),
        'connected': not gimbal.unreachable,
        'in_control': gimbal.in_control,
        'controller': controller(gimbal.control),
        'controller_s': None if gimbal.control is None else now - gimbal.control_since,
        'control_enforced': None if gimbal.enforces_control else False,
        'setpoints_sent': gimbal.setpoints_sent,
        'failure_flags': gimbal.errors,
        'flags': ', '.join(flag_names('GIMBAL_DEVICE_FLAGS', gimbal.flags)),
        'accepts_yaw_in_earth_frame': bool(
            gimbal.flags & mavlink.GIMBAL_DEVICE_FLAGS_ACCEPTS_YAW_IN_EARTH_FRAME),
        **holder_values(gimbal.holder, gimbal.held_since, now),
        'attitude_s_ago': _ago(gimbal.attitude_at, now),
        'status_s_ago': _ago(gimbal.status_at, now),
        'yaw_frame': attitude.frame.value if attitude else None,
        # Adding 0 turns a negative zero into 0.
        **({f'{axis}_rad': angle + 0.0 for axis, angle in zip(
            AXES, attitude.rotation.euler(), strict=True)} if attitude else {}),
        'vehicle_heading_rad': attitude.heading if attitude else None,
        'capabilities': None if capabilities is None else ', '.join(
            flag_names('GIMBAL_DEVICE_CAP_FLAGS', capabilities)),
        # With the signs of ROS: pitch down and yaw left are positive.
        **{f'{axis}_{end}_rad': value if math.isfinite(value) else None
           for axis, range_ in zip(AXES, gimbal.ranges or (), strict=False)
           for end, value in zip(('min', 'max'), other_signs(axis, range_), strict=True)},
        **(vars(gimbal.identity) if gimbal.identity else {})}
