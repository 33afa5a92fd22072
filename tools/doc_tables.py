# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Write the tables of the documentation whose rows the code knows.

A table is found by the heading of its first column; headings and all else are written by hand.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
import math
from pathlib import Path
import re
import sys
from typing import TYPE_CHECKING
import xml.etree.ElementTree as ET

from illuminator_ros.cli.payloads import PAYLOADS
from illuminator_ros.gimbal import simulated_manager
from illuminator_ros.gimbal.gimbal_reports import GIMBAL_MESSAGE
from illuminator_ros.gimbal.managed_device import DEVICE_INFORMATION
from illuminator_ros.gimbal.rate_stop import STILL_TURNING, ZERO_RATE
from illuminator_ros.illuminator.light_queries import MESSAGE
from illuminator_ros.illuminator.rules import REQUIRED
from illuminator_ros.illuminator.simulated_properties import PROFILES
from illuminator_ros.mavlink.retries import CLOSING, COMMAND, CONNECTION, REJECTED, RESOURCE
from illuminator_ros.payload.attempt import REPEAT, SLOW_REPEAT, STATUS
from illuminator_ros.rededge.conversions import FIELDS
from illuminator_ros.rededge.pings import PING
from illuminator_ros.rededge.simulated import COLUMNS

if TYPE_CHECKING:
    from illuminator_ros.ros.node import Entity
    from illuminator_ros.ros.parameters import ParameterSpec

ROOT = Path(__file__).resolve().parent.parent
DOC = ROOT / 'doc'
Rows = Iterable[Sequence[str]]
# The rows of each table, by page and heading.
Tables = dict[tuple[str, str], Rows]


def launch_arguments(file: str) -> Rows:
    """Return the rows of the arguments of a launch file."""
    rows = []
    for argument in ET.parse(ROOT / 'launch' / file).getroot().findall('arg'):
        default = argument.attrib['default'].replace('$(find-pkg-share illuminator_ros)', '$SHARE')
        rows.append([f'`{argument.attrib["name"]}`', f'`{default}`' if default else '',
                     argument.attrib['description']])
    return rows


def tool_tables() -> Tables:
    """Return the tables of the tools that need no ROS."""
    return {
        ('rededge', 'message'): [
            [cls.msgname, f'`{name}`', field.source, field.unit,
             '' if field.scale is None else f'{field.scale:g}',
             f'{field.low:.10g} to {field.high:.10g}',
             '' if field.unknown is None else str(field.unknown)]
            for cls, fields in FIELDS.items() for name, field in fields.items()],
        ('design', 'tried again'): [
            [one.subject, f'{one.first:g}', f'{one.longest:g}',
             '' if one.tries == math.inf else f'{one.tries:g}']
            for one in (
                CONNECTION, COMMAND, REJECTED, STATUS, REPEAT, SLOW_REPEAT, CLOSING,
                REQUIRED, MESSAGE, GIMBAL_MESSAGE, DEVICE_INFORMATION, ZERO_RATE, STILL_TURNING,
                PING, RESOURCE)],
        ('ros', 'argument of `bridge.launch.xml`'): launch_arguments('bridge.launch.xml'),
        ('simulator', 'profile'): [
            [f'`{name}`', profile.description] for name, profile in PROFILES.items()],
        ('simulator', 'profile of a manager'): [
            [f'`{name}`', profile.description]
            for name, profile in simulated_manager.PROFILES.items()],
        ('simulator', 'column'): [[f'`{name}`', text] for name, text in COLUMNS.items()],
    }


def values_of(spec: ParameterSpec) -> str:
    """Return the values that a parameter may have."""
    return ', '.join(f'`{one}`' for one in spec.choices) or spec.shown_range


def meaning_of(spec: ParameterSpec) -> str:
    """Return the meaning of a parameter as tools show it, without choices and unit."""
    extra = spec.descriptor(read_only=False).additional_constraints
    text = spec.description if not extra or spec.choices else f'{spec.description}; {extra}'
    # Topics, and the example of names.
    return re.sub(r'(~/[\w/]*\w|\d+/\d+=\w+)', r'`\1`', text)


