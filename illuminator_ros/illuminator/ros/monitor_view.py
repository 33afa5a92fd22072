# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Lights in the monitor."""

from __future__ import annotations

from collections.abc import Iterable
import functools
import math
import re

from rcl_interfaces.srv import SetParametersAtomically
from rclpy.parameter import Parameter
from sensor_msgs.msg import Temperature
from std_msgs.msg import Bool, Float32, Float64, String, UInt32
from std_srvs.srv import SetBool

from ...ros import monitor_view as shared
from ...ros.monitor_view import Device, Key, measured, Request, Topic, UNKNOWN

# Brightness steps, %; strobe for a light that has none, s and %.
STEP, FINE_STEP = 10.0, 1.0
STROBE_PERIOD, STROBE_DUTY_CYCLE = 1.0, 50.0
# ILLUMINATOR_ERROR_FLAGS_THERMISTOR_FAILURE; the monitor does not import MAVLink.
THERMISTOR_FAILURE = 4


def switch(device: Device, typed: str = '', on: bool | None = None) -> Request:
    """Switch a light on or off; None is the opposite of its state, on if that is unknown."""
    if on is None:
        on = not device.wants('enabled', device.values.get('enabled'))
    return Request(
        'on' if on else 'off', f'{device.prefix}enable', SetBool, SetBool.Request(data=on),
        {'enabled': on}, f'switch {device.name} ON? It can dazzle.' if on else '', is_off=not on)


switch_off = functools.partial(switch, on=False)


def agreed(device: Device) -> float | None:
    """Return the brightness that is agreed with a light, %; a hot light shines less."""
    found = re.search(r'brightness ([0-9.]+) %', device.diagnosed('lamp', 'agreed'))
    if found and device.values.get('error_flags'):
        return float(found[1])
    return device.values.get('brightness')


def dim(device: Device, typed: str, step: float) -> Request | str:
    """Change the brightness by a step, %, from the requested or agreed one."""
    start = device.wants('brightness', agreed(device))
    if start is None:
        return 'its brightness is not known yet'
    target = min(max(round(start + step, 1), 0.0), 100.0) if step else start
    return _shine(device, target, '' if step else 'keep on')


def shine(device: Device, typed: str) -> Request | str:
    """Set a brightness, %."""
    target = shared.number(typed, '%', 0.0, 100.0)
    return target if isinstance(target, str) else _shine(device, target)


def _shine(device: Device, target: float, text: str = '') -> Request:
    text = text or f'brightness {target:g} %'
    if device.prefix:
        return Request(text, f'{device.prefix}cmd/brightness', Float32, Float32(data=target),
                       {'brightness': target})
    return _set(text, brightness=target)


def keep_on(device: Device, typed: str) -> Request | str:
    """Begin ``off_after_silence`` again, by a request that does not switch on a light."""
    return dim(device, typed, 0.0) if device.values.get('enabled') else 'it is not on'


def temperature(device: Device) -> float | None:
    """Return the temperature, None if its sensor failed: the last value remains."""
    failed = (device.values.get('error_flags') or 0) & THERMISTOR_FAILURE
    return None if failed else device.values.get('temperature')


def is_dangerous(device: Device) -> bool:
    """Return whether a light may be on that is lost, has a finding, or did not confirm an OFF."""
    return device.values.get('enabled') is True and (
        device.is_stale or device.off is not None and device.off[0] == shared.FAILED
        or any(device.level_of(one) for kind, one in device.diagnoses.items() if kind == 'lamp'))


def _notice(device: Device) -> str:
    seconds = device.number('lamp', 'off_in_s')
    if device.is_stale:
        return 'was ON' * bool(device.values.get('enabled'))
    return '' if seconds is None else f'off in {shared.age(seconds)} (o: keep on)'


def strobe(device: Device, typed: str) -> Request | str:
    """Let a light strobe with its last duty cycle, or end its strobe."""
    if device.prefix:
        return f'the source {device.source} cannot: a strobe is set by parameters'
    if device.wants('strobe_period', device.values.get('strobe_period')):
        return _set('no strobe', strobe_period=0.0)
    duty = round(device.values.get('strobe_duty_cycle') or STROBE_DUTY_CYCLE, 3)
    return _set(f'strobe {STROBE_PERIOD:g} s, {duty:g} %',
                f'let {device.name} strobe? Flashing light can cause seizures.',
                strobe_period=STROBE_PERIOD, strobe_duty_cycle=duty)


