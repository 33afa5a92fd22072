# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Gimbals in the monitor."""

from __future__ import annotations

from collections.abc import Iterable
import functools
import math

from geometry_msgs.msg import Vector3, Vector3Stamped
from sensor_msgs.msg import NavSatFix
from std_msgs.msg import Bool, Header, String

from ...ros import monitor_view as shared
from ...ros.monitor_view import Device, Key, Request, Topic, UNKNOWN

# Degrees for one press of an arrow key.
STEP = 5.0
# Degrees by which a confirmed angle may differ from the requested one.
TOLERANCE = 2.0
# The limit of ~/cmd/angles, and the directions of positive and negative angles in ROS.
AXES = {'roll': (math.pi, 'right', 'left'), 'pitch': (math.pi / 2, 'down', 'up'),
        'yaw': (math.pi, 'left', 'right')}


def angle(device: Device, axis: str) -> float | None:
    """Return the angle of an axis, rad, None if it is unknown."""
    known: float | None = device.values.get('angles', (None,) * 4)[1 + [*AXES].index(axis)]
    return known


def described(device: Device, axis: str) -> str:
    """Return the angle of an axis with its direction."""
    known = angle(device, axis)
    return UNKNOWN if known is None else _in_frame(device, axis, known)


def _in_frame(device: Device, axis: str, radians: float) -> str:
    """Return an angle with its direction; for yaw, which has several origins, with its frame."""
    frame = f' in {device.values["angles"][0]}' if axis == 'yaw' else ''
    return f'{direction(axis, radians)}{frame}'


def direction(axis: str, radians: float) -> str:
    """Return an angle in degrees, with a word for its sign."""
    degrees = round(math.degrees(radians), 1)
    return f'{abs(degrees):.1f} {AXES[axis][1 + (degrees < 0)] if degrees else ""}'.rstrip()


def _refusal(device: Device) -> str:
    """Return why the node would ignore a setpoint, '' if it would not."""
    return '' if device.values.get('in_control') else (
        f'not in control ({device.values.get("controller", "unknown")}): take control first')


def nudge(device: Device, typed: str, axis: str, step: float) -> Request | str:
    """Turn one axis by a step, degrees, from its last target or its angle."""
    start = device.wants(axis, angle(device, axis))
    if refusal := _refusal(device) or ('its angles are unknown' if start is None else ''):
        return refusal
    aim, limit = start + math.radians(step), AXES[axis][0]
    # Yaw has no end: it goes on beyond half a turn.
    return _aim(device, axis, math.remainder(aim, math.tau) if axis == 'yaw' else (
        min(max(aim, -limit), limit)))


def turn(device: Device, typed: str, axis: str) -> Request | str:
    """Turn one axis to an angle, degrees."""
    limit = round(math.degrees(AXES[axis][0]))
    degrees = shared.number(typed, 'deg', -limit, limit)
    if isinstance(degrees, str):
        return degrees
    return _refusal(device) or (
        'its angles are unknown' if angle(device, axis) is None else
        _aim(device, axis, math.radians(degrees)))


def _aim(device: Device, axis: str, aim: float) -> Request:
    # NaN leaves an axis as it is. The newest setpoint replaces others, so it has their targets.
    targets = {one: aim if one == axis else device.wants(one, math.nan) for one in AXES}
    return Request(
        f'{axis} to {_in_frame(device, axis, aim)}', f'{device.prefix}cmd/angles', Vector3Stamped,
        Vector3Stamped(header=Header(frame_id=device.values['angles'][0]),
                       vector=Vector3(**dict(zip('xyz', targets.values(), strict=True)))),
        {one: target for one, target in targets.items() if math.isfinite(target)})


