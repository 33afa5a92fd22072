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

"""What ``promises.py`` measures with; it needs ROS and ``test/`` on the path."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
from dataclasses import dataclass
import signal
import statistics
import threading
import time
from typing import Any

from illuminator_ros.mavlink.link import Link
from support.light import ServedLight
from support.ports import free_port
from support.processes import Program
from support.ros import Parameters, Ros, start_bridge


@dataclass
class Row:
    """One promise, and what was measured of it, s or a share."""

    promise: str
    section: str
    limit: float
    tries: int
    p50: float
    max: float  # noqa: A003

    @property
    def met(self) -> bool:
        """Whether no try took longer than the limit."""
        return self.max <= self.limit


class Watch:
    """Tells when a future was done: the waiting thread may be late."""

    def __init__(self, future: Any) -> None:
        self._began = time.monotonic()
        self._done = threading.Event()
        self._seconds = 0.0
        future.add_done_callback(self._note)

    def _note(self, future: Any) -> None:
        self._seconds = time.monotonic() - self._began
        self._done.set()

    def seconds(self) -> float:
        """Return how long it took."""
        assert self._done.wait(30.0), 'no answer within 30 s'
        return self._seconds


class Bench:
    """
    Programs, and what was measured of them.

    :ivar ros: a client of the bridge that runs.
    """

    ros: Ros

    def __init__(self, domain: int, count: int) -> None:
        self.count = count
        self._domain = domain
        self.rows: list[Row] = []

    def take(self, promise: str, section: str, limit: float, times: list[float]) -> None:
        """Keep what was measured of a promise."""
        self.rows.append(Row(promise, section, limit, len(times), statistics.median(times),
                             max(times)))

    @contextlib.contextmanager
    def bridge(self, port: int, until: str = 'link open', **parameters: Any) -> Iterator[Program]:
        """Run a bridge, with a client that has met no other."""
        self.ros = Ros(self._domain)
        program = start_bridge(self._domain, port, **parameters)
        try:
            program.wait_for(until)
            yield program
            if program.running:
                program.end()
        finally:
            program.kill()
            self.ros.close()

    @contextlib.contextmanager
    def lit(self, **parameters: Any) -> Iterator[tuple[Program, ServedLight]]:
        """Run a bridge and a light that has told it all."""
        port = free_port()
        with self.bridge(port, **parameters) as program, ServedLight(
                port, link=Link, enable=1, stream=0.1) as light:
            Parameters(self.ros).wait(brightness=100.0)
            yield program, light

    def call(self, type_: Any, service: str, request: Any) -> float:
        """Return how long a service takes to answer."""
        client = self.ros._client(type_, f'/illuminator/{service}')
        return Watch(client.call_async(request)).seconds()

    def set(self, **values: float) -> float:  # noqa: A003
        """Return how long a set of parameters takes."""
        from rcl_interfaces.srv import SetParameters
        from rclpy.parameter import Parameter
        return self.call(SetParameters, 'set_parameters', SetParameters.Request(parameters=[
            Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]))


def until_end(program: Program, number: int = signal.SIGTERM) -> float:
    """Return how long a program takes to end."""
    began = time.monotonic()
    program.send(number)
    program._process.wait(30.0)
    seconds = time.monotonic() - began
    assert program.wait() == 0, program.log
    return seconds
