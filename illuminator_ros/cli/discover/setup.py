# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``discover --setup``: a parameter file and a systemd unit for a device that was heard."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import contextlib
import getpass
import os
from pathlib import Path
from queue import Empty, SimpleQueue
import re
import shlex
import signal
import sys
import threading
from typing import Any, TypeVar

from .report import executable, payloads_for, program
from ..entry_point import Refusal
from ..payloads import OWN_PAYLOADS
from ...illuminator.client import IlluminatorClient
from ...illuminator.model import SafetyLimits
from ...illuminator.settings import LightSettings
from ...mavlink.command_sender import CommandSender
from ...mavlink.component import Component
from ...mavlink.link import Link
from ...mavlink.messages import Address
from ...mavlink.search.component_kinds import AUTOPILOT
from ...mavlink.url import parse_url
from ...payload.device_events import DeviceConnected
from ...payload.requests import Result
from ...simulation.settings import number

T = TypeVar('T')

# %, and s, of the light that is tried; s to wait for it and for each answer.
BRIGHTNESS, ON_TIME, LIMIT = 5.0, 1.0, 8.0
FINAL = 'switch_off_finally'
SIGNALS = signal.SIGINT, signal.SIGTERM, signal.SIGHUP
# The part of the environment in which ROS is sourced, for the unit.
VARIABLES = ('AMENT_PREFIX_PATH', 'LD_LIBRARY_PATH', 'PYTHONPATH', 'RMW_IMPLEMENTATION',
             'ROS_AUTOMATIC_DISCOVERY_RANGE', 'ROS_DOMAIN_ID')


def matching(pattern: str, meaning: str) -> Callable[[str], str]:
    """Return a reader of texts that match a pattern."""
    def read(text: str) -> str:
        if re.fullmatch(pattern, text):
            return text
        raise ValueError(f'{text!r} is not {meaning}')
    return read


def yes(text: str) -> bool:
    """Read yes or no."""
    return matching('y|yes|n|no', 'yes or no')(text.lower()).startswith('y')


# The parameter of a light, the question, the default, and the reader.
PARAMETERS: tuple[tuple[str, str, str, Callable[[str], object]], ...] = (
    ('max_brightness', 'limit of the brightness, %', '100', number(0, 100)),
    ('off_on_shutdown', 'off when the node ends', 'yes', yes),
    ('off_after_silence', 'off after so many s without a request, 0 for never', '0',
     number(0, 86400)))
KEYS = {'device', 'name', 'try', 'folder', 'boot', 'overwrite', *(one[0] for one in PARAMETERS)}


