# Copyright 2026 The illuminator_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""The command line of ``conformance``."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..options import add_mavlink_version, add_signing, address, integer, number, Parser
from ..payloads import PAYLOADS
from ... import __version__
from ...mavlink.messages import Address
from ...payload.checks.requirement import PayloadChecks

FIND_TIMEOUT = 10.0
DEFAULT_PAYLOAD = 'illuminator'

EPILOG = """\
examples:
  conformance serial:///dev/ttyACM0:57600
  conformance udpin://0.0.0.0:14550 --target 1/243 --junit report.xml
  conformance udpin://127.0.0.1:14590 --yes   the simulator, started without arguments
  conformance udp://:14541@127.0.0.1:14540    the emulator of the MAVLink guide

The checks change the state of the device; afterwards it is restored.
exit status: 0 if all checked requirements are met, 1 if not or if no device was found,
2 if an argument is wrong or this computer cannot open the link."""


def _address(text: str) -> Address:
    try:
        return address(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def parse(args: Sequence[str] | None) -> tuple[argparse.Namespace, PayloadChecks[Any]]:
    """
    Return the options, and the checks of the payload that they name.

    :param args: the command line without the program's name, by default from ``sys.argv``.
    :raises SystemExit: if an argument is wrong, with status 2.
    """
    payload = Parser(prog='conformance', add_help=False)
    payload.add_argument(
        '--payload', default=DEFAULT_PAYLOAD, help='the kind of device (default: %(default)s)',
        choices=[one.name for one in PAYLOADS.values() if one.checks])
    checks: PayloadChecks[Any] = PAYLOADS[payload.parse_known_args(args)[0].payload].load('checks')
    parser = Parser(
        prog='conformance', formatter_class=argparse.RawDescriptionHelpFormatter, epilog=EPILOG,
        description=f'Checks whether a {checks.device} follows its MAVLink protocols.',
        parents=[payload])
    add = parser.add_argument
    add('url', nargs='?', help='connection URL: UDP, TCP or serial')
    add('--version', action='version', version=__version__)
    add('--list', action='store_true', help='list the requirements and exit')
    add('--yes', action='store_true', help=f'allow it to {checks.risk}, without asking'.replace(
        '%', '%%'))
    add('--target', type=_address, metavar='SYS/COMP',
        help=f'address of the {checks.device} (default: the first that is heard)')
    add('--only', action='append', default=[], metavar='NAME',
        choices=[one.name for one in checks.requirements],
        help='check this requirement only; may be repeated')
    for one in checks.options:
        add(f'--{one.name}', type=number(one.low, one.high), default=one.default,
            metavar=one.metavar, help=f'{one.help} (default: %(default)g)')
    add('--wait', type=number(0.1, 3600), default=FIND_TIMEOUT, metavar='S',
        help=f'how long to wait for the {checks.device} (default: %(default)g)')
    for part, default in (('system', 255), ('component', 190)):
        add(f'--{part}-id', type=integer(1, 255), default=default, metavar='ID',
            help=f'our MAVLink {part} ID (default: %(default)s)')
    add('--junit', metavar='FILE', help='also write a JUnit report')
    add('--json', metavar='FILE', help='also write a JSON report with all messages')
    add('-v', '--verbose', action='store_true',
        help='show the messages for requirements that are met, too')
    add_mavlink_version(parser)
    add_signing(parser)
    options = parser.parse_args(args)
    if options.url is None and not options.list:
        parser.error('the connection URL is missing')
    for path in filter(None, (options.junit, options.json)):
        if not Path(path).absolute().parent.is_dir():
            parser.error(f'{path}: there is no such directory')
    return options, checks
