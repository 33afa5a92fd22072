# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The report on one port: what was heard on it, and the commands for it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import shlex
from typing import Any

from ..arguments import invocation
from ..payloads import devices, OWN_PAYLOADS, PAYLOADS
from ...mavlink.search.component_kinds import AUTOPILOT
from ...mavlink.search.listener import Listener, NOT_ASKED
from ...mavlink.url import SerialUrl

CAMERA = ['rededge']
# The kinds of devices, with the payloads that serve them.
SERVED = {one.device.name: name for name, one in PAYLOADS.items() if one.device}
NOT_SERVED = ('none of these is a light, a gimbal or a MicaSense camera; an autopilot or router '
              'may forward their frames only to a program that sends, unlike this one')
ONLY_VERSION_1 = ('only MAVLink 1 is heard, which cannot carry the messages of a light or a '
                  'gimbal: set the device, or the router, to MAVLink 2 (ArduPilot: '
                  'SERIALn_PROTOCOL 2). Some devices change to it once a program sends it')


def report(port: Listener) -> dict[str, Any]:
    """Return what was heard, and the commands, for ``--json``."""
    known, elapsed = port.kinds(devices(PAYLOADS)), max(port.elapsed, 1e-3)
    components = [
        {'address': str(address), 'kinds': known[address],
         'mavlink_versions': sorted(one.versions), 'signed': one.signed,
         'frames_per_s': round(one.frames / elapsed, 1),
         'served': any(one in SERVED for one in known[address])}
        for address, one in sorted(port.components.items())]
    payloads = payloads_for({kind for one in known.values() for kind in one})
    only_version_1 = all(one.versions == {1} for one in port.components.values())
    unsure = [names for names in payloads if only_version_1 and names != CAMERA]
    signed = any(one['served'] and one['signed'] for one in components)
    trouble = port.trouble or (
        port.silence() if not components else ONLY_VERSION_1 if unsure else
        '' if payloads else NOT_SERVED)
    return {
        'port': port.label,
        'url': url_of(port) if components else '',
        'trouble': trouble,
        'components': components,
        'run': [_command(port, names, signed) for names in payloads if names not in unsure],
        'try': [_command(port, names, signed) for names in (
            [['illuminator', 'gimbal']] if trouble in (NOT_SERVED, NOT_ASKED) else unsure)],
    }


def url_of(port: Listener) -> str:
    """Return the URL of a port for the nodes."""
    if isinstance(port.url, SerialUrl):
        return str(port.tuned_url)
    if port.is_loopback:
        # As the default URL of the bridge, it hears this machine only.
        return port.label.replace('udpin://0.0.0.0:', 'udpin://127.0.0.1:')
    return port.label


def executable(payloads: list[str]) -> str:
    """Return the command that serves payloads, in the form in which this program was run."""
    return invocation('discover').removesuffix('discover') + program(payloads[0])


def program(payload: str) -> str:
    """Return the executable whose first payload is the given one, or may be."""
    return 'bridge' if payload == 'illuminator' or payload not in OWN_PAYLOADS else payload


def _command(port: Listener, payloads: list[str], signed: bool) -> str:
    selects = len(payloads) > 1 or payloads[0] not in OWN_PAYLOADS
    parameters = [f'payloads:="[{", ".join(payloads)}]"'] if selects else []
    if signed:
        parameters += ['signing_mode:=sign', 'signing_key_file:=KEY_FILE']
    return ' '.join([
        executable(payloads), shlex.quote(url_of(port)),
        *(['--ros-args'] if parameters else []), *(f'-p {one}' for one in parameters)])


def payloads_for(found: set[str]) -> list[list[str]]:
    """Return the payloads that serve kinds, by process: only a camera needs MAVLink 1."""
    shared = [name for kind, name in SERVED.items() if kind in found]
    # An autopilot manages the gimbal that is beside it.
    if 'gimbal_manager' in shared and ('gimbal' in shared or AUTOPILOT in found):
        shared = [*dict.fromkeys(name.replace('gimbal_manager', 'gimbal') for name in shared)]
    alone = [name for name in CAMERA if name in shared]
    shared = [name for name in shared if name not in alone]
    return [one for one in (shared, alone) if one]


def lines(report: Mapping[str, Any]) -> Iterator[str]:
    """Return the lines on one port."""
    trouble = report['trouble']
    if not report['components']:
        yield f'{report["port"]}: {trouble}'
    else:
        yield report['url']
        for one in report['components']:
            version = f'MAVLink {" and ".join(map(str, one["mavlink_versions"]))}'
            yield (f'  {one["address"]:8} {", ".join(one["kinds"]) or "no HEARTBEAT":32} '
                   f'{version + (", signed" if one["signed"] else ""):18} '
                   f'{one["frames_per_s"]:7.1f} frames/s')
        if trouble:
            yield f'  {trouble}'
    yield from (f'  {verb}: {command}' for verb in ('run', 'try') for command in report[verb])
