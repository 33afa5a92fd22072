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

"""The command line of ``simulator``."""

from __future__ import annotations

import argparse

from .console import describe_commands
from .settings import read, SettingError, SETTINGS, THERMAL
from ..options import add_signing, integer, Parser
from ... import __version__
from ...illuminator.faults import FAULTS
from ...illuminator.simulated_properties import PROFILES

DEFAULT_URL = 'udpout://127.0.0.1:14590'


def _epilog() -> str:
    profiles = '\n'.join(f'  {name:10} {profile.description}'
                         for name, profile in PROFILES.items())
    thermal = ', '.join(f'{name}={value:g}' for name, value in THERMAL.items())
    return f"""\
examples:
  simulator
  simulator udpin://127.0.0.1:14550 --count 3
  simulator --light 1/243=bow --light 1/250=stern --fault stern:drop=0.2
  simulator --ambient 60 --time-scale 60      gets hot in seconds
  simulator --file lights.yaml                the same settings, for each light

profiles:
{profiles}

thermal, with defaults (degC, K and s; throttle_to is a share of the brightness):
  {thermal}

faults, for --fault, the file and the console; several are separated by commas:
{FAULTS.describe()}

console: lines on standard input, for all lights or, behind its id or name, for one
{describe_commands()}

exit status: 0 after a signal (SIGINT, SIGTERM, SIGHUP) or quit, 1 if a package is missing, 2 if an
argument is wrong."""


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    result = Parser(
        prog='simulator', formatter_class=argparse.RawDescriptionHelpFormatter,
        description='One or more MAVLink illuminators without hardware.\n'
                    'Without arguments it finds a bridge that was started without arguments.',
        epilog=_epilog())
    result.add_argument('url', nargs='?',
                        help='the link to a bridge, router or autopilot: UDP, TCP or serial '
                             f'(default: {DEFAULT_URL})')
    result.add_argument('--version', action='version', version=__version__)
    result.add_argument('--file', metavar='FILE', help='read url, settings and lights from YAML')
    result.add_argument('--count', type=integer(1, 200), metavar='N',
                        help='number of lights, with component ids counted up (default: 1)')
    result.add_argument('--system-id', type=integer(1, 255), metavar='ID',
                        help="MAVLink system id (default: the profile's, mostly 1)")
    result.add_argument('--component-id', type=integer(0, 255), metavar='ID',
                        help="component id of the first light (default: the profile's, mostly "
                             '243)')
    result.add_argument('--light', action='append', metavar='SYS/COMP[=NAME]',
                        help='a light, instead of --count; may be repeated')
    for name, setting in SETTINGS.items():
        option = f'--{name.replace("_", "-")}'
        if name == 'fault':
            result.add_argument(option, action='append', metavar=setting.metavar,
                                help=setting.help)
        else:
            result.add_argument(option, type=_Reader(name), metavar=setting.metavar,
                                help=setting.help)
    result.add_argument('--plain', action='store_true',
                        help='plain lines on a terminal, too, instead of the live view')
    add_signing(result)
    return result


class _Reader:
    """Reads a setting for argparse, whose own messages leave out the reason."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __call__(self, text: str) -> object:
        try:
            return read(self._name, text, text)
        except SettingError as error:
            raise argparse.ArgumentTypeError(str(error).partition(': ')[2]) from error