def _set_typed(device: Device, typed: str, name: str, unit: str, highest: float) -> Request | str:
    """Set a parameter that is a number."""
    value = shared.number(typed, unit, 0.0, highest)
    if isinstance(value, str):
        return value
    return f'the source {device.source} cannot: {name} is a parameter' if device.prefix else (
        _set(f'{name} {value:g} {unit}', '', **{name: value}))


def _enable(device: Device, typed: str) -> Request | str:
    return (switch(device, on=typed == 'true') if typed in ('true', 'false') else
            shared.WrongText(f'{typed!r} is neither true nor false'))


def _shows(device: Device, name: str, value: float) -> bool:
    known = agreed(device)
    return known is not None and abs(known - value) < 0.5


def _set(text: str, question: str = '', **values: float) -> Request:
    parameters = [Parameter(name, value=value).to_parameter_msg()
                  for name, value in values.items()]
    return Request(text, 'set_parameters_atomically', SetParametersAtomically,
                   SetParametersAtomically.Request(parameters=parameters), values, question)


def _strobe(device: Device) -> str:
    period, duty = device.values.get('strobe_period'), device.values.get('strobe_duty_cycle')
    if not period:
        return UNKNOWN if period is None else 'steady'
    return f'{period:.3g} s' + (f' {duty:.3g} %' if duty else '')


def _details(device: Device) -> Iterable[shared.DetailLine]:
    values, lamp = device.values, functools.partial(device.diagnosed, 'lamp')
    shines, limit, uptime = values.get('brightness'), agreed(device), values.get('uptime')
    serial = lamp('serial_number')
    facts = (
        measured(shines, '%') + ('' if limit == shines else f' (agreed: {limit:g} %)'),
        _strobe(device), values.get('mode'), f'{lamp("vendor")} {lamp("model")}'.strip(),
        serial and f'no. {serial}', uptime and f'up {shared.age(uptime)}')
    yield 'light', [', '.join(filter(None, facts))]
    now = temperature(device)
    if now is not None and (known := [value for value in device.trend if value is not None]):
        yield 'temp', [f'{now:.1f} C, {min(known):.1f} to {max(known):.1f} in 2 min']


VIEW = shared.View(
    'light', {
        'connected': Topic(Bool), 'enabled': Topic(Bool), 'brightness': Topic(Float32),
        'error_flags': Topic(UInt32), 'mode': Topic(String), 'strobe_period': Topic(Float32),
        'strobe_duty_cycle': Topic(Float32), 'uptime': Topic(Float64), 'source': Topic(String),
        'temperature': Topic(Temperature, lambda message: message.temperature, is_state=False)},
    ('error_flags', 'brightness', 'enabled', 'connected'),
    lambda device: (
        measured(device.values.get('brightness'), '%'),
        measured(temperature(device), 'C', '.1f'), _strobe(device),
        device.values.get('mode', UNKNOWN).partition('_')[0]),
    _details,
    (Key(('space',), 'on/off', switch), Key(('0',), 'off', switch_off),
     Key(('+', '=', 'right'), 'brighter 10 %', functools.partial(dim, step=STEP)),
     Key(('-', '_', 'left'), 'darker 10 %', functools.partial(dim, step=-STEP)),
     Key(('.', '>'), 'brighter 1 %', functools.partial(dim, step=FINE_STEP), has_button=False),
     Key(('comma', '<'), 'darker 1 %', functools.partial(dim, step=-FINE_STEP), has_button=False),
     Key(('i',), 'brightness', shine, 'brightness, %'),
     Key(('o',), 'keep on', keep_on), Key(('s',), 'strobe', strobe),
     shared.trigger_key('r', 'refresh', 'refresh'), shared.RELEASE_SOURCE),
    states={'ON': 'bold green', 'off': ''},
    state=lambda device: {True: 'ON', False: 'off', None: shared.NOT_KNOWN}[
        device.values.get('enabled')],
    trend=temperature, is_dangerous=is_dangerous, notice=_notice, off=switch_off,
    settings={
        'brightness': shine,
        'strobe_duty_cycle': functools.partial(
            _set_typed, name='strobe_duty_cycle', unit='%', highest=100.0),
        'strobe_period': functools.partial(
            _set_typed, name='strobe_period', unit='s', highest=math.inf),
        'enable': _enable, **shared.trigger_settings('refresh'),
        'release': shared.if_true(shared.release_source)},
    shows=_shows)
