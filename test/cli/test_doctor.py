# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``doctor`` without ROS: the machine, the ports and names; test/ros has the rest."""

from __future__ import annotations

from importlib import metadata
from typing import Any

from illuminator_ros.cli.discover.run import CONSOLE
from illuminator_ros.cli.doctor import machine, OLDEST_TIME, on_ports, shared_names
from illuminator_ros.mavlink.search.listener import NOT_SENT_HERE, SILENT
import pytest

LIGHT = {'address': '1/243', 'kinds': ['light'], 'mavlink_versions': [2], 'signed': False,
         'frames_per_s': 6.0}


def port(
    url: str, trouble: str = '', *heard: dict[str, Any], run: str = '',
) -> dict[str, Any]:
    return {'port': url, 'url': url if heard else '', 'trouble': trouble, 'components': heard,
            'run': [run] if run else [], 'try': []}


@pytest.mark.parametrize(('one', 'passed', 'text'), [
    (port('serial:///dev/x:57600', '', LIGHT, run='bridge serial:///dev/x:57600'), True,
     'serial:///dev/x:57600\n'
     '        1/243    light                            MAVLink 2              6.0 frames/s\n'
     '        run: bridge serial:///dev/x:57600'),
    (port('/dev/x', SILENT), False, f'/dev/x: {SILENT}'),
    (port('/dev/x', CONSOLE), True, f'/dev/x: {CONSOLE}'),
    (port('udpin://0.0.0.0:14550', NOT_SENT_HERE), True,
     f'udpin://0.0.0.0:14550: {NOT_SENT_HERE}'),
    *((port('udpin://0.0.0.0:14550', f'in use by {users}: end it'), passed,
       f'udpin://0.0.0.0:14550: in use by {users}: end it') for users, passed in (
        ('"bridge" (process 1)', True), ('"bridge" (process 1) and "x" (process 2)', False),
        ('"/usr/sbin/ModemManager" (process 612)', False))),
])
def test_a_port_passes_if_it_has_a_device_or_its_silence_is_usual(
    one: dict[str, Any], passed: bool, text: str,
) -> None:
    assert [*on_ports([one])] == [(passed, text)]


def test_one_address_on_two_ports_fails() -> None:
    *_, last = on_ports([port(url, '', LIGHT, run='x') for url in ('serial:///a:1', 'udpin:b')])

    assert last == (False, '1/243 is heard on serial:///a:1 and udpin:b: give one device another '
                           'id, or connect it over one link only (doc/links.md)')


def test_two_nodes_with_one_name_fail() -> None:
    assert [*shared_names(['/illuminator', '/gimbal', '/illuminator'])] == [
        (False, '2 nodes are called /illuminator: rename one with -r __node:=NAME')]


def test_old_and_missing_packages_and_a_clock_without_a_battery_fail(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def version(package: str) -> str:
        if package in ('pyserial', 'textual'):
            raise metadata.PackageNotFoundError
        return '2.4.1'

    monkeypatch.setattr(metadata, 'version', version)
    findings = [*machine(1000.0, {'ROS_DOMAIN_ID': '7'})]

    assert [text for passed, text in findings if not passed] == [
        "pymavlink 2.4.1 is too old; 2.4.50 or newer is needed: pip install 'pymavlink>=2.4.50'",
        'rclpy 2.4.1 is too old; 7.1 or newer is needed: install ROS 2 Jazzy or newer',
        "pyserial is not installed: pip install 'pyserial>=3.5'",
        'clock: 1970-01-01 00:16:40 UTC: set it, as by NTP, or signed frames are refused']
    assert 'ROS_DISTRO not set, ROS_DOMAIN_ID 7, ROS_AUTOMATIC_DISCOVERY_RANGE not set' in [
        text for passed, text in findings if passed]
    assert all(passed for passed, text in machine(OLDEST_TIME + 1.0, {}) if 'clock' in text)
