# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The reports of the camera's node on /diagnostics: pure functions of snapshots."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
import math
from typing import NamedTuple

from ..client import CameraSnapshot
from ..feeder import FeederSnapshot
from ..input_states import Input, InputSnapshot, InputState, RECENT_MESSAGES
from ...mavlink.dialect import mavlink
from ...mavlink.durations import format_seconds
from ...ros.diagnostics import (
    ERROR,
    Finding,
    link_report,
    LinkDiagnostics,
    Report,
    Value,
    WARN,
    why_nothing_is_heard,
)

# The camera adopts the system id of the host, so only the component id identifies it.
HARDWARE_ID = f'mavlink:{mavlink.MAV_COMP_ID_CAMERA}'


class InputTopic(NamedTuple):
    """The topic of an input, with its name in the graph and the number of its publishers."""

    name: str
    publishers: int

    def __str__(self) -> str:
        count = self.publishers
        return f'{self.name} has {count or "no"} publisher{"s" if count > 1 else ""}'


# The topics whose publishers have been counted.
Topics = Mapping[Input, InputTopic]


def reports(
    link: LinkDiagnostics, *, camera: CameraSnapshot, feeder: FeederSnapshot, graph: Topics,
    started: float, geoid_is_known: bool,
) -> list[Report]:
    """
    Return the reports of the node.

    :param started: when the node was started, s on the link's clock.
    :param geoid_is_known: whether ``geoid_separation`` is set.
    """
    findings = camera_findings(camera) + input_findings(feeder, graph)
    if not geoid_is_known:
        findings.append((WARN, 'geoid_separation is not set, so altitudes are above the '
                               'ellipsoid'))
    return [link_report(link, camera.address, kind='camera', absence=why_no_camera(link),
                        started=started),
            Report('camera', HARDWARE_ID, findings, 'connected',
                   lambda: _values(camera, feeder, link.taken_at))]


def why_no_camera(link: LinkDiagnostics) -> str:
    """Return why no camera was heard, for people."""
    return link.failure or (
        f'none heard yet on {link.names}: {why_nothing_is_heard(link, "a camera")}')


def camera_findings(camera: CameraSnapshot) -> list[Finding]:
    """Return the findings on the camera itself."""
    if not camera.connected:
        return [(ERROR, camera.loss) if camera.loss else (WARN, 'not heard yet')]
    findings: list[Finding] = []
    if camera.conflict:
        findings.append((
            ERROR, f'several components have id {mavlink.MAV_COMP_ID_CAMERA}: give each '
            'camera a link of its own'))
    if camera.is_unresponsive:
        findings.append((WARN, f'{camera.unanswered_pings} PINGs without a reply: the camera does '
                               'not receive our messages; check the line to it'))
    return findings


def input_findings(feeder: FeederSnapshot, graph: Topics) -> list[Finding]:
    """Return a finding for each input that is missing, stale, refused or shared."""
    findings: list[Finding] = []
    optional = set(Input).difference(*feeder.needed)
    for group in (*feeder.needed, *((name,) for name in Input if name in optional)):
        states = {feeder.inputs[name].state: name for name in reversed(group)}
        if InputState.OK in states:
            name = states[InputState.OK]
            one = feeder.inputs[name]
            if one.refused_lately > RECENT_MESSAGES / 2:
                findings.append((WARN, f'~/{name.value}: {one.refused_lately} of the last '
                                       f'{RECENT_MESSAGES} messages were refused: {one.refusal}'))
            continue
        for state in (InputState.UNSENT, InputState.REFUSED, InputState.STALE):
            if state in states:
                name = states[state]
                findings.append((WARN, why_unused(name, feeder.inputs[name])))
                break
        else:
            if group in feeder.needed:
                findings.append((WARN, nothing_received(group, graph)))
    if feeder.no_pair:
        findings.append((WARN, f'attitude and mount are not sent: {feeder.no_pair}'))
    return findings + [(WARN, text) for text in shared_topics(graph)]


def topics(names: Sequence[Input]) -> str:
    """Return the topics of alternative inputs, for people."""
    return ' or '.join(f'~/{name.value}' for name in names)


def nothing_received(names: Sequence[Input], graph: Topics) -> str:
    """Return that nothing is received on the topics of alternative inputs, for people."""
    known = '; '.join(str(graph[name]) for name in names if name in graph)
    return f'nothing received on {topics(names)}' + (f' ({known})' if known else '')


def missing(feeder: FeederSnapshot, graph: Topics) -> Iterable[str]:
    """Return a text for each required input of which no message has ever been received."""
    return (nothing_received(group, graph) for group in feeder.needed
            if all(feeder.inputs[name].state is InputState.MISSING for name in group))


def shared_topics(graph: Topics) -> Iterable[str]:
    """Return a text for each topic with several publishers."""
    return (f'{topics([name])}: {topic}, so images may get values of each in turn'
            for name, topic in graph.items() if topic.publishers > 1)


def why_unused(name: Input, snapshot: InputSnapshot) -> str:
    """Return why an input that was received is refused, stale or not sent, for people."""
    if snapshot.state is InputState.UNSENT:
        return (f'~/{name.value}: received, and not sent: the line has no room (lower the rates '
                'of the inputs, or raise the baud rate), or no camera was heard yet on a UDP link')
    if snapshot.state is InputState.REFUSED or snapshot.age is None:
        return (f'~/{name.value} refused {format_seconds(snapshot.refused_age or 0.0)} ago: '
                f'{snapshot.refusal}')
    return f'~/{name.value}: nothing for {format_seconds(snapshot.age)}'


def _values(camera: CameraSnapshot, feeder: FeederSnapshot, now: float) -> dict[str, Value]:
    values: dict[str, Value] = {
        'address': str(camera.address) if camera.address else None,
        'connected': camera.connected,
        'heard_s_ago': now - camera.heard_at if math.isfinite(camera.heard_at) else None,
        'round_trip_ms': None if camera.round_trip is None else camera.round_trip * 1000,
        'pings_unanswered': camera.unanswered_pings,
        'images': camera.images,
        'image_index': camera.image_index,
    }
    for name, one in feeder.inputs.items():
        values |= {name.value: one.state.value, f'{name.value}_s_ago': one.age}
        if one.refused:
            values |= {f'{name.value}_refused': one.refused,
                       f'{name.value}_refused_s_ago': one.refused_age,
                       f'{name.value}_refusal': one.refusal}
    return values