def point(device: Device, typed: str) -> Request | str:
    """Point at a place."""
    if not (found := shared.numbers(typed, 3)):
        return f'{typed!r} is not latitude, longitude and altitude'
    latitude, longitude, altitude = found
    if not (abs(latitude) <= 90 and abs(longitude) <= 180):
        return f'{typed!r} is not a place'
    return _refusal(device) or Request(
        f'point at {typed}', f'{device.prefix}cmd/roi', NavSatFix,
        NavSatFix(latitude=latitude, longitude=longitude, altitude=altitude))


def _shows(device: Device, name: str, value: float) -> bool:
    """Return whether an axis shows an angle within :data:`TOLERANCE`."""
    known = angle(device, name)
    return known is not None and (
        abs(math.remainder(known - value, math.tau)) <= math.radians(TOLERANCE))


def take_control(device: Device, typed: str) -> Request:
    """Take primary control; ask first unless no component has it."""
    controller = device.values.get('controller', 'unknown')
    is_free = device.values.get('in_control') or controller.startswith('primary none')
    return shared.trigger('take_control', '' if is_free else (
        f'take control of {device.name}? In control now: {controller}.'))


def neutral(device: Device, typed: str) -> Request:
    """Turn to the neutral position, wherever that is."""
    return shared.trigger('neutral', f'turn {device.name} to its neutral position?')


def _details(device: Device) -> Iterable[shared.DetailLine]:
    for axis in AXES:
        ends = [device.number('device', f'{axis}_{end}_rad') for end in ('min', 'max')]
        range_ = ' to '.join(direction(axis, end) for end in ends if end is not None)
        # In the earth's frame too: the device has stops, whatever yaw counts from.
        of = ' from ahead' if axis == 'yaw' else ''
        yield axis, [described(device, axis), f' (range{of}: {range_})' * bool(range_)]
    # The diagnostics also know it from before this monitor, but up to a second later.
    known = device.number('device', 'controller_s')
    since = device.since('controller') or (known is not None and shared.age(known))
    yield 'control', ['ours: ' if device.values.get('in_control') else '',
                      device.values.get('controller', 'unknown'), f' for {since}' * bool(since)]


VIEW = shared.View(
    'gimbal', {
        'connected': Topic(Bool), 'in_control': Topic(Bool), 'controller': Topic(String),
        'yaw_lock': Topic(Bool), 'source': Topic(String),
        'angles': Topic(Vector3Stamped, lambda message: (
            message.header.frame_id, message.vector.x, message.vector.y, message.vector.z),
            is_state=False)},
    ('in_control', 'controller', 'angles', 'connected'),
    lambda device: (
        device.values.get('controller', UNKNOWN), f'pitch {described(device, "pitch")}',
        f'yaw {described(device, "yaw")}', 'yaw locked' * bool(device.values.get('yaw_lock'))),
    _details,
    (Key(('t',), 'take control', take_control),
     shared.trigger_key('l', 'release control', 'release_control'),
     Key(('n',), 'neutral position', neutral),
     Key(('p',), 'point at a place', point,
         'latitude, longitude (degrees) and altitude (m above the ellipsoid)'),
     *(Key((key,), axis, functools.partial(turn, axis=axis),
           f'{axis}, degrees {AXES[axis][1]}, below 0 {AXES[axis][2]}')
       for key, axis in (('d', 'pitch'), ('y', 'yaw'))),
     shared.RELEASE_SOURCE),
    steering=[Key((key,), f'by {STEP:g} deg', functools.partial(nudge, axis=axis, step=step))
              for key, axis, step in (('left', 'yaw', STEP), ('right', 'yaw', -STEP),
                                      ('up', 'pitch', -STEP), ('down', 'pitch', STEP))],
    states={'ours': 'bold green', 'ok': 'green'},
    state=lambda device: 'ours' if device.values.get('in_control') else (
        'ok' if device.values else shared.NOT_KNOWN),
    settings={
        **shared.trigger_settings('take_control'),
        **{axis: functools.partial(turn, axis=axis) for axis in AXES},
        **shared.trigger_settings('neutral', 'release_control'),
        'release': shared.if_true(shared.release_source)},
    shows=_shows)