def parameters(of: Sequence[ParameterSpec]) -> Rows:
    """Return the rows of parameters, with their defaults."""
    return [[f'`{spec.name}`', f'`{spec.shown_default}`' if spec.shown_default else '',
             values_of(spec), spec.unit, meaning_of(spec)] for spec in of]


def endpoints(of: Iterable[Entity], name: str = '~/{}') -> list[list[str]]:
    """Return the rows of topics or services: name, type and meaning."""
    return [[f'`{name.format(one.name)}`',
             f'`{one.type.__module__.partition(".")[0]}/{one.type.__name__}`', one.meaning]
            for one in of]


def published(of: Iterable[Entity], statuses: str) -> Rows:
    """Return the rows of published topics, with their QoS, and of the diagnostics."""
    return [*([name, type_, 'stream' if one.qos else 'state', meaning]
              for one in of for name, type_, meaning in endpoints([one])),
            ['`/diagnostics`', '`diagnostic_msgs/DiagnosticArray`', 'stream', statuses]]


def of_a_source(of: Iterable[Entity], release: Entity) -> Rows:
    """Return the rows of the topics and services that each source of commands has."""
    return endpoints(
        [*(one._replace(meaning=f'as `~/{one.name}`, for that source') for one in of), release],
        '~/NAME/{}')


