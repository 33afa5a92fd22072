# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The monitor as a process: command line, node, and the screen or one table."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
import functools
import locale
import os
import sys
import threading
import time
from urllib.parse import urlsplit
import uuid

import rclpy
from rclpy.node import Node

from .ros_graph import Graph
from .table import as_json, plain
from .. import entry_point
from ..arguments import option, Parser
from ..termination import Termination
from ...payload.command_sources import source_name
from ...payload.payload_type import PayloadType
from ...ros.monitor_view import Device, LOST, NOT_KNOWN

# s without a new device after which the table counts as complete.
SETTLING = 1.0
DEFAULT_WEB = '127.0.0.1:8000'
DESCRIPTION = """\
Shows the lights, gimbals and cameras of all bridges in a ROS graph, in a terminal or a browser,
with keys and clicks to operate the selected one. If standard input or output is not
a terminal, it prints one table and ends.
"""
EPILOG = """\
examples:
  ros2 run illuminator_ros monitor
  ros2 run illuminator_ros monitor --once | grep LOST
  NO_COLOR=1 ros2 run illuminator_ros monitor

exit status: 0 after q or a signal, or with a table printed; 1 if no device was found for that
table, the address cannot be used, or a package is missing; 2 if an argument is wrong.
"""


def address(text: str) -> tuple[str, int]:
    """
    Return host and port of an address.

    :raises ValueError: if it is none.
    """
    parts = urlsplit(f'//{text}')
    if not parts.hostname or parts.port is None:
        raise ValueError('is not HOST:PORT')
    return parts.hostname, parts.port


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = Parser('monitor', DESCRIPTION, EPILOG)
    made.add_argument('--source', type=option(source_name), metavar='NAME',
                      help='source of commands to use for devices that have sources')
    made.add_argument('--web', type=option(address), nargs='?', const=address(DEFAULT_WEB),
                      metavar='HOST:PORT', help=f'serve a browser (default: {DEFAULT_WEB})')
    made.add_argument('--token', action='store_true',
                      help='admit a browser only by a one-time token: of the printed URLs, one is '
                           'to look only; every address except loopback needs it')
    made.add_argument('--look', action='store_true', help='show devices, and request nothing')
    made.add_argument('--once', action='store_true', help='print the list and end')
    made.add_argument('--json', action='store_true', help='print all values as JSON and end')
    made.add_argument('--wait', type=float, default=6.0, metavar='S',
                      help='longest search for devices before that table, s (default: 6)')
    made.add_argument('--ascii', action='store_true', help='draw with ASCII characters only')
    return made


complain = entry_point.complainer('monitor')


def run(
    args: list[str] | None, termination: Termination, payloads: Mapping[str, PayloadType],
) -> int:
    """Run the monitor; see the text of ``--help``."""
    arguments = sys.argv[1:] if args is None else args
    # textual-serve runs this command line again, for each tab, with a driver of its own.
    is_tab = 'TEXTUAL_DRIVER' in os.environ
    options = parser().parse_args(entry_point.own_arguments('monitor', arguments))
    if options.web and not is_tab:
        from .web import serve
        return serve(options.web, options.token, termination, complain)
    # Several monitors may run, and they do not need /rosout.
    entry_point.start_ros('monitor', arguments)
    with entry_point.refusing(entry_point.CANNOT_CREATE):
        node = Node(f'illuminator_monitor_{uuid.uuid4().hex[:8]}', enable_rosout=False,
                    start_parameter_services=False)
    views = [one.load('view') for one in payloads.values() if one.view]
    graph = Graph(node, views, options.source or '', may_request=not options.look)
    is_terminal = os.environ.get('TERM', 'dumb') not in ('dumb', 'unknown') and all(
        stream is not None and stream.isatty() for stream in (sys.stdin, sys.stdout))
    try:
        if options.once or options.json or not (is_tab or is_terminal):
            return _print_once(graph, options, termination)
        return _watch(graph, options.ascii, termination, is_tab)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def _watch(graph: Graph, ascii_only: bool, termination: Termination, is_tab: bool) -> int:
    """Show the devices until the end is requested."""
    from . import terminal
    from .app import MonitorApp
    # Python itself takes UTF-8 for the locale POSIX.
    ascii_only = ascii_only or locale.nl_langinfo(locale.CODESET) != 'UTF-8'
    app = (MonitorApp if is_tab else terminal.TerminalApp)(
        graph, ascii_only=ascii_only, touch=is_tab)
    termination.calls(functools.partial(app.call_later, app.exit), last=app.restore)
    with terminal.quiet_errors():
        app.run()
    if is_tab or os.isatty(0):
        return app.return_code or 0
    # The interpreter would write the remaining output to the closed terminal at its exit.
    entry_point.discard_output()
    return 0


def is_complete(device: Device) -> bool:
    """Return whether a device has published its state."""
    return device.state == LOST or 'link' in device.diagnoses and device.state != NOT_KNOWN


def _print_once(graph: Graph, options: argparse.Namespace, termination: Termination) -> int:
    """Print one table."""
    if sys.stdout is None:
        complain('standard output is closed')
        return 1
    ended = threading.Event()
    termination.calls(ended.set)
    until = time.monotonic() + options.wait
    # Devices are discovered one after the other and publish their state in several messages.
    complete_since, known = time.monotonic(), 0
    while not ended.wait(0.1) and time.monotonic() < min(until, complete_since + SETTLING):
        graph.poll()
        if len(graph.devices) != known or not known or not all(map(is_complete, graph.devices)):
            complete_since, known = time.monotonic(), len(graph.devices)
    if not known:
        complain(f'no device found within {options.wait:g} s: check that a bridge runs, with '
                 f'ROS_DOMAIN_ID={os.environ.get("ROS_DOMAIN_ID", 0)} as here')
        return 1
    lines = [as_json(graph.devices)] if options.json else plain(graph.devices)
    return 0 if entry_point.print_output(complain, *lines) else 1
