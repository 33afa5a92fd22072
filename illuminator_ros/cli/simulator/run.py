# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The simulator as a process: link, view, and console."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterable, Mapping
import contextlib
import functools
import io
import logging
import os
import queue
import signal
import sys
import threading
import time

from .components import components, load, Scenario, Types
from .console import execute
from .csv_file import write_records
from .options import parser, payload_types
from .view import LiveView, PlainView
from ..options import mavlink_version, signing
from ..termination import Termination
from ...mavlink.errors import LinkThreadError
from ...mavlink.link import Link
from ...mavlink.url import parse_url, Url
from ...payload.payload_type import PayloadType
from ...simulation.simulated import SimulatedComponents, SimulatedDevice, Snapshot

# s between updates of the view.
VIEW_INTERVAL = 0.2
# Lines that wait for a terminal that is stopped with ctrl-s; later ones are dropped.
MAX_TEXTS = 1000
# Values of TERM for terminals that show escape sequences as text.
DUMB_TERMINALS = ('dumb', 'unknown')


class _Simulation:
    """The simulated components on their link, and their view."""

    def __init__(
        self, options: argparse.Namespace, url: Url, label: str,
        devices: list[SimulatedDevice], types: Types,
    ) -> None:
        names = [str(one.properties.address) for one in devices]
        counts = Counter(map(type, devices))
        kinds = ', '.join(f'{count} {one.noun if count == 1 else one.plural}' for one in types
                          if (count := counts[one.device]))
        self._headline = f'{kinds}: {", ".join(names[:8])}{" ..." if len(names) > 8 else ""}'
        signs, store = signing(options, f'simulator {names[0]}')
        # Text to write, with the line that it answers; None ends the process.
        self._texts: queue.Queue[tuple[str, str | None] | None] = queue.Queue(MAX_TEXTS)
        self._ended = threading.Event()
        self._snapshots: list[Snapshot] = []
        live = (sys.stdout is not None and sys.stdout.isatty() and not options.plain
                and os.environ.get('TERM') not in DUMB_TERMINALS)
        self._view: PlainView | LiveView = (LiveView if live else PlainView)(sys.stdout)
        self._endpoint: SimulatedComponents[SimulatedDevice] = SimulatedComponents(devices, 0.0)
        self._endpoint.new_peers.subscribe(
            lambda address: self._say(f'peer {address}: first message'))
        self._link = Link(url, self._endpoint, label=label, on_event=self._say,
                          signing=signs, store=store,
                          mavlink_version=mavlink_version(
                              options.mavlink_version,
                              {one.noun: one.mavlink_version for one in types}))
        now = self._link.clock()
        for component in self._endpoint.components:
            component.device.set_clock(time.time(), now)
            component.power_on(now)

    def run(self, termination: Termination) -> None:
        """Run until a signal or ``quit``."""
        termination.calls(self._end)
        self._link.start()
        # SIGTTIN would stop a background job that reads from its terminal.
        signal.signal(signal.SIGTTIN, signal.SIG_IGN)
        threading.Thread(target=self._listen, name='console', daemon=True).start()
        # From here on this thread waits while its terminal is stopped.
        self._view.say(self._headline)
        # Lines before a "quit" have answers that may still be queued.
        while not (self._ended.is_set() and self._texts.empty()):
            self._link.call(self._take_snapshots)
            with contextlib.suppress(queue.Empty):
                if (text := self._texts.get(timeout=VIEW_INTERVAL)) is not None:
                    self._view.say(text[0], typed=text[1])
            self._view.show(self._snapshots)
        self._link.stop()

    def _end(self) -> None:
        self._ended.set()
        self._put(None)

    def _take_snapshots(self, now: float) -> None:
        self._snapshots = [one.snapshot(now) for one in self._endpoint.components]

    def _listen(self) -> None:
        """Execute the lines of standard input, until its end."""
        if isinstance(sys.stdin, io.TextIOWrapper):
            sys.stdin.reconfigure(errors='replace')
            # For example, a terminal that hangs up.
            with contextlib.suppress(OSError):
                for line in sys.stdin:
                    self._link.call(functools.partial(self._execute, line.rstrip('\n')))

    def _execute(self, line: str, now: float) -> None:
        if line.strip() == 'quit':
            self._end()
        else:
            self._put((execute(line, self._endpoint.components, now), line))

    def _say(self, event: object) -> None:
        self._put((str(event), None))

    def _put(self, text: tuple[str, str | None] | None) -> None:
        with contextlib.suppress(queue.Full):
            self._texts.put_nowait(text)


def run(
    args: Iterable[str] | None, termination: Termination,
    payloads: Mapping[str, PayloadType],
) -> int:
    """
    Run the simulator until a signal or ``quit``, and return the exit status.

    :param args: the command line without the program's name; None takes the process's.
    :param payloads: the kinds of payloads that ``--payload`` may name.
    """
    logging.basicConfig(format='%(message)s')
    try:
        types = payload_types(args, payloads)
        options = parser(types, payloads).parse_args(None if args is None else list(args))
        file = load(options.file, types) if options.file else Scenario()
        label = options.url or file.url or types[0].url
        devices = components(options, file, types)
        url = parse_url(label, can_search=False)
        simulation = _Simulation(options, url, label, devices, types)
        write_records(options, types, devices)
    except ValueError as error:
        print(f'simulator: {error}', file=sys.stderr)
        return 2
    try:
        simulation.run(termination)
    except LinkThreadError as error:
        print(f'simulator: {error}', file=sys.stderr)
        return 1
    return 0
