# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Cameras in the monitor."""

from __future__ import annotations

from collections.abc import Iterable
import re

from sensor_msgs.msg import NavSatFix
from std_msgs.msg import Bool, UInt32

from ...ros import monitor_view as shared
from ...ros.monitor_view import Device, Topic, trigger_key, UNKNOWN

# The inputs, as /diagnostics names them, and the styles of their states.
INPUTS = ('fix', 'velocity', 'velocity_with_covariance', 'odometry', 'satellites', 'imu',
          'attitude', 'mount', 'time_reference')
STYLES = {'ok': 'green', 'missing': 'yellow', 'stale': 'yellow', 'unsent': 'bold red',
          'refused': 'bold red'}


def place(device: Device) -> str:
    """Return the position of the last image."""
    status, *position = device.values.get('image/fix', (-1,))
    return (UNKNOWN if status < 0 or None in position else
            '{:.6f} {:.6f} {:.1f} m'.format(*position))


def _image(device: Device) -> str:
    # The diagnostics also have the number of an image from before this monitor.
    known = device.diagnosed('camera', 'image_index') or UNKNOWN
    index, since = device.values.get('image/index', known), device.since('image/index')
    return f'{index}' + (since and f', {since} ago')


def _inputs(device: Device) -> str:
    return ' '.join(name for name in INPUTS if device.diagnosed('camera', name) == 'ok') or 'none'


def _details(device: Device) -> Iterable[shared.DetailLine]:
    yield 'image', [f'{_image(device)}, at {place(device)}']
    cells: list[shared.Cell] = []
    findings = device.diagnoses['camera'].message if 'camera' in device.diagnoses else ''
    for name in INPUTS:
        state, seconds = device.diagnosed('camera', name), device.number('camera', f'{name}_s_ago')
        if state == 'missing' and not re.search(rf'~/{name}\b', findings):
            # The camera does not need it.
            state = 'unused'
        cells += [f'{name} ', (state or UNKNOWN, STYLES.get(state, '')),
                  '   ' if seconds is None else f' {shared.age(seconds)}   ']
    yield 'inputs', cells


VIEW = shared.View(
    'camera', {
        'connected': Topic(Bool), 'image/index': Topic(UInt32, is_state=False),
        'image/fix': Topic(NavSatFix, lambda message: (
            message.status.status, message.latitude, message.longitude, message.altitude),
            is_state=False)},
    ('image/index', 'image/fix', 'connected'),
    lambda device: (
        _image(device), shared.measured(device.number('camera', 'round_trip_ms'), 'ms'),
        _inputs(device), place(device)),
    _details,
    (trigger_key('space', 'capture', 'capture'),
     trigger_key('b', 'capture panel', 'capture_panel'), trigger_key('p', 'ping', 'ping')),
    settings=shared.trigger_settings('capture', 'capture_panel', 'ping'))