def ros_tables() -> Tables:
    """Return the tables of the ROS interface and of the monitor."""
    from illuminator_ros.cli.monitor import app
    from illuminator_ros.gimbal.ros import gimbal_node, manager_node
    from illuminator_ros.gimbal.ros.gimbals import GIMBAL_PARAMETERS
    from illuminator_ros.gimbal.ros.manager_node import MANAGER_PARAMETERS
    from illuminator_ros.illuminator.ros import event_publisher, light_node, lights
    from illuminator_ros.illuminator.ros.beam import beam_topic
    from illuminator_ros.illuminator.ros.diagnostics import FLAG_LEVELS
    from illuminator_ros.illuminator.ros.parameters import DEVICE_PARAMETERS, LIGHT_PARAMETERS
    from illuminator_ros.mavlink.dialect import short_names
    from illuminator_ros.rededge.ros import camera_node as camera
    from illuminator_ros.rededge.ros.inputs import TOPICS
    from illuminator_ros.ros.command_sources import RELEASE, SOURCE
    from illuminator_ros.ros.parameters import LINK_PARAMETERS

    kinds = {float: 'double', str: 'string'}
    levels = {b'\0': 'OK', b'\1': 'WARN', b'\2': 'ERROR'}
    views = [one.load('view') for one in PAYLOADS.values() if one.view]
    setpoints = (gimbal_node.CMD_ATTITUDE, gimbal_node.CMD_ANGLES, gimbal_node.CMD_RATE,
                 gimbal_node.CMD_ROI)

    def names(keys: Iterable[str]) -> str:
        return ' '.join(f'`{key}`' for key in keys)

    return {
        ('reference', 'published'): published(
            (*event_publisher.PUBLICATIONS, SOURCE, beam_topic()),
            '`illuminator: link` and `illuminator: lamp`; '
            '[their values](protocol.md#values-of-diagnostics)'),
        ('reference', 'accepted'): endpoints((
            light_node.ENABLE, light_node.REFRESH, lights.ENABLE_ALL, light_node.CMD_ENABLE,
            lights.CMD_ENABLE_ALL, light_node.CMD_BRIGHTNESS)),
        ('reference', 'of a source'): of_a_source(
            (light_node.CMD_ENABLE, light_node.CMD_BRIGHTNESS, light_node.ENABLE), RELEASE),
        ('gimbal', 'published'): published(
            (*gimbal_node.PUBLICATIONS, SOURCE),
            '`gimbal: link` and `gimbal: device`; [their values](#values-of-diagnostics)'),
        ('gimbal', 'accepted'): endpoints(
            (*setpoints, gimbal_node.FIX, *gimbal_node.REQUESTS)),
        ('gimbal', 'of a source'): of_a_source(setpoints, RELEASE),
        ('gimbal_manager', 'published by the manager'): published(
            [manager_node.DEVICE_SETPOINT], '`gimbal_manager: manager`'),
        ('gimbal_manager', 'subscribed by the manager'): endpoints((
            manager_node.DEVICE_ATTITUDE, manager_node.IMU, manager_node.ODOMETRY)),
        ('rededge', 'subscribed'): endpoints(TOPICS.values()),
        ('rededge', 'published'): published(
            camera.PUBLICATIONS,
            '`rededge: link` and `rededge: camera`; [their values](#values-of-diagnostics)'),
        ('rededge', 'service'): endpoints((camera.PING, *camera.CAPTURES)),
        ('reference', 'parameter of the light'): [
            [f'`{spec.name}`', kinds[type(spec.default)], values_of(spec), spec.unit,
             meaning_of(spec)] for spec in DEVICE_PARAMETERS],
        ('reference', 'parameter of the link'): parameters(
            (*LINK_PARAMETERS, *LIGHT_PARAMETERS)),
        ('beam', 'parameter of the beam'): parameters([
            spec for spec in LIGHT_PARAMETERS if spec.name in (
                'frame_id', 'beam_range', 'beam_angle', 'mounted_on')]),
        ('gimbal', 'parameter of the gimbal'): parameters(GIMBAL_PARAMETERS),
        ('gimbal_manager', 'parameter of the manager'): parameters(MANAGER_PARAMETERS),
        ('rededge', 'parameter of the camera'): parameters(
            (*camera.PARAMETERS, *camera.MOUNT_PARAMETERS)),
        ('protocol', 'ILLUMINATOR_ERROR_FLAGS'): [
            *([f'{name} ({flag})', levels[FLAG_LEVELS[flag][0]], FLAG_LEVELS[flag][1]]
              for flag, name in short_names('ILLUMINATOR_ERROR_FLAGS').items()),
            ['any other', 'WARN', 'unknown flags, in hexadecimal']],
        ('monitor', 'key'): [[names(keys), text] for keys, text, _, _ in (
            *app.COMMON_KEYS, *app.ALWAYS)],
        **{('monitor', f'key for a {view.kind}'): [
            [names(key.keys), key.text] for key in (*view.keys, *view.steering)]
           for view in views},
    }


def with_rows(text: str, heading: str, rows: Rows) -> str:
    """Return a page with these rows in the table whose first column has this heading."""
    # A function: a row may contain backslashes.
    text, count = re.subn(
        rf'(^\| {re.escape(heading)} \|.*\n\|[-|]+\n)(?:\|.*\n)*',
        lambda found: found[1] + ''.join(f'| {" | ".join(row)} |\n' for row in rows),
        text, flags=re.MULTILINE)
    if count != 1:
        raise ValueError(f'{count} tables {heading!r}')
    return text


def written(tables: Tables) -> dict[Path, str]:
    """Return the pages as they are with these tables."""
    pages: dict[Path, str] = {}
    for (page, heading), rows in tables.items():
        path = DOC / f'{page}.md'
        pages[path] = with_rows(pages.get(path) or path.read_text(), heading, rows)
    return pages


def main() -> None:
    """Write all tables; without ROS, those that need none."""
    sources: list[Callable[[], Tables]] = [tool_tables, ros_tables]
    for source in sources:
        try:
            pages = written(source())
        except ModuleNotFoundError as error:
            print(f'tables of the ROS interface are left as they are: {error}', file=sys.stderr)
            continue
        for path, text in pages.items():
            if text != path.read_text():
                path.write_text(text)
                print(f'wrote {path}')


if __name__ == '__main__':
    main()
