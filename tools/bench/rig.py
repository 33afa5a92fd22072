# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Programs to measure, a ROS client to measure with, and the load of a process."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
import contextlib
from contextlib import AbstractContextManager
from dataclasses import dataclass
import itertools
from pathlib import Path
import random
import sys
import threading
import time
from typing import Any, TypeVar

from rclpy.client import Client as RosClient
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_srvs.srv import SetBool
from support.processes import ended, Program, start_interpreter
from support.spun import SpunNode
from support.waiting import eventually, PATIENCE

from .rows import Figures, quantiles

Amount = TypeVar('Amount')

PEERS = Path(__file__).with_name('peers')
# The QoS of the state topics.
STATE = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
# Each client of a service receives the answers to all clients, and rclpy's queue of 10 loses some.
ANSWERS = QoSProfile(depth=100)
_numbers = itertools.count()


@dataclass(frozen=True)
class Bench:
    """
    The options of a run.

    :param domain: a ROS domain that only this run uses.
    :param quick: whether to measure as little as possible, to test the benchmark itself.
    """

    domain: int
    quick: bool

    def amount(self, full: Amount, quick: Amount) -> Amount:
        """Return the amount of work: the second one for a quick run."""
        return quick if self.quick else full


def udp(port: int) -> str:
    """Return the URL at which the bridge listens on a port."""
    return f'udpin://127.0.0.1:{port}'


def bridge(
    url: str, name: str = 'illuminator', until: str = 'link open', **parameters: object,
) -> AbstractContextManager[Program]:
    """Run the bridge; enter when it has printed a text."""
    given = {'connection_url': url, **parameters}
    overrides = [text for key, value in given.items() for text in ('-p', f'{key}:={value}')]
    return ready(start_interpreter('illuminator_ros.bridge', '--ros-args', '-r',
                                   f'__node:={name}', *overrides), until)


def simulator(port: int, *arguments: str) -> AbstractContextManager[Program]:
    """Run simulated lights that send to a port."""
    return ended(start_interpreter(
        'illuminator_ros.simulator', f'udpout://127.0.0.1:{port}', '--plain', *arguments))


def peer(name: str, *arguments: object) -> AbstractContextManager[Program]:
    """Run one of ``peers/``; enter when it is ready."""
    return ready(Program(sys.executable, str(PEERS / f'{name}.py'), *map(str, arguments)), 'ready')


@contextlib.contextmanager
def ready(program: Program, text: str) -> Iterator[Program]:
    """Run a program; enter when it has printed a text."""
    with ended(program):
        program.wait_for(text, PATIENCE)
        yield program


def alternate(
    actions: Mapping[str, Callable[[], Sequence[float]]], rounds: int, warm_up: int,
) -> dict[str, Figures]:
    """
    Do actions in turn; return the quantiles of the times that each returns (s), ms.

    Each follows each other one equally often, since the program that ran before determines the
    content of the processor's caches.

    :param warm_up: rounds that are not measured.
    """
    took: dict[str, list[float]] = {name: [] for name in actions}
    names, last, order = [*actions], '', random.Random(1)
    for number in range(warm_up + rounds):
        order.shuffle(names)
        # None is done twice in a row: the program may still be busy after its answer.
        if names[0] == last:
            names.reverse()
        last = names[-1]
        for name in names:
            values = actions[name]()
            if number >= warm_up:
                took[name] += [seconds * 1e3 for seconds in values]
    return {name: quantiles(values) for name, values in took.items()}


class Client(SpunNode):
    """A ROS node to measure with."""

    def __init__(self, bench: Bench) -> None:
        super().__init__(f'bench_{next(_numbers)}', bench.domain)
        self._clients: dict[str, RosClient] = {}
        self._on = itertools.cycle((True, True, False, False))

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def client(self, service: str, type_: type[Any] = SetBool) -> RosClient:
        """Return the client of a service, whether the service exists or not."""
        if service not in self._clients:
            self._clients[service] = self.node.create_client(
                type_, service, qos_profile=ANSWERS)
        return self._clients[service]

    def call(
        self, service: str, request: Any = None, patience: float = PATIENCE,
    ) -> tuple[float, Any]:
        """Call a service; return the time until the answer, s, and the answer, None if none."""
        answered = threading.Event()
        began = time.perf_counter()
        future = self.client(service).call_async(request or SetBool.Request(data=next(self._on)))
        future.add_done_callback(lambda _: answered.set())
        found = answered.wait(patience)
        return time.perf_counter() - began, future.result() if found else None

    def enable(self, service: str) -> list[float]:
        """Switch on or off; return the time until success, s."""
        seconds, answer = self.call(service)
        if answer is None or not answer.success:
            raise RuntimeError(f'{service}: {answer}')
        return [seconds]

    def meet(self, service: str, *, success: bool = True) -> None:
        """
        Wait until a service answers, with success if ``success`` is set.

        The first call may get lost: the server may receive it before it discovers the client.
        """
        def answers() -> bool:
            if not self.client(service).service_is_ready():
                return False
            _, answer = self.call(service, patience=0.5)
            return answer is not None and (answer.success or not success)

        eventually(answers, f'{service} answers')

    def subscribe(
        self, type_: type[Any], topic: str, take: Callable[[Any], None], qos: QoSProfile = STATE,
    ) -> None:
        """Call back with each message, in the client's thread."""
        self.node.create_subscription(type_, topic, take, qos)


def cpu(pid: int) -> float:
    """Return the CPU time of all threads of a process, s."""
    # The kernel's number for the CPU clock of a process, in nanoseconds; /proc has ticks of 10 ms.
    return time.clock_gettime((~pid << 3) | 2)


def cpu_share(pid: int, seconds: float) -> float:
    """Return the CPU time that a process takes in some time, % of a core."""
    before = cpu(pid)
    time.sleep(seconds)
    return 100 * (cpu(pid) - before) / seconds


def settle(pid: int) -> None:
    """Wait until a process is idle."""
    eventually(lambda: cpu_share(pid, 0.03) < 3, 'a program is idle')


def resident(pid: int) -> float:
    """Return the resident memory of a process, MB."""
    lines = Path(f'/proc/{pid}/smaps_rollup').read_text().splitlines()[1:]
    return next(int(line.split()[1]) * 1024 / 1e6 for line in lines if line.startswith('Rss:'))


def interleaved(names: Sequence[str], rounds: int) -> Iterator[str]:
    """Yield each name once a round, in alternating order, so that drift affects all equally."""
    for number in range(rounds):
        yield from names if number % 2 == 0 else reversed(names)
