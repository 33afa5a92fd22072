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

"""The monitor as a process: command line, node, and the loop of the screen."""

from __future__ import annotations

import argparse
from collections.abc import Callable
import io
import os
import sys
import threading
import time
import uuid

import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args
from rich.console import Console
from rich.live import Live

from . import terminal
from .key_bindings import KeyBindings, KeyDecoder
from .model import DiscoveredLights, Light
from .ros_graph import Graph
from .view import plain, screen, ViewState
from ..entry_point import (
    CANNOT_CREATE,
    log_directory_refusal,
    one_line,
    parameter_file_refusal,
    print_output,
    start_failure,
    wrong_arguments,
)
from ..options import option, Parser
from ..termination import Termination
from ...payload.simulated_settings import number
from ...ros.executor import NodeExecutor
from ...ros.throttled_log import NodeLog

# s between updates of the screen.
INTERVAL = 0.25
# s without a new light after which the table counts as complete.
SETTLING = 1.0
# s to wait for the thread: an interpreter that ends while the thread is inside rclpy aborts. After
# a signal the process ends sooner.
END_LIMIT = 5.0
# Characters; enough for each column of a table for a file or a pipe.
PLAIN_WIDTH = 400
DESCRIPTION = """\
Shows the lights in a ROS graph: state, brightness, strobe, temperature, link and errors of each
light of every bridge. Keys switch and dim the selected one; ? lists them. If standard input or
output is not a terminal, it prints one table and ends.
"""
EPILOG = """\
examples:
  ros2 run illuminator_ros monitor
  ros2 run illuminator_ros monitor --once | grep LOST
  NO_COLOR=1 ros2 run illuminator_ros monitor

exit status: 0 after q or a signal, or with a table printed; 1 if no light was found for that
table, or a package is missing; 2 if an argument is wrong.
"""


class Monitor:
    """
    The lights that a node discovers, in a thread of its own.

    :ivar clock: returns the time, s.
    :ivar lights: returns copies of the lights as they are now.
    """

    def __init__(self, node: Node, clock: Callable[[], float] = time.monotonic) -> None:
        self.clock = clock
        lights = DiscoveredLights()
        self.lights = lights.snapshot
        self.graph = Graph(node, lights, clock)
        self._executor = NodeExecutor(node.context, NodeLog(node.get_logger()))
        self._executor.add_node(node)
        self._thread = threading.Thread(target=self._executor.run, name='ros', daemon=True)
        self._thread.start()

    def end(self) -> None:
        """End the thread."""
        self._executor.end()
        self._thread.join(END_LIMIT)


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = Parser('monitor', DESCRIPTION, EPILOG)
    made.add_argument('--once', action='store_true', help='print one table and end')
    made.add_argument('--wait', type=option(number(0.1, 3600)), default=6.0, metavar='S',
                      help='longest search for lights before that table, s (default: 6)')
    made.add_argument('--ascii', action='store_true',
                      help='draw with ASCII characters only')
    return made


def run(args: list[str] | None, termination: Termination) -> int:
    """Run the monitor; see the text of ``--help``."""
    arguments = sys.argv[1:] if args is None else args
    failed = wrong_arguments('monitor')
    try:
        # rcl reads the files as soon as it parses the arguments.
        refusal = parameter_file_refusal(arguments)
        own = [] if refusal else remove_ros_args(['monitor', *arguments])[1:]
        options = parser().parse_args(own)
        if refusal := refusal or log_directory_refusal():
            print(f'monitor: {refusal}', file=sys.stderr)
            return 2
        termination.calls(lambda: None)
        rclpy.init(args=['monitor', *arguments], signal_handler_options=SignalHandlerOptions.NO)
        failed = CANNOT_CREATE
        # Several monitors may run, and they do not need /rosout.
        node = Node(f'illuminator_monitor_{uuid.uuid4().hex[:8]}', enable_rosout=False,
                    start_parameter_services=False)
    except SystemExit as end:
        return int(end.code or 0)
    except Exception as error:
        # rclpy has an exception for each kind of wrong argument.
        print(f'monitor: {one_line(start_failure(error, failed))}', file=sys.stderr)
        return 2
    monitor = Monitor(node)
    console = Console(highlight=False)
    interactive = (sys.stdin is not None and sys.stdin.isatty() and console.is_terminal
                   and not console.is_dumb_terminal and not options.once)
    try:
        if interactive:
            with terminal.while_it_lasts():
                _watch(monitor, console, termination, ascii_only=options.ascii)
            return 0
        return _print_once(monitor, options, termination)
    finally:
        monitor.end()
        node.destroy_node()
        rclpy.try_shutdown()


def _watch(
    monitor: Monitor, console: Console, termination: Termination, *, ascii_only: bool,
) -> None:
    """Show the lights until the end is requested."""
    bindings = KeyBindings(monitor.graph.submit, monitor.graph.clear_gone)
    keyboard = terminal.Keyboard(sys.stdin.fileno())
    decoder = KeyDecoder()
    stopped = threading.Event()
    ascii_only = ascii_only or console.options.ascii_only

    def stop() -> None:
        stopped.set()
        keyboard.wake()

    def end() -> None:
        bindings.end()
        keyboard.wake()

    while not bindings.quit:
        stopped.clear()
        with (terminal.quiet_errors(), terminal.unbuffered(sys.stdin.fileno()) as restore,
              terminal.suspended_by(stop),
              Live(console=console, screen=True, auto_refresh=False) as live):
            termination.calls(end, last=restore)
            while not (bindings.quit or bindings.stop or stopped.is_set()):
                lights = monitor.lights()
                bindings.update(lights)
                view = ViewState(lights, bindings.selected, monitor.clock(), bindings.show_help,
                                 ascii_only=ascii_only)
                live.update(screen(view, console.width, console.height), refresh=True)
                data = keyboard.read(terminal.ESCAPE_TIMEOUT if decoder.waiting else INTERVAL, end)
                for key in decoder.feed(data):
                    bindings.press(key, lights, monitor.clock())
        if not bindings.quit:
            terminal.suspend(job=bindings.stop)
            bindings.resume()
    keyboard.close()


def is_complete(light: Light) -> bool:
    """Return whether a light has published its state."""
    return light.link is not None and (
        light.value('connected') is False or light.value('enabled') is not None)


def _print_once(monitor: Monitor, options: argparse.Namespace, termination: Termination) -> int:
    """Print one table."""
    if sys.stdout is None:
        print('monitor: standard output is closed', file=sys.stderr)
        return 1
    ended = threading.Event()
    termination.calls(ended.set)
    lights = monitor.lights()
    until = time.monotonic() + options.wait
    # Lights are discovered one after the other and publish their state in several messages.
    complete_since = time.monotonic()
    while not ended.wait(0.1) and time.monotonic() < min(until, complete_since + SETTLING):
        before, lights = lights, monitor.lights()
        if len(lights) != len(before) or not lights or not all(map(is_complete, lights)):
            complete_since = time.monotonic()
    if not lights:
        print(f'monitor: no light found within {options.wait:g} s: check that a bridge runs, with '
              f'ROS_DOMAIN_ID={os.environ.get("ROS_DOMAIN_ID", 0)} as here', file=sys.stderr)
        return 1
    table = io.StringIO()
    Console(file=table, width=PLAIN_WIDTH, color_system=None, highlight=False, soft_wrap=True
            ).print(plain(ViewState(lights, None, monitor.clock())))
    written = print_output(lambda reason: print(f'monitor: {reason}', file=sys.stderr),
                           *(line.rstrip() for line in table.getvalue().splitlines()))
    return 0 if written else 1
