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

"""Programs to measure, a ROS client to measure with, and the load of a process."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
import contextlib
from contextlib import AbstractContextManager
from dataclasses import dataclass
import itertools
import os
from pathlib import Path
import random
import socket
import sys
import threading
import time
from typing import Any, TYPE_CHECKING, TypeVar

from rclpy.qos import QoSProfile
from std_srvs.srv import SetBool
from support.processes import Program, ROOT, start_interpreter
from support.spun import SpunNode

if TYPE_CHECKING:
    from rclpy.client import Client as RosClient
    from rclpy.task import Future

Amount = TypeVar('Amount')
Message = TypeVar('Message')

__all__ = ['Program', 'ROOT', 'start_interpreter']

PEERS = Path(__file__).with_name('peers')
# s; the longest wait for an event.
PATIENCE = 60.0
_numbers = itertools.count()
_ports: Iterator[int] = iter(())


@dataclass
class Bench:
    """
    The options of a run.

    :param quick: measure as little as possible, to test the benchmark itself.
    :param soak: s.
    :param lights: numbers of lights that get a node each.
    :param domain: a ROS domain that only this run uses.
    """

    quick: bool = False
    soak: float = 15.0
    lights: Sequence[int] = (1, 10, 100)
    domain: int = 0

    def amount(self, full: Amount, quick: Amount) -> Amount:
        """Return the amount of work: the second one for a quick run."""
        return quick if self.quick else full

    def say(self, text: str) -> None:
        """Print the progress."""
        print(f'  {text}', file=sys.stderr, flush=True)


@contextlib.contextmanager
def own_domain() -> Iterator[int]:
    """Yield a ROS domain that no test and no other benchmark on this machine uses."""
    global _ports
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    with socket.socket(socket.AF_UNIX) as claim:
        while True:
            domain = random.randint(1, 100)
            with contextlib.suppress(OSError):
                claim.bind(f'\0illuminator_ros_test_domain_{domain}')
                break
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        # The ports of participants 70 and up of the domain (DDSI-RTPS, 9.6.1.1) are free.
        first = 7400 + 250 * domain
        _ports = itertools.cycle(range(first + 150, first + 250))
        yield domain


def free_port() -> int:
    """Return an unused UDP port which the system gives to no other socket."""
    for port in itertools.islice(_ports, 100):
        with contextlib.suppress(OSError), socket.socket(type=socket.SOCK_DGRAM) as probe:
            probe.bind(('127.0.0.1', port))
            return port
    raise RuntimeError('no UDP port is free')


@contextlib.contextmanager
def running(program: Program) -> Iterator[Program]:
    """Yield a program, and end it in any case."""
    try:
        yield program
        if program.running:
            program.end()
    finally:
        program.kill()


def bridge(
    url: str, name: str = 'illuminator', **parameters: str | float,
) -> AbstractContextManager[Program]:
    """Run the bridge; enter when it has opened its link."""
    given = {'connection_url': url, **parameters}
    overrides = [text for key, value in given.items() for text in ('-p', f'{key}:={value}')]
    return ready(start_interpreter(
        'illuminator_ros.bridge', '--ros-args', '-r', f'__node:={name}', *overrides), 'link open')


def simulator(url: str, *arguments: str) -> AbstractContextManager[Program]:
    """Run simulated lights."""
    return running(start_interpreter('illuminator_ros.simulator', url, '--plain', *arguments))


def peer(name: str, *arguments: str) -> AbstractContextManager[Program]:
    """Run one of ``peers/``; enter when it is ready."""
    path = PEERS / f'{name}.py'
    return ready(Program(sys.executable, str(path), *arguments), 'ready')


@contextlib.contextmanager
def ready(program: Program, text: str) -> Iterator[Program]:
    """Run a program; enter when it has printed a text."""
    with running(program):
        program.wait_for(text, PATIENCE)
        yield program


class Client(SpunNode):
    """A ROS node to measure with."""

    def __init__(self, domain: int) -> None:
        super().__init__(f'bench_{next(_numbers)}', domain)
        self._clients: dict[str, RosClient] = {}

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def client(self, service: str) -> RosClient:
        """Return the client of a SetBool service, whether the service exists or not."""
        if service not in self._clients:
            self._clients[service] = self.node.create_client(SetBool, service)
        return self._clients[service]

    def start(self, service: str, on: bool) -> Future:
        """Call a SetBool service without waiting."""
        return self.client(service).call_async(SetBool.Request(data=on))

    def call(
        self, service: str, on: bool, patience: float = PATIENCE,
    ) -> tuple[float, SetBool.Response | None]:
        """Return the time until the caller has the answer, s, and the answer or None."""
        return _timed(self.client(service), SetBool.Request(data=on), patience)

    def request(
        self, type_: type[Any], service: str, request: object,
    ) -> tuple[float, Any]:
        """Call a service of any type once; return as :meth:`call` does."""
        client = self.node.create_client(type_, service)
        try:
            client.wait_for_service(PATIENCE)
            return _timed(client, request, PATIENCE)
        finally:
            self.node.destroy_client(client)

    def meet(self, service: str, *, success: bool = True) -> None:
        """
        Wait until a service answers, with success if ``success`` is set.

        The first call may get lost: the server may receive it before it discovers the client.
        """
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until:
            if self.client(service).service_is_ready():
                _, answer = self.call(service, False, 0.5)
                if answer is not None and (answer.success or not success):
                    return
            time.sleep(0.002)
        raise RuntimeError(f'{service} does not answer')

    def subscribe(
        self, type_: type[Message], topic: str, take: Callable[[Message], None],
        qos: QoSProfile | int,
    ) -> None:
        """Call back with each message, in the client's thread."""
        self.node.create_subscription(type_, topic, take, qos)


