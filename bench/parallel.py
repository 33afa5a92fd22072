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

"""
A silent light among others: by how much it delays them.

  python3 bench/parallel.py         needs ROS

Calls ~/enable of each light in turn, first with all lights answering and then with one of them
silent and called all the time, alternating in one run, and compares the others' times.
"""

from __future__ import annotations

import contextlib
import itertools
import os
from pathlib import Path
import random
import sys
import threading
import time
from typing import Any

LIGHTS, CALLS, ROUNDS = 4, 150, 4

os.environ.setdefault('ROS_DOMAIN_ID', str(random.randint(1, 101)))
os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))

import rclpy  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from scale import free_port, program  # noqa: E402
from std_srvs.srv import SetBool  # noqa: E402
from support.light import ON_OFF, ServedLight, Source  # noqa: E402


def quantile(times: list[float], share: float) -> float:
    """Return the time that this share of them does not exceed."""
    return sorted(times)[min(int(share * len(times)), len(times) - 1)]


class Client:
    """A client of ~/enable of some nodes."""

    def __init__(self, nodes: list[str]) -> None:
        self.node = rclpy.create_node('bench')
        self._clients = {name: self.node.create_client(SetBool, f'/{name}/enable')
                         for name in nodes}
        executor = SingleThreadedExecutor()
        executor.add_node(self.node)
        threading.Thread(target=executor.spin, daemon=True).start()
        for client in self._clients.values():
            assert client.wait_for_service(20.0)

    def call(self, name: str, on: bool) -> tuple[float, Any]:
        """Call one and return the time that it took, s, and the answer."""
        answered = threading.Event()
        began = time.perf_counter()
        future = self._clients[name].call_async(SetBool.Request(data=on))
        future.add_done_callback(lambda future: answered.set())
        assert answered.wait(10.0)
        return time.perf_counter() - began, future.result()


def main() -> int:
    """Measure; return the exit status."""
    port = free_port()
    names = ['illuminator', *(f'illuminator_1_{244 + number}' for number in range(LIGHTS - 1))]
    others, silent_name = names[:-1], names[-1]
    with contextlib.ExitStack() as stack:
        stack.enter_context(program(
            'illuminator_ros.bridge', '--ros-args', '-p',
            f'connection_url:=udpin://127.0.0.1:{port}', '-p', 'target_component:=243'))
        lights = [stack.enter_context(ServedLight(port, Source(1, 243 + number), stream=1.0))
                  for number in range(LIGHTS)]
        rclpy.init()
        client, nagging = Client(names), Client([silent_name])
        time.sleep(2.0)
        times: dict[bool, list[float]] = {False: [], True: []}
        is_silent = threading.Event()

        def nag() -> None:
            while True:
                is_silent.wait()
                nagging.call(silent_name, True)

        threading.Thread(target=nag, daemon=True).start()
        for _ in range(ROUNDS):
            for silent in (False, True):
                lights[-1].fake.results[ON_OFF] = None if silent else 0
                if silent:
                    is_silent.set()
                    lights[-1].wait_for(ON_OFF, len(lights[-1].commands(ON_OFF)) + 1)
                for number, name in zip(range(CALLS), itertools.cycle(others), strict=False):
                    took, answer = client.call(name, bool(number // len(others) % 2))
                    assert answer.success, answer.message
                    times[silent].append(took)
                is_silent.clear()
                # What is under way there ends before the next round.
                nagging.call(silent_name, True) if not silent else time.sleep(2.5)
        for share in (0.5, 0.99):
            alone, beside = (quantile(times[silent], share) for silent in (False, True))
            print(f'~/enable of {len(others)} lights, p{share * 100:.0f}: {alone * 1e3:.2f} ms '
                  f'undisturbed, {beside * 1e3:.2f} ms beside a silent light, '
                  f'{beside / alone:.2f} times')
    sys.stdout.flush()
    os._exit(0)


if __name__ == '__main__':
    main()
