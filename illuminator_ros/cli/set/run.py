# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The settings of a device, one after the other, by the requests of the monitor's keys."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
import json
import os
import sys
import threading
import time
from typing import NamedTuple
import uuid

import rclpy
from rclpy.node import Node

from . import completion
from .. import entry_point
from ..arguments import option, Parser
from ..monitor.ros_graph import devices_among, Graph, GraphDevice
from ..payloads import PAYLOADS
from ..termination import Termination
from ...payload.command_sources import source_name
from ...ros.monitor_view import DONE, FAILED, Request, SENT, WrongText
from ...simulation.settings import number

# s between two polls, and for values of the device that a request needs.
POLL, SETTLING = 0.02, 1.0
DESCRIPTION = """\
Sets values of a light, gimbal or camera through its ROS node. Each must be confirmed by the device
before the next is set, and before a light is switched on; "enable=false" is always the first."""
EPILOG = """\
light:  brightness (%), strobe_duty_cycle (%), strobe_period (s, 0 for none), enable (true or
        false), refresh=true, release=true
gimbal: take_control=true, roll (degrees right), pitch (degrees down), yaw (degrees left, in
        the frame of ~/angles: the vehicle, or the earth while the yaw is locked), neutral=true,
        release_control=true, release=true
camera: capture=true, capture_panel=true, ping=true

examples:
  ros2 run illuminator_ros set /illuminator brightness=10 enable=true
  ros2 run illuminator_ros set /gimbal take_control=true pitch=45 yaw=0
  ros2 run illuminator_ros set /rededge capture=true

exit status: 0 if each value is confirmed; 1 if not, with the reason; 2 if an argument is wrong.
"""


class Result(NamedTuple):
    """The result of one setting; the answer is for people."""

    name: str
    value: str
    confirmed: bool
    answer: str


def setting(text: str) -> tuple[str, str]:
    """
    Return name and value of a setting.

    :raises ValueError: if it is none.
    """
    name, separator, value = text.partition('=')
    if not (name and separator and value):
        raise ValueError(f'{text!r} is not NAME=VALUE')
    return name, value


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = Parser('set', DESCRIPTION, EPILOG)
    device = made.add_argument(
        'device', metavar='NODE', help='name of its node, such as /illuminator')
    values = made.add_argument(
        'settings', nargs='+', type=option(setting), metavar='NAME=VALUE')
    # Attributes that argcomplete reads.
    device.completer = completion.names  # type: ignore[attr-defined]
    values.completer = completion.settings  # type: ignore[attr-defined]
    seconds = option(number(0, 3600))
    made.add_argument('--wait', type=seconds, default=3.0, metavar='S',
                      help='longest search for the node, s (default: %(default)g)')
    made.add_argument('--timeout', type=seconds, default=10.0, metavar='S',
                      help='longest time for all settings, s (default: %(default)g)')
    made.add_argument('--source', type=option(source_name), metavar='NAME',
                      help='source of commands to use if the device has sources')
    made.add_argument('--json', action='store_true', help='print the results as JSON')
    return made


complain = entry_point.complainer('set')


def run(args: list[str] | None, termination: Termination) -> int:
    """Run the program; see the text of ``--help``."""
    arguments = sys.argv[1:] if args is None else args
    completion.complete(made := parser())
    options = made.parse_args(entry_point.own_arguments('set', arguments))
    entry_point.start_ros('set', arguments)
    with entry_point.refusing(entry_point.CANNOT_CREATE):
        node = Node(f'illuminator_set_{uuid.uuid4().hex[:8]}', enable_rosout=False,
                    start_parameter_services=False)
    ended = threading.Event()
    termination.calls(ended.set)
    try:
        return _set(node, options, lambda: ended.wait(POLL))
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def _set(node: Node, options: argparse.Namespace, has_ended: Callable[[], bool]) -> int:
    with entry_point.refusing('wrong name of a node'):
        name = node.resolve_topic_name(options.device)
    views = [one.load('view') for one in PAYLOADS.values() if one.view]
    graph = Graph(node, views, options.source or '', only=name)
    until = time.monotonic() + options.wait
    graph.poll()
    while not graph.devices and time.monotonic() < until and not has_ended():
        graph.poll()
    if not graph.devices:
        found = sorted(devices_among(node.get_topic_names_and_types(), views,
                                     node.count_publishers))
        complain(f'no device {name} within {options.wait:g} s; devices in the ROS domain '
                 f'{os.environ.get("ROS_DOMAIN_ID", 0)}: {", ".join(found) or "none"}')
        return 1
    [device] = graph.devices
    if reason := device.conflict or in_order(device, options.settings)[1]:
        complain(f'{name}: {reason}')
        return 1 if device.conflict else 2
    results = list(Settings(graph, device, has_ended, options.timeout).apply(options.settings))
    if options.json:
        shown = [json.dumps({'device': name, 'results': [one._asdict() for one in results]})]
    else:
        shown = [f'{one.name}={one.value}: {"confirmed" if one.confirmed else "FAILED"}'
                 + f', {one.answer}' * bool(one.answer) for one in results]
    is_written = entry_point.print_output(complain, *shown)
    return 0 if is_written and all(one.confirmed for one in results) else 1


