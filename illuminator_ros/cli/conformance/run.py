# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``conformance`` as a process: command line, link, question, output, signals and reports."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
import contextlib
import errno
import functools
import logging
import os
from pathlib import Path
import queue
import select
import signal
import sys
import time
from types import FrameType

from ..arguments import invocation, option, Parser
from ..entry_point import print_output
from ..options import add_mavlink_version, add_signing, address, mavlink_version, signing
from ..payloads import DEFAULT_PAYLOAD, devices, PAYLOADS
from ..termination import ENDING
from ...checks.components import names
from ...checks.coroutines import Main
from ...checks.report import as_json, as_junit, catalogue, lines, remedies, RunReport, unreached
from ...checks.requirements import AnyChecks, CheckResult, CheckVerdict
from ...checks.runner import absence, CheckRunner
from ...checks.session import Conditions, Session
from ...mavlink.errors import LinkThreadError
from ...mavlink.link import Link
from ...mavlink.link_state import LinkEvent, LinkSnapshot
from ...mavlink.messages import Address
from ...mavlink.signing import Signing
from ...mavlink.signing_files import TimestampStore
from ...mavlink.url import parse_url, Url
from ...payload.payload_type import PayloadType
from ...simulation.settings import integer, number

# s to listen before the first command.
LISTEN_TIME = 4.5
NOT_OPEN = 'link not open: '
# Errors of the peer that keep a link closed; any other error is of this computer.
PEER_ERRORS = (errno.ECONNREFUSED, errno.ECONNRESET, errno.ETIMEDOUT, errno.EHOSTUNREACH,
               errno.ENETUNREACH, errno.EPIPE)
FIND_TIMEOUT = 10.0
# s; the longest time until a signal is handled.
SIGNAL_DELAY = 0.2
# Signals of a fault of the process: a handler would return to the fault.
FAULTS = {signal.SIGSEGV, signal.SIGBUS, signal.SIGFPE, signal.SIGILL}

EXAMPLES = (
    'serial:///dev/ttyACM0:57600',
    'udpin://0.0.0.0:14550 --target 1/243 --junit report.xml',
    'udpin://127.0.0.1:14590 --yes   # the simulator, started without arguments',
    'udp://:14541@127.0.0.1:14540    # the emulator of the MAVLink guide',
    'udpin://0.0.0.0:14550 --payload gimbal_manager --target 1/1')
EPILOG = """\
examples:
{examples}

The checks change the state of the device; afterwards it is restored.
exit status: 0 if all checked requirements are met, 1 if not or if no device was found,
2 if an argument is wrong or this computer cannot open the link."""


