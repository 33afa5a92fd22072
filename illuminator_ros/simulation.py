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

"""MAVLink illuminators without hardware, as the command line asks for them."""

from __future__ import annotations

import argparse
import logging
import sys
import threading
from typing import Any, NoReturn

from . import __version__
from .illuminator.device import DeviceProperties, Devices
from .illuminator.model import Identity, InvalidValue, Limits
from .illuminator.thermal import ThermalProperties
from .mavlink.dialect import MAV_COMP_ID_ILLUMINATOR, Source
from .mavlink.link import Link, LinkEvent
from .mavlink.signing import Signing, SigningMode
from .mavlink.signing_files import KeyFileError, load_key, TimestampStore
from .mavlink.url import parse_url, UrlError
from .termination import Termination

DEFAULT_URL = 'udpout://127.0.0.1:14590'


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        """Say in one line what is wrong; the usage would bury it."""
        self.exit(2, f'{self.prog}: {message}; see {self.prog} --help\n')


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    result = _Parser(
        prog='simulator', formatter_class=argparse.RawDescriptionHelpFormatter,
        description='One or more MAVLink illuminators without hardware.\n'
                    'Without arguments it finds a bridge that was started without arguments.',
        epilog='examples:\n'
               '  simulator\n'
               '  simulator udpin://127.0.0.1:14550 --count 3\n'
               '  simulator --ambient 60 --time-scale 60      gets hot in seconds\n\n'
               'exit status: 0 after SIGINT or SIGTERM, 2 if an argument is wrong.')
    result.add_argument('url', nargs='?', default=DEFAULT_URL,
                        help='where the drone is (default: %(default)s)')
    result.add_argument('--version', action='version', version=__version__)
    result.add_argument('--count', type=_integer(1, 200), default=1, metavar='N',
                        help='number of lights, with component ids counted up (default: 1)')
    result.add_argument('--system-id', type=_integer(1, 255), default=1, metavar='ID',
                        help='MAVLink system id (default: 1)')
    result.add_argument('--component-id', type=_integer(1, 255),
                        default=MAV_COMP_ID_ILLUMINATOR, metavar='ID',
                        help='component id of the first light (default: %(default)s)')
    result.add_argument('--status-interval', type=_number(0, 3600), default=1.0, metavar='S',
                        help='time between statuses; 0 sends them only on request (default: 1)')
    result.add_argument('--min-strobe-period', type=_number(0, 3600), default=0.05, metavar='S',
                        help='shortest strobe period (default: 0.05)')
    result.add_argument('--max-strobe-period', type=_number(0, 3600), default=10.0, metavar='S',
                        help='longest strobe period (default: 10)')
    result.add_argument('--ambient', type=_number(-60, 150), default=25.0, metavar='DEG_C',
                        help='ambient temperature (default: 25)')
    result.add_argument('--time-scale', type=_number(0.001, 10000), default=1.0, metavar='X',
                        help='how much faster than real the light gets hot (default: 1)')
    result.add_argument('--vendor', default='illuminator_ros', help='vendor name')
    result.add_argument('--model', default='simulator', help='model name')
    result.add_argument('--signing-mode', choices=[mode.value for mode in SigningMode],
                        default='off', help='MAVLink 2 message signing (default: off)')
    result.add_argument('--signing-key-file', default='', metavar='PATH',
                        help='signing key: 32 bytes, 64 hex digits or a passphrase')
    return result


def _number(low: float, high: float) -> Any:
    def number(text: str) -> float:
        value = float(text)
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f'{text} is outside {low:g} to {high:g}')
        return value
    return number


def _integer(low: int, high: int) -> Any:
    def integer(text: str) -> int:
        value = int(text)
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f'{text} is outside {low} to {high}')
        return value
    return integer


def devices(options: argparse.Namespace) -> list[DeviceProperties]:
    """
    Return the lights that the options describe.

    :raises InvalidValue: if they do not go together.
    """
    last = options.component_id + options.count - 1
    if last > 255:
        raise InvalidValue(f'--count {options.count} from --component-id {options.component_id} '
                           f'reaches {last}; component ids end at 255')
    limits = Limits(options.min_strobe_period, options.max_strobe_period)
    if limits.min_strobe_period > limits.max_strobe_period:
        raise InvalidValue('--min-strobe-period is above --max-strobe-period')
    return [DeviceProperties(
        source=Source(options.system_id, component),
        identity=Identity(options.vendor, options.model, __version__, '1.0.0',
                          f'SIM-{options.system_id}-{component}'),
        limits=limits, status_interval=options.status_interval,
        thermal=ThermalProperties(ambient=options.ambient), time_scale=options.time_scale,
    ) for component in range(options.component_id, last + 1)]


def _signing(options: argparse.Namespace) -> tuple[Signing, TimestampStore | None]:
    mode = SigningMode(options.signing_mode)
    if mode is SigningMode.OFF:
        return Signing(), None
    store = TimestampStore(options.signing_key_file,
                           f'simulator {options.system_id}/{options.component_id}')
    return Signing(mode, load_key(options.signing_key_file), timestamp=store.load()), store


def _show(event: LinkEvent) -> None:
    if event.is_open:
        _print(f'link open: {event.name}')
    else:
        _print(f'link not open: {event.name}: {event.reason}; trying again')


def _print(text: str) -> None:
    # Whoever reads it through a pipe wants to have it now.
    print(text, flush=True)


def run(args: list[str] | None, termination: Termination) -> int:
    """
    Run the simulator until SIGINT or SIGTERM, and return the exit status.

    :param args: the command line without the program's name; None takes the process's.
    """
    options = parser().parse_args(args)
    logging.basicConfig(format='%(message)s')
    try:
        url = parse_url(options.url)
        lights = devices(options)
        signing, store = _signing(options)
    except (UrlError, InvalidValue, KeyFileError, ValueError) as error:
        print(f'simulator: {error}', file=sys.stderr)
        return 2
    endpoint = Devices(lights, 0.0)
    link = Link(url, endpoint, label=options.url, on_event=_show, signing=signing, store=store)
    for device in endpoint.devices:
        device.restart(link.clock())
    _print(f'{len(lights)} light{"s"[:len(lights) > 1]}: '
           + ', '.join(str(light.source) for light in lights[:8])
           + (' ...' if len(lights) > 8 else ''))
    ended = threading.Event()
    termination.calls(ended.set)
    link.start()
    ended.wait()
    link.stop()
    return 0