def in_order(
    device: GraphDevice, settings: Sequence[tuple[str, str]],
) -> tuple[list[tuple[str, str]], str]:
    """Return settings in the order in which they are applied, and what is wrong with them."""
    known = device.view.settings
    if unknown := [name for name, _ in settings if name not in known]:
        return [], f'no setting {unknown[0]}; a {device.view.kind} has {", ".join(known)}'
    made = {name: known[name](device, value) for name, value in settings}
    for name, one in made.items():
        if isinstance(one, WrongText):
            return [], f'{name}: {one}'
    if len(made) < len(settings):
        return [], 'a setting is given twice'

    def place(one: tuple[str, str]) -> tuple[bool, int]:
        request = made[one[0]]
        return not (isinstance(request, Request) and request.is_off), [*known].index(one[0])

    return sorted(settings, key=place), ''


class Settings:
    """The settings of one device, in a time limit from the construction on."""

    def __init__(
        self, graph: Graph, device: GraphDevice, has_ended: Callable[[], bool], timeout: float,
    ) -> None:
        self._graph = graph
        self._device = device
        self._has_ended = has_ended
        self._timeout = timeout
        self._until = graph.clock() + timeout

    def apply(self, settings: Sequence[tuple[str, str]]) -> Iterator[Result]:
        """Apply settings; the first that is not confirmed is the last."""
        for name, value in in_order(self._device, settings)[0]:
            is_confirmed, answer = self._apply(name, value)
            yield Result(name, value, is_confirmed, answer)
            if not is_confirmed:
                return

    def _apply(self, name: str, value: str) -> tuple[bool, str]:
        device = self._device

        def make() -> Request | str:
            return device.view.settings[name](device, value)

        # A request may need values of the device, which come one after the other.
        self._poll(lambda: isinstance(make(), Request), self._graph.clock() + SETTLING)
        if isinstance(request := make(), str):
            return False, request
        device.submit(request)
        self._poll(lambda: self._outcome() in (DONE, SENT, FAILED))
        if self._outcome() == SENT:
            return self._shown(request.values)
        answer = device.action[2] if device.action else ''
        return self._outcome() == DONE, answer or self._late()

    def _shown(self, values: Mapping[str, object]) -> tuple[bool, str]:
        """Return whether the device shows values that were sent as a message."""
        def is_shown() -> bool:
            return all(self._device.view.shows(self._device, *one) for one in values.items())

        self._poll(lambda: is_shown() or self._outcome() == FAILED)
        if self._outcome() == FAILED and self._device.action:
            return False, self._device.action[2]
        return is_shown(), '' if is_shown() else f'sent, and {self._late()}'

    def _outcome(self) -> tuple[str, str] | None:
        return self._device.action[1] if self._device.action else None

    def _late(self) -> str:
        return '' if self._outcome() == DONE else (
            f'not confirmed within {self._timeout:g} s')

    def _poll(self, is_over: Callable[[], bool], until: float | None = None) -> None:
        """Poll the graph until something is over or the time is."""
        until = self._until if until is None else min(until, self._until)
        while not is_over() and self._graph.clock() < until and not self._has_ended():
            self._graph.poll_answers()
            self._graph.poll()
