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

"""The simulator as a process: link, view, and console."""

from __future__ import annotations

import argparse
import functools
import logging
import queue
import signal
import sys
import threading

from .console import execute
from .lights import lights, load, Scenario
from .options import DEFAULT_URL, parser
from .settings import SettingError
from .view import LiveView, Look, look, PlainView
from ..options import signing
from ..termination import Termination
from ...illuminator.simulated import simulated_lights
from ...illuminator.simulated_properties import IlluminatorProperties
from ...mavlink.link import Link
from ...mavlink.link_state import LinkEvent
from ...mavlink.signing_files import KeyFileError
from ...mavlink.url import parse_url, Url, UrlError

# s between looks at the lights.
VIEW_INTERVAL = 0.2


class _Simulation:
    """The lights on their link, and who looks at them."""

    def __init__(
        self, options: argparse.Namespace, url: Url, label: str,
        described: list[IlluminatorProperties],
    ) -> None:
        signs, store = signing(options, f'simulator {described[0].address}')
        # What is to be written, with the line that it answers; None ends it all.
        self._texts: queue.SimpleQueue[tuple[str, str | None] | None] = queue.SimpleQueue()
        self._looks: list[Look] = []
        live = sys.stdout is not None and sys.stdout.isatty() and not options.plain
        self._view: PlainView | LiveView = (LiveView if live else PlainView)(sys.stdout)
        self._endpoint = simulated_lights(described, 0.0)
        self._link = Link(url, self._endpoint, label=label, on_event=self._note,
                          signing=signs, store=store)
        for component in self._endpoint.components:
            component.power_on(self._link.clock())

    def run(self, termination: Termination) -> None:
        """Run until a signal or ``quit``."""
        names = [str(component.address) for component in self._endpoint.components]
        self._view.say(f'{len(names)} light{"s"[:len(names) > 1]}: ' + ', '.join(names[:8])
                       + (' ...' if len(names) > 8 else ''))
        termination.calls(self._end)
        self._link.start()
        # A background job that reads from its terminal is stopped, if it does not ignore this.
        signal.signal(signal.SIGTTIN, signal.SIG_IGN)
        threading.Thread(target=self._listen, name='console', daemon=True).start()
        while True:
            self._link.call(self._look)
            try:
                text = self._texts.get(timeout=VIEW_INTERVAL)
            except queue.Empty:
                pass
            else:
                if text is None:
                    break
                self._view.say(text[0], typed=text[1])
            self._view.show(self._looks)
        self._link.stop()

    def _end(self) -> None:
        self._texts.put(None)

    def _look(self, now: float) -> None:
        self._looks = [look(component, now) for component in self._endpoint.components]

    def _listen(self) -> None:
        """Do what is typed; without anybody to type there is nothing to do."""
        while True:
            try:
                line = sys.stdin.readline() if sys.stdin else ''
            except UnicodeDecodeError:
                # What is no text is no command.
                continue
            except (OSError, ValueError):
                return
            if not line:
                return
            self._link.call(functools.partial(self._execute, line.rstrip('\n')))

    def _execute(self, line: str, now: float) -> None:
        if line.strip() == 'quit':
            self._end()
        else:
            self._texts.put((execute(line, self._endpoint.components, now), line))

    def _note(self, event: LinkEvent) -> None:
        self._texts.put((str(event), None))


def run(args: list[str] | None, termination: Termination) -> int:
    """
    Run the simulator until a signal or ``quit``, and return the exit status.

    :param args: the command line without the program's name; None takes the process's.
    """
    options = parser().parse_args(args)
    logging.basicConfig(format='%(message)s')
    try:
        file = load(options.file) if options.file else Scenario()
        label = options.url or file.url or DEFAULT_URL
        simulation = _Simulation(options, parse_url(label), label, lights(options, file))
    except (UrlError, SettingError, KeyFileError, ValueError) as error:
        print(f'simulator: {error}', file=sys.stderr)
        return 2
    simulation.run(termination)
    return 0
