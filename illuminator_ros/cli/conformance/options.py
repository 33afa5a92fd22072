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

from ..options import add_signing, address, integer, number, Parser
from ..payloads import PAYLOADS
from ... import __version__
from ...mavlink.messages import Address
from ...payload.checks.payload_checks import PayloadChecks

FIND_TIMEOUT = 10.0
DEFAULT_PAYLOAD = 'illuminator'

DESCRIPTION = """\
Checks whether a {device} follows its MAVLink protocol, and the heartbeat and command protocols
that it builds on."""
EPILOG = """\
examples:
  conformance serial:///dev/ttyACM0:57600
  conformance udpin://0.0.0.0:14550 --target 1/243 --junit report.xml
  conformance udpin://127.0.0.1:14590 --yes   the simulator, started without arguments
  conformance udp://:14541@127.0.0.1:14540    the emulator of the MAVLink guide

The checks switch and configure the {device}; afterwards its state is restored.
exit status: 0 if all that was checked is met, 1 if not or if there is no {device},
2 if an argument is wrong or this computer cannot open the link."""


def _address(text: str) -> Address:
    try:
        return address(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def _checks(args: Sequence[str] | None) -> tuple[Parser, PayloadChecks[Any]]:
    """Return a parser of ``--payload``, and the checks of the payload."""
    payload = Parser(prog='conformance', add_help=False)
    payload.add_argument(
        '--payload', default=DEFAULT_PAYLOAD, help='the kind of device (default: %(default)s)',
        choices=[one.name for one in PAYLOADS.values() if one.checks])
    found, _ = payload.parse_known_args(args)
    checks: PayloadChecks[Any] = PAYLOADS[found.payload].load('checks')
    return payload, checks


def parse(args: Sequence[str] | None) -> tuple[argparse.Namespace, PayloadChecks[Any]]:
    """
    Return the options, and the checks of the payload that they name.

    :param args: the command line without the program's name; None takes that of the process.
    :raises SystemExit: if an argument is wrong, with status 2.
    """
    payload, checks = _checks(args)
    device = checks.device
    result = Parser(
        prog='conformance', formatter_class=argparse.RawDescriptionHelpFormatter,
        parents=[payload], description=DESCRIPTION.format(device=device),
        epilog=EPILOG.format(device=device))
    result.add_argument('url', nargs='?', help='connection URL: UDP, TCP or serial')
    result.add_argument('--version', action='version', version=__version__)
    result.add_argument('--list', action='store_true', help='list the requirements and exit')
    result.add_argument('--yes', action='store_true', help=(
        f'let the {device} {checks.risk}, without asking').replace('%', '%%'))
    result.add_argument('--target', type=_address, metavar='SYS/COMP',
                        help=f'address of the {device} (default: the first that is heard)')
    result.add_argument('--only', action='append', default=[], metavar='NAME',
                        choices=[one.name for one in checks.requirements],
                        help='check this requirement only; may be repeated')
    for one in checks.options:
        result.add_argument(f'--{one.name}', type=number(one.low, one.high), default=one.default,
                            metavar=one.metavar, help=f'{one.help} (default: %(default)g)')
    result.add_argument('--wait', type=number(0.1, 3600), default=FIND_TIMEOUT, metavar='S',
                        help=f'how long to wait for the {device} (default: %(default)g)')
    result.add_argument('--system-id', type=integer(1, 255), default=255, metavar='ID',
                        help='our MAVLink system ID (default: 255)')
    result.add_argument('--component-id', type=integer(1, 255), default=190, metavar='ID',
                        help='our component ID (default: 190)')
    result.add_argument('--junit', metavar='FILE', help='also write a JUnit report')
    result.add_argument('--json', metavar='FILE',
                        help='also write a JSON report with all messages')
    result.add_argument('-v', '--verbose', action='store_true',
                        help='show the messages for requirements that are met, too')
    add_signing(result)
    options = result.parse_args(args)
    if options.url is None and not options.list:
        result.error('the connection URL is missing')
    for path in filter(None, (options.junit, options.json)):
        if not Path(path).absolute().parent.is_dir():
            result.error(f'{path}: there is no such directory')
    return options, checks
