# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The command line of ``simulator``."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Mapping

from .components import SettingError, Types
from .console import describe_commands
from ..arguments import invocation, option, Parser
from ..options import add_mavlink_version, add_signing
from ..payloads import DEFAULT_PAYLOAD, PAYLOADS
from ...payload.payload_type import PayloadType
from ...simulation.settings import integer


def payload_types(args: Iterable[str] | None, payloads: Mapping[str, PayloadType]) -> Types:
    """Return the simulated sides that ``--payload`` names; the other options depend on them."""
    names = Parser('simulator', is_complete=False)
    names.add_argument('--payload', default=DEFAULT_PAYLOAD)
    listed = names.parse_known_args(None if args is None else list(args))[0].payload.split(',')
    for name in listed:
        if name not in payloads:
            raise SettingError(f'--payload {name}: it is not one of {", ".join(payloads)}')
    return [payloads[name].load('simulated') for name in dict.fromkeys(listed)]


def _epilog(types: Types) -> str:
    profiles = '\n'.join(f'  {name:10} {profile.description}' for one in types
                         for name, profile in one.profiles.items())
    paragraphs = [
        *([f'profiles:\n{profiles}'] if profiles else []),
        *(one.notes for one in types if one.notes),
        *(f'faults of a {one.noun}, for --fault, the file and the console; several are separated '
          f'by commas:\n{one.device.faults.describe()}' for one in types)]
    command = invocation('simulator')
    examples = '\n'.join(f'  {command} {line}'.rstrip()
                         for one in types for line in one.examples)
    details = '\n\n'.join([*([f'examples:\n{examples}'] if examples else []), *paragraphs])
    return f"""\
{details}

console: lines on standard input, for all components or, after its id or name, for one
{describe_commands(one.device for one in types)}

exit status: 0 after a signal (SIGINT, SIGTERM ...) or quit, 1 if a package is missing, 2 if an
argument is wrong."""


def parser(
    types: Types | None = None, payloads: Mapping[str, PayloadType] = PAYLOADS,
) -> argparse.ArgumentParser:
    """Return the parser of the command line for some payloads, by default the default one."""
    types = types or payload_types([], payloads)
    plurals, nouns = ([getattr(one, name) for one in types] for name in ('plural', 'noun'))
    default = types[0].address({})
    profile = "the profile's, mostly " if types[0].profiles else ''
    result = Parser(
        'simulator',
        f'MAVLink {" and ".join(plurals)} without hardware.\n'
        'Without a URL it finds the node that was started without one.',
        _epilog(types))
    result.add_argument('url', nargs='?',
                        help='the link to a bridge, router or autopilot: UDP, TCP or serial '
                             f'(default: {types[0].url})')
    result.add_argument('--payload', metavar='NAME,...',
                        help=f'what is simulated: {", ".join(payloads)}; with --help, their '
                             f'options and faults (default: {DEFAULT_PAYLOAD})')
    result.add_argument('--file', metavar='FILE',
                        help=f'read url, settings and {", ".join(plurals)} from YAML')
    result.add_argument('--count', type=option(integer(1, 200)), metavar='N',
                        help=f'number of {", ".join(plurals)}, with component ids counted up '
                             '(default: 1)')
    result.add_argument('--system-id', type=option(integer(1, 255)), metavar='ID',
                        help=f'MAVLink system id (default: {profile}{default.system})')
    result.add_argument('--component-id', type=option(integer(0, 255)), metavar='ID',
                        help=f'component id of the first {" or ".join(nouns)} (default: '
                             f'{profile}{default.component})')
    for noun in nouns:
        result.add_argument(f'--{noun}', action='append', metavar='SYS/COMP[=NAME]',
                            help=f'a {noun}, instead of --count; may be repeated')
    for name, setting in {name: setting for one in types
                          for name, setting in one.all_settings.items()}.items():
        result.add_argument(f'--{name.replace("_", "-")}', metavar=setting.metavar,
                            action='append' if name == 'fault' else 'store', help=setting.help)
    for records in filter(None, (one.records for one in types)):
        result.add_argument(f'--{records.option}', metavar='FILE', help=records.help)
    result.add_argument('--plain', action='store_true',
                        help='plain lines on a terminal, too, instead of the live view')
    add_mavlink_version(result)
    add_signing(result)
    return result