def _timed(
    client: RosClient, request: object, patience: float,
) -> tuple[float, Any]:
    answered = threading.Event()
    began = time.perf_counter()
    future = client.call_async(request)
    future.add_done_callback(lambda future: answered.set())
    found = answered.wait(patience)
    return time.perf_counter() - began, future.result() if found else None


def cpu(pid: int) -> float:
    """Return the CPU time of all threads of a process, s."""
    # The kernel's number for the CPU clock of a process, in nanoseconds; /proc has ticks of 10 ms.
    return time.clock_gettime((~pid << 3) | 2)


def settle(pid: int) -> None:
    """Wait until a process is idle."""
    until = time.monotonic() + PATIENCE
    before = cpu(pid)
    while time.monotonic() < until:
        time.sleep(0.03)
        if cpu(pid) - before < 0.001:
            return
        before = cpu(pid)
    raise RuntimeError('a program does not become idle')


def memory(pid: int) -> dict[str, float]:
    """Return the memory of a process, MB: Rss, Pss, and Private_Dirty (not shared)."""
    lines = Path(f'/proc/{pid}/smaps_rollup').read_text().splitlines()[1:]
    values = {line.split(':')[0]: int(line.split()[1]) * 1024 / 1e6 for line in lines}
    return {name: values[name] for name in ('Rss', 'Pss', 'Private_Dirty')}


def udp_queue(port: int) -> tuple[int, int]:
    """Return the bytes queued in the socket of a UDP port, and the datagrams that it dropped."""
    for line in Path('/proc/net/udp').read_text().splitlines()[1:]:
        fields = line.split()
        if fields[1].endswith(f':{port:04X}'):
            return int(fields[4].partition(':')[2], 16), int(fields[-1])
    raise RuntimeError(f'UDP port {port} is not bound')


def interleaved(names: Sequence[str], rounds: int) -> Iterator[str]:
    """Yield each name once a round, in alternating order, so that drift affects all equally."""
    for number in range(rounds):
        yield from names if number % 2 == 0 else reversed(names)
