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
from collections.abc import Callable
import contextlib
import functools
import logging
import os
from pathlib import Path
import queue
import signal
import sys
from types import FrameType
from typing import Any

from ..options import add_signing, address, integer, number, Parser, signing
from ..program import discard_output
from ... import __version__
from ...illuminator.checks.bench import Bench
from ...illuminator.checks.report import as_json, as_junit, catalogue, Report, Table
from ...illuminator.checks.requirement import REQUIREMENTS
from ...illuminator.checks.suite import FIND_TIMEOUT, Suite
from ...illuminator.identity import Identity
from ...mavlink.link import Link
from ...mavlink.link_state import LinkEvent
from ...mavlink.messages import Address
from ...mavlink.signing_files import KeyFileError
from ...mavlink.url import parse_url, UrlError

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

_Texts = queue.SimpleQueue['str | None']

QUESTION = (
    'Some checks make the light strobe, and shine at 100 % for {heat:g} s. Strobing can trigger\n'
    'seizures, and nobody should look into the light. The rest is checked without them.\n'
    'May the light do that? [y/N] ')


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    result = Parser(
        prog='conformance', formatter_class=argparse.RawDescriptionHelpFormatter,
        description='Checks whether a light follows the MAVLink illuminator protocol, and the\n'
                    'heartbeat and command protocols that it builds on.',
        epilog='examples:\n'
               '  conformance serial:///dev/ttyACM0:57600\n'
               '  conformance udpin://0.0.0.0:14550 --target 1/243 --junit report.xml\n'
               '  conformance udpin://127.0.0.1:14590 --yes   the simulator, as it starts without '
               'arguments\n'
               "  conformance udp://:14541@127.0.0.1:14540    the guide's emulator\n"
               '\nThe light is switched and configured, and afterwards as it was before.\n'
               'exit status: 0 if nothing is wrong, 1 if something is or nothing could be '
               'checked,\n2 if an argument is wrong.')
    result.add_argument('url', nargs='?', help='where the light is: UDP, TCP or serial')
    result.add_argument('--version', action='version', version=__version__)
    result.add_argument('--list', action='store_true', help='list the requirements, and end')
    result.add_argument('--yes', action='store_true',
                        help='let the light strobe, and shine at 100 %%, without asking')
    result.add_argument('--target', type=_address, metavar='SYS/COMP',
                        help='the light (default: the first that is heard)')
    result.add_argument('--only', action='append', default=[], metavar='NAME',
                        choices=[one.name for one in REQUIREMENTS],
                        help='check this requirement only; may be repeated')
    result.add_argument('--heat', type=number(0, 36000), default=5.0, metavar='S',
                        help='how long it shines at 100 %% to get hot, and then cools down '
                             '(default: 5)')
    result.add_argument('--wait', type=number(0.1, 3600), default=FIND_TIMEOUT, metavar='S',
                        help='how long to wait for the light (default: %(default)g)')
    result.add_argument('--system-id', type=integer(1, 255), default=255, metavar='ID',
                        help='our MAVLink system id (default: 255)')
    result.add_argument('--component-id', type=integer(1, 255), default=190, metavar='ID',
                        help='our component id (default: 190)')
    result.add_argument('--junit', metavar='FILE', help='write a JUnit report too')
    result.add_argument('--json', metavar='FILE', help='write a report with all that was said')
    result.add_argument('-v', '--verbose', action='store_true',
                        help='show what was said for requirements that are met, too')
    add_signing(result)
    return result


