# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``discover`` as a process: its ports, time, signals and report."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
import contextlib
from importlib.util import find_spec
import json
import os
import re
import selectors
import signal
import sys
import time

from .report import lines, report
from .setup import set_up, SIGNALS
from ..arguments import invocation, option, Parser
from ..entry_point import print_output
from ...mavlink.link_thread import Waker
from ...mavlink.search.listener import Listener
from ...mavlink.search.rate_scan import RATES, SHARE
from ...mavlink.transport.ports import serial_ports
from ...mavlink.url import HostPort, parse_url, SerialUrl, UdpUrl, Url
from ...simulation.settings import number

UDP_PORTS = 14540, 14550, 14590
# s to listen, enough for each rate of a serial port.
DURATION = 14.0
# s between looks at the rates, and at incomplete frames.
TICK = 0.25
# Columns of the line that shows the progress.
WIDTH = 78
CONSOLE = 'the console of this system, not opened (on a Raspberry Pi: raspi-config, Serial Port)'
NO_ROS = 'these commands need ROS 2 on the machine that runs them (doc/ros.md)'
NO_SERIAL = 'no serial port: plug its adapter in; a container needs --device'
DESCRIPTION = f"""\
Finds the port of a device, and prints the command to run. It listens to each serial port at
{', '.join(map(str, RATES[:6]))},
{', '.join(map(str, RATES[6:]))} baud, to the UDP ports
{', '.join(map(str, UDP_PORTS))}, and to the given URLs. It sends nothing."""
EPILOG = """\
examples:
  {command}
  {command} --seconds 30
  {command} /dev/ttyUSB0,9600            # at this rate first
  {command} tcpout://192.168.1.10:5760   # connects, and sends nothing

exit status: 0 if a device that this package serves was heard, 1 if not, 2 if an argument is
wrong. Ctrl-C ends the listening before its time."""


def ports_of(
    given: Sequence[tuple[str, Url]], duration: float, clock: Callable[[], float],
    serial: dict[str, bool],
) -> list[Listener]:
    """
    Return the ports to listen to; a given URL replaces a port of this machine.

    :param given: URLs by their texts.
    :param serial: see :func:`serial_ports`.
    """
    default: list[tuple[str, Url]] = [
        *((path, SerialUrl(path, RATES[0])) for path in serial),
        *((f'udpin://0.0.0.0:{port}', UdpUrl(HostPort('', port))) for port in UDP_PORTS)]
    listened = {_opened(url): (text, url) for text, url in (*default, *given)}
    return [Listener(url, text, clock, rates=_rates(url), share=max(duration / len(RATES), SHARE),
                     trouble=CONSOLE if serial.get(text) else '')
            for text, url in listened.values()]


def _rates(url: Url) -> Sequence[int]:
    return [*dict.fromkeys((url.baud, *RATES))] if isinstance(url, SerialUrl) else (0,)


def _opened(url: Url) -> object:
    """Return what two URLs would both open."""
    return (os.path.realpath(url.device) if isinstance(url, SerialUrl) else
            url.bind.port if isinstance(url, UdpUrl) and url.bind.port else url)


def parse(args: Sequence[str] | None) -> tuple[argparse.Namespace, list[tuple[str, Url]]]:
    """
    Return the options, and the given URLs by their texts.

    :raises SystemExit: if an argument is wrong, with status 2.
    """
    parser = Parser('discover', DESCRIPTION, EPILOG.format(command=invocation('discover')))
    parser.add_argument('url', nargs='*', help='further connection URL, or a serial port')
    parser.add_argument('--seconds', type=option(number(1, 3600)), default=DURATION, metavar='S',
                        help='how long to listen (default: %(default)g)')
    parser.add_argument('--json', action='store_true', help='print the report as JSON')
    parser.add_argument('--setup', action='store_true',
                        help='then ask for what a node needs, and write its files')
    parser.add_argument('--answer', action='append', default=[], metavar='KEY=VALUE',
                        help='an answer for --setup, which it then does not ask for')
    options = parser.parse_args(args)
    try:
        # A serial port may be given without its rate; a name by path contains colons.
        return options, [(text, parse_url(
            f'{text},{RATES[0]}' if re.match(r'/(?!.*[,:]\d+$)', text) else text,
            can_search=False))
            for text in options.url]
    except ValueError as error:
        parser.error(str(error))


def run(args: Sequence[str] | None = None) -> int:
    """
    Listen, print what is heard, and return the exit status.

    :param args: the command line without the program's name, by default from ``sys.argv``.
    """
    options, given = parse(args)
    serial = serial_ports()
    ports = ports_of(given, options.seconds, time.monotonic, serial)
    listen(ports, options.seconds)
    reports = sorted((report(port) for port in ports), key=lambda one: not one['run'])
    if options.setup:
        for one in SIGNALS:
            signal.signal(one, signal.default_int_handler)
        with contextlib.suppress(KeyboardInterrupt):
            return set_up(reports, options.answer)
        return 1
    if options.json:
        text = json.dumps(reports, indent=2)
    else:
        text = '\n'.join([*(line for one in reports for line in lines(one)),
                          *([] if serial else [NO_SERIAL]),
                          *([NO_ROS] if not find_spec('rclpy') and any(
                              one['run'] for one in reports) else [])])
    written = print_output(_complain, text)
    return 0 if written and any(one['run'] for one in reports) else 1


def listen(ports: Sequence[Listener], duration: float) -> None:
    """Open the ports, and listen until the time is over or a signal comes."""
    selector, waker = selectors.DefaultSelector(), Waker()
    end = time.monotonic() + duration

    def stop(*_: object) -> None:
        nonlocal end
        end = 0.0
        waker.wake()

    for one in (signal.SIGINT, signal.SIGTERM):
        signal.signal(one, stop)
    selector.register(waker, selectors.EVENT_READ, lambda waker, events: waker.clear())
    _say(f'listening for {duration:g} s, sending nothing')
    for port in ports:
        port.listen(selector)
    shown = ''
    while (left := end - time.monotonic()) > 0:
        for key, events in selector.select(min(TICK, left)):
            key.data(key.fileobj, events)
        for port in ports:
            port.poll()
        if shown != (shown := _progress(ports, left)):
            _show(shown)
    for port in ports:
        port.close()
    _show('')


def _progress(ports: Sequence[Listener], left: float) -> str:
    heard = [str(address) for port in ports for address in port.components]
    rates = dict.fromkeys(f'{port.rate}' for port in ports if port.rate and not port.trouble)
    return (f'{left:.0f} s left; heard: {", ".join(heard) or "nothing yet"}'
            + (f'; at {", ".join(rates)} baud' if rates else ''))


def _show(progress: str) -> None:
    """Write a line over the one before, on a terminal."""
    if sys.stderr is not None and sys.stderr.isatty():
        _say(progress[:WIDTH].ljust(WIDTH), end='\r')


def _complain(reason: str) -> None:
    _say(f'discover: {reason}')


def _say(text: str, end: str = '\n') -> None:
    if sys.stderr is not None:
        print(text, end=end, file=sys.stderr, flush=True)