def set_up(reports: Sequence[Mapping[str, Any]], given: Sequence[str]) -> int:
    """
    Ask what is not answered, write the files, and return the exit status.

    :param reports: see :func:`.report.report`.
    :param given: answers, each as KEY=VALUE.
    :raises Refusal: if an answer is missing or wrong.
    """
    answers = {key: value for key, _, value in (text.partition('=') for text in given)}
    if unknown := answers.keys() - KEYS:
        raise Refusal(f'--answer {unknown.pop()!r} is not one of {", ".join(sorted(KEYS))}')

    def ask(key: str, question: str, default: str, reader: Callable[[str], T]) -> T:
        while True:
            try:
                text = answers[key] if key in answers else input(f'{question} [{default}]: ')
                return reader(text.strip() or default)
            except ValueError as error:
                if key in answers:
                    raise Refusal(f'--answer {key}: {error}') from None
                print(error)
            except EOFError:
                raise Refusal(f'no answer: give --answer {key}=VALUE') from None

    found = [(one, device) for one in reports for device in one['components']
             if device['served']]
    for index, (one, device) in enumerate(found, 1):
        print(f'{index}: {device["address"]} ({", ".join(device["kinds"])}) on {one["url"]}')
    if not found:
        return 1
    report, device = found[int(ask('device', 'which device', '1', number(1, len(found)))) - 1]
    address = Address(*map(int, device['address'].split('/')))
    # An autopilot manages a gimbal.
    others = {kind for one in report['components'] for kind in one['kinds']} & {AUTOPILOT}
    payload, url = payloads_for({*device['kinds'], *others})[0][0], report['url']
    name = ask('name', 'name of its node', payload, matching('[A-Za-z][A-Za-z0-9_]*', 'a name'))
    values: dict[str, object] = {'connection_url': url}
    if payload not in OWN_PAYLOADS:
        values['payloads'] = [payload]
    if payload == 'illuminator':
        values |= {'target_system': address.system, 'target_component': address.component}
        for key, question, default, reader in PARAMETERS:
            values[key] = ask(key, question, default, reader)
        if not device['signed'] and ask('try', (
                f'switch it on at {BRIGHTNESS:g} % for {ON_TIME:g} s; do not look into it'),
                'no', yes):
            print(try_light(url, address))
    folder = ask('folder', 'folder of the files', '.', Path).absolute()
    path, unit = folder / f'{name}.yaml', folder / f'illuminator-{name}.service'
    arguments = shlex.join(
        ['--ros-args', '-r', f'__node:={name}', '--params-file', str(path)])
    files = {path: f'{name}:\n  ros__parameters:\n' + ''.join(
        f'    {key}: {str(value).lower() if isinstance(value, bool) else value}\n'
        for key, value in values.items())}
    if ask('boot', f'start it at boot: write {unit}, too', 'no', yes):
        files[unit] = Path(__file__).with_name('unit.service').read_text().format(
            name=name, executable=program(payload),
            user=getpass.getuser(), folder=Path(__file__).parents[3], python=sys.executable,
            arguments=arguments, environment='\n'.join(
                f'Environment="{key}={os.environ[key]}"'.replace('%', '%%')
                for key in VARIABLES if os.environ.get(key)))
    old = ' and '.join(str(one) for one in files if one.exists())
    if old and not ask('overwrite', f'overwrite {old}', 'no', yes):
        print('nothing is written')
        return 1
    for path, text in files.items():
        path.write_text(text)
        print(f'written: {path}')
    print(f'run: {executable([payload])} {arguments}')
    if unit in files:
        print(f'run: sudo cp {shlex.quote(str(unit))} /etc/systemd/system/ && '
              f'sudo systemctl daemon-reload && sudo systemctl enable --now {unit.stem}')
    return 0


def try_light(url: str, address: Address) -> str:
    """Switch a light on for a moment, and off in any case; return the outcome, for people."""
    commands = CommandSender(Address(1, 193), 0.25, 3)
    client = IlluminatorClient(
        commands, LightSettings(limits=SafetyLimits(BRIGHTNESS)), wanted=address.__eq__)
    link = Link(parse_url(url), Component(commands, [client]), label=url)
    connected, stopped = threading.Event(), threading.Event()
    client.events.subscribe(
        lambda event: connected.set() if isinstance(event, DeviceConnected) else None)

    def ask(method: str, *arguments: object) -> Result:
        results: SimpleQueue[Result] = SimpleQueue()
        link.call(lambda now: getattr(client.lights[address], method)(
            *arguments, now, lambda result, now: results.put(result)))
        result = Result(False, 'no answer in time')
        with contextlib.suppress(Empty):
            result = results.get(timeout=LIMIT)
            # It reports each try.
            while method == FINAL and not (result.success or result.permanent):
                result = results.get(timeout=LIMIT)
        return result

    # A signal must not prevent the OFF.
    before = [signal.signal(one, lambda *_: stopped.set()) for one in SIGNALS]
    link.start()
    try:
        if not connected.wait(LIMIT):
            return 'not tried: the light does not answer'
        result = ask('configure', {'brightness': BRIGHTNESS})
        if result.success and not stopped.is_set():
            result = ask('enable', True)
            stopped.wait(ON_TIME)
        off = ask(FINAL)
        return f'{result.message}; ' + (
            'off again' if off.success else f'IT MAY STILL BE ON: {off.message}')
    finally:
        link.stop()
        for one, handler in zip(SIGNALS, before, strict=True):
            signal.signal(one, handler)