def _address(text: str) -> Address:
    try:
        return address(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def _consent(options: argparse.Namespace) -> bool:
    """Ask whether the light may dazzle; nobody there to answer means no."""
    if options.yes:
        return True
    if options.only and not any(one.dazzles for one in REQUIREMENTS if one.name in options.only):
        return False
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        return False
    try:
        answer = input(QUESTION.format(heat=options.heat)).strip()
    except EOFError:
        return False
    if answer.lower() not in ('y', 'yes', '', 'n', 'no'):
        _print(f'{answer!r} is neither y nor n: taken as no')
    return answer.lower() in ('y', 'yes')


class _Signals:
    """
    SIGINT, SIGTERM and, but for nohup, SIGHUP end a run in order.

    A second one ends it at once, but for SIGHUP: of a terminal that goes, kernel and shell tell.
    """

    def __init__(self, interrupt: Callable[[], None]) -> None:
        self._interrupt = interrupt
        self._count = 0
        for one in SIGNALS:
            if signal.getsignal(one) != signal.SIG_IGN:
                signal.signal(one, self._handle)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        if self._count and number == signal.SIGHUP:
            return
        self._count += 1
        if self._count > 1:
            _complain('ended; the light is not as it was')
            os._exit(1)
        _complain('bringing the light back to where it was; once more to end without')
        self._interrupt()


def _complain(text: str) -> None:
    # Not through sys.stderr, which a signal may interrupt; and the terminal may be gone.
    with contextlib.suppress(OSError):
        os.write(2, f'conformance: {text}\n'.encode())


def _print(*texts: str) -> bool:
    """Print; say so once if that fails, and go on: the light is to be brought back."""
    try:
        # Whoever reads it through a pipe wants to have it now; who does not, does not.
        print(*texts, sep='\n', flush=True)
    except BrokenPipeError:
        pass
    except OSError as error:
        _complain(f'standard output: {error.strerror}')
        discard_output()
        return False
    return True


def _put(texts: _Texts, lines: list[str]) -> None:
    if lines:
        texts.put('\n'.join(lines))


def _link_fault(link: Link) -> str:
    state = link.state()
    return '' if state.is_open else f'{state.name}: {state.reason}'


def _show(texts: _Texts, event: LinkEvent) -> None:
    if not event.is_open:
        texts.put(str(event))


def _write(path: str | None, text: str) -> bool:
    """Write a report; say so if it cannot be."""
    if path is None:
        return True
    try:
        Path(path).write_text(text)
    except OSError as error:
        print(f'conformance: {path}: {error.strerror}', file=sys.stderr)
        return False
    return True


def run(args: list[str] | None = None) -> int:
    """
    Check a light, and return the exit status.

    :param args: the command line without the program's name; None takes the process's.
    """
    parsing = parser()
    options = parsing.parse_args(args)
    logging.basicConfig(format='%(message)s')
    if options.list:
        return 0 if _print(*catalogue()) else 1
    if options.url is None:
        parsing.error('the connection URL is missing')
    for path in filter(None, (options.junit, options.json)):
        if not Path(path).absolute().parent.is_dir():
            parsing.error(f'{path}: there is no such directory')
    identity = Address(options.system_id, options.component_id)
    try:
        url = parse_url(options.url)
        signs, store = signing(options, f'conformance {identity}')
    except (UrlError, KeyFileError, ValueError) as error:
        print(f'conformance: {error}', file=sys.stderr)
        return 2
    consent = _consent(options)
    bench = Bench(identity, target=options.target, consent=consent, heat=options.heat,
                  checksum_errors=lambda: link.state().decoding.crc_errors,
                  link_fault=lambda: _link_fault(link))
    # Whoever does not read what is written must not hold up the link, which has times to keep.
    texts: _Texts = queue.SimpleQueue()
    link = Link(url, bench, label=options.url, on_event=functools.partial(_show, texts),
                signing=signs, store=store)
    table = Table(verbose=options.verbose)
    suite = Suite(bench, only=options.only, find_timeout=options.wait,
                  on_result=lambda result: _put(texts, table.add(result)))
    return _conduct(options, link, bench, suite, table, texts)


def _conduct(
    options: argparse.Namespace, link: Link, bench: Bench, suite: Suite, table: Table,
    texts: _Texts,
) -> int:
    def look(now: float) -> None:
        if not bench.running:
            _put(texts, table.end())
            texts.put(None)

    _Signals(lambda: link.call(bench.interrupt))
    begun = link.clock()
    link.start()
    written = [_print(f'checking the light on {options.url} ...')]
    while True:
        link.call(look)
        try:
            text = texts.get(timeout=0.1)
        except queue.Empty:
            continue
        if text is None:
            break
        written.append(_print(text))
    link.stop()
    report = Report(options.url, _light(bench, suite), tuple(suite.results), suite.restored,
                    link.clock() - begun, suite.passed)
    written += [_print('', report.light, report.summary),
                _write(options.junit, as_junit(report)), _write(options.json, as_json(report))]
    return 0 if suite.passed and all(written) else 1


def _light(bench: Bench, suite: Suite) -> str:
    if bench.found is None:
        return f'no light: {suite.missing}' if suite.missing else 'no light'
    identity: Any = Identity.from_message(bench.informations[-1]) if bench.informations else None
    names = [] if identity is None else [identity.vendor, identity.model, identity.serial_number]
    told = ', '.join(filter(None, names))
    return f'light {bench.found}' + (f': {told}' if told else '')