def parse(
    args: Sequence[str] | None, payloads: Mapping[str, PayloadType] = PAYLOADS,
) -> tuple[argparse.Namespace, AnyChecks]:
    """
    Return the options, and the checks of the payload that they name.

    :param args: the command line without the program's name, by default from ``sys.argv``.
    :param payloads: the kinds of payloads that ``--payload`` may name.
    :raises SystemExit: if an argument is wrong, with status 2.
    """
    payload = Parser('conformance', is_complete=False)
    payload.add_argument(
        '--payload', default=DEFAULT_PAYLOAD,
        help='the kind of device; with --help, its options (default: %(default)s)',
        choices=[one.name for one in payloads.values() if one.checks])
    checks: AnyChecks = payloads[payload.parse_known_args(args)[0].payload].load('checks')
    command = invocation('conformance')
    parser = Parser(
        'conformance', f'Checks whether a {checks.device} follows its MAVLink protocols.',
        EPILOG.format(examples='\n'.join(f'  {command} {line}' for line in EXAMPLES)),
        parents=[payload])
    add = parser.add_argument
    add('url', nargs='?', help='connection URL: UDP, TCP or serial')
    add('--list', action='store_true', help='list the requirements and exit')
    add('--yes', action='store_true', help=f'allow it to {checks.risk}, without asking'.replace(
        '%', '%%'))
    add('--target', type=option(address), metavar='SYS/COMP',
        help=f'address of the {checks.device} (default: the first that is heard)')
    add('--only', action='append', default=[], metavar='NAME',
        choices=[one.name for one in checks.requirements],
        help='check this requirement only; may be repeated')
    add('--skip', action='append', default=[], metavar='NAME=REASON',
        help='do not check this requirement, such as a known deviation; the reason is in the '
             'report; may be repeated')
    for one in checks.options:
        add(f'--{one.name}', type=option(number(one.low, one.high)), default=one.default,
            metavar=one.metavar, help=f'{one.help} (default: %(default)g)')
    add('--wait', type=option(number(0.1, 3600)), metavar='S',
        help=f'how long to wait for the {checks.device}, and for a port that is missing or busy '
             f'(default: {FIND_TIMEOUT:g}, and 0 for a port)')
    for part, default in (('system', 255), ('component', 190)):
        add(f'--{part}-id', type=option(integer(1, 255)), default=default, metavar='ID',
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
    options.skip = dict(text.partition('=')[::2] for text in options.skip)
    for name, reason in options.skip.items():
        if not reason or name not in (one.name for one in checks.requirements):
            parser.error(f'--skip {name}: it needs the name of a requirement and a reason, as in '
                         f'--skip "{checks.requirements[0].name}=until firmware 2.1"')
    for path in (options.junit, options.json):
        # The checks take a minute, so refuse before them.
        if path is not None and (refusal := _report_refusal(os.path.abspath(path))):
            parser.error(f'{path}: {refusal}')
    return options, checks


def _report_refusal(path: str) -> str:
    """Return why a report cannot be written to a path, '' if no reason is visible."""
    directory = os.path.dirname(path)
    # Not methods of Path, which raise an error without permission to search a directory above.
    if not os.path.isdir(directory):
        return 'there is no such directory'
    if os.path.isdir(path):
        return 'it is a directory'
    return '' if os.access(path if os.path.exists(path) else directory, os.W_OK) else (
        'no permission to write it')


def run(
    args: Sequence[str] | None = None, payloads: Mapping[str, PayloadType] = PAYLOADS,
) -> int:
    """
    Check a device, and return the exit status.

    :param args: the command line without the program's name, by default from ``sys.argv``.
    :param payloads: the kinds of payloads that ``--payload`` may name.
    """
    options, checks = parse(args, payloads)
    logging.basicConfig(format='%(message)s')
    if options.list:
        return 0 if _print(*catalogue(checks.requirements, checks.device)) else 1
    address = Address(options.system_id, options.component_id)
    try:
        url = parse_url(options.url, known=devices(payloads))
        signs, store = signing(options, f'conformance {address}')
        conformance = Conformance(options, checks, address, url, signs, store)
    except ValueError as error:
        _complain(str(error))
        return 2
    try:
        return conformance.run()
    except LinkThreadError as error:
        _complain(f'{error}; nothing was checked')
        return 2


class Conformance:
    """One run against one device."""

    def __init__(
        self, options: argparse.Namespace, checks: AnyChecks, address: Address,
        url: Url, signs: Signing, store: TimestampStore | None,
    ) -> None:
        self._options = options
        self._checks = checks
        self._payload_options = {one.name: getattr(options, one.name) for one in checks.options}
        self._requirements = [one for one in checks.requirements
                              if not options.only or one.name in options.only]
        # The main thread writes them: a blocked terminal must not delay the link's thread. None
        # is the end of a coroutine.
        self._texts: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._session: Session = checks.session(Conditions(
            address, options.target, self._payload_options,
            lambda: self._link_state().decoding.crc_errors, time.time))
        self._link = Link(url, self._session, label=options.url, on_event=self._link_event,
                          signing=signs, store=store,
                          mavlink_version=mavlink_version(
                              options.mavlink_version, {checks.device: checks.mavlink_version}))
        self._runner = CheckRunner(checks, self._session, self._requirements, self._show,
                                   options.skip)
        self._signals = 0
        self._written = True
        # Written by the link's thread before the main thread reads them.
        self._is_finding = True
        self._missing = ''
        self._announcement: list[str] = []

    def run(self) -> int:
        """Find the device, ask for consent, check the device, and write the reports."""
        checks, options, runner = self._checks, self._options, self._runner
        for one in ENDING - FAULTS:
            if signal.getsignal(one) != signal.SIG_IGN:
                signal.signal(one, self._handle)
        begun = self._link.clock()
        self._link.start()
        self._write_line(f'checking the {checks.device} on {options.url} ...')
        self._finish(self._find())
        missing = self._missing
        if missing.startswith(NOT_OPEN) and not _is_peer_error(missing):
            self._link.stop()
            _complain(f'{missing}; nothing was checked')
            return 2
        self._write_line(*self._announcement)
        self._session.consent = bool(self._announcement) and self._consent()
        self._finish(runner.run(missing))
        self._link.stop()
        report = RunReport(
            checks.payload, checks.device, options.url, self._describe_device(),
            tuple(runner.results), runner.restored, self._link.clock() - begun, runner.passed)
        # A failed check has already given the reason why there is no device.
        explained = missing and any(one.verdict is CheckVerdict.FAIL for one in report.results)
        self._write_line(
            *unreached(report.results), '',
            *(() if missing else remedies(report.results, checks.device)),
            *(() if explained else (report.device,)), report.summary)
        for path, text in ((options.junit, as_junit(report)), (options.json, as_json(report))):
            try:
                if path is not None:
                    Path(path).write_text(text, encoding='utf-8')
            except OSError as error:
                _complain(f'{path}: {error.strerror}')
                self._written = False
        return 0 if runner.passed and self._written else 1

    def _write_line(self, *texts: str) -> None:
        # Reports in files do not need standard output.
        if texts and sys.stdout:
            self._written &= _print(*texts)

    def _finish(self, main: Main) -> None:
        """Run a coroutine of the session to its end, and print the texts that come meanwhile."""
        async def until_end() -> None:
            try:
                await main
            finally:
                self._texts.put(None)

        self._link.call(lambda now: self._session.runner.run(until_end()))
        while True:
            try:
                # A signal that comes just before the wait does not end it.
                text = self._texts.get(timeout=SIGNAL_DELAY)
            except queue.Empty:
                continue
            if text is None:
                return
            self._write_line(text)

    def _link_state(self) -> LinkSnapshot:
        # The checks run in the link's thread.
        return self._link.snapshot(self._link.clock())

    def _link_event(self, event: LinkEvent) -> None:
        if event.is_open:
            return
        if event.was_open or _is_peer_error(event.reason):
            self._texts.put(str(event))
        elif self._is_finding and self._options.wait is None:
            # A port of this computer is missing or busy: the run ends, and prints the reason.
            self._missing = f'{NOT_OPEN}{event.name}: {event.reason}'
            self._texts.put(None)
        elif self._is_finding:
            self._texts.put(str(event))

    def _show(self, result: CheckResult) -> None:
        if result.reached:
            self._texts.put('\n'.join(lines(result, verbose=self._options.verbose)))

    async def _find(self) -> None:
        """Find the device; record the other components on the link, or why it was not found."""
        session, checks = self._session, self._checks
        wait = self._options.wait or FIND_TIMEOUT
        await session.find(wait, LISTEN_TIME)
        self._is_finding = False
        state, components = self._link_state(), session.components
        if components.found is None:
            self._missing = (
                absence(session, checks, wait) if state.is_open
                else f'{NOT_OPEN}{state.name}: {state.reason}')
            return
        changed = any(one.changes for one in self._requirements)
        self._announcement = [f'found {checks.device} {components.found}, which ' + (
            f'the checks will change and then restore{checks.traces}' if changed else
            'stays unchanged')]
        if others := components.devices - {components.found}:
            self._announcement.append(
                f'not checked: {checks.device} {names(others)}; --target selects another')
        if others := components.heard - components.devices - {components.found}:
            self._announcement.append(f'also on this link: {names(others)}')

    def _consent(self) -> bool:
        """Return whether there is consent; ask for it if there is a terminal."""
        # A stream whose descriptor was closed before the start is None.
        terminal = all(stream and stream.isatty() for stream in (sys.stdin, sys.stdout))
        if self._options.yes or not terminal or not any(
                one.needs_consent for one in self._requirements):
            return bool(self._options.yes)
        _print(self._checks.question.format(
            device=self._session.device, **self._payload_options), end='')
        # Not input(), which a signal does not end.
        while not select.select([sys.stdin], [], [], 0.1)[0]:
            if self._session.runner.interrupted:
                return False
        try:
            answer = sys.stdin.readline().strip()
        except (OSError, ValueError):
            return False
        if answer.lower() not in ('y', 'yes', '', 'n', 'no'):
            _print(f'{answer!r} is neither y nor n: taken as no')
        return answer.lower() in ('y', 'yes')

    def _handle(self, number: int, frame: FrameType | None) -> None:
        # A closing terminal sends SIGHUP twice.
        if self._signals and number == signal.SIGHUP:
            return
        self._signals += 1
        changed, device = self._runner.changed, self._checks.device
        if self._signals > 1:
            _complain(f'ended; the {device} is not as it was' if changed else 'ended')
            os._exit(1)
        self._link.call(self._session.runner.interrupt)
        _complain(f'interrupted; restoring the {device}; a second signal ends without it'
                  if changed else 'interrupted')

    def _describe_device(self) -> str:
        session, device = self._session, self._checks.device
        found = session.components.found
        name, detail = (f'{device} {found}', session.identity) if found else (
            f'no {device}', self._missing)
        return f'{name}: {detail}' if detail else name


def _is_peer_error(reason: str) -> bool:
    return any(os.strerror(number) in reason for number in PEER_ERRORS)


def _complain(text: str) -> None:
    # Do not use sys.stderr, whose writes a signal may interrupt, and do not wait for its reader.
    with contextlib.suppress(OSError):
        if select.select([], [2], [], 0.0)[1]:
            # An argument that is not UTF-8 contains surrogates.
            os.write(2, f'conformance: {text}\n'.encode(errors='backslashreplace'))


# A failure is reported once, and the run goes on, to restore the device.
_print = functools.partial(print_output, _complain)
