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

"""A link that is idle, or has no peer."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
import socket

from illuminator_ros.mavlink.messages import Address
from illuminator_ros.mavlink.receiver import STALL
import pytest
from support.frames import LIGHT
from support.heartbeats import heartbeat_frame
from support.live_link import LiveLink, Talker
from support.ports import free_port
from support.ptys import PtyDevice
from support.simulated_link import SimulatedLink
from support.waiting import Log

Run = Callable[[LiveLink], LiveLink]


class Counting(Talker):
    """Notes how often its link's thread had gone round at each heartbeat, 0.25 to 1 s apart."""

    def __init__(self) -> None:
        super().__init__()
        self.turns_at_beats: Log[int] = Log()

    def link_opened(self, now: float) -> None:
        super().link_opened(now)
        self.turns_at_beats.append(self.turns)

    def poll(self, now: float) -> None:
        due = self.heartbeat.due
        super().poll(now)
        if self.heartbeat.due != due:
            self.turns_at_beats.append(self.turns)

    def rests(self) -> bool:
        """Return whether few turns are made during the next few heartbeats."""
        first = len(self.turns_at_beats)
        self.turns_at_beats.wait_for(lambda turns: True, count=4, since=first)
        return self.turns_at_beats[first + 3] - self.turns_at_beats[first] < 100


@pytest.mark.parametrize('url', [
    'memory://quiet', 'udpin://127.0.0.1:{port}', 'tcp://127.0.0.1:{port}',
    'serial:///dev/illuminator_ros_has_no_such_device:57600'])
def test_waiting_makes_next_to_no_work(run: Run, url: str) -> None:
    link = run(LiveLink(url.format(port=free_port(socket.SOCK_STREAM)), Counting()))
    assert link.endpoint.rests()


def test_a_line_that_takes_nothing_makes_no_work(
    run: Run, tmp_path: Path,
) -> None:
    pytest.importorskip('serial', reason='pyserial is not installed')
    device = PtyDevice(tmp_path)
    link = run(LiveLink(f'serial://{device.path}:57600', Counting()))
    link.wait_open()

    def fill(now: float) -> None:
        for _ in range(3000):
            link.endpoint.heartbeat.send(now, link.endpoint.outgoing)

    link.ask(fill)
    link.ask(lambda now: None)
    assert link.endpoint.rests()
    assert link.state().traffic.frames_dropped > 0
    device.pull_out()


class Simulation:
    """A link to one peer, and when its endpoint was told what."""

    def __init__(self) -> None:
        self.endpoint = Talker()
        self.heard_at: list[float] = []
        taken = self.endpoint.receive

        def receive(source: Address, message: object, now: float) -> None:
            self.heard_at.append(now)
            taken(source, message, now)

        self.endpoint.receive = receive  # type: ignore[method-assign]
        self.link = SimulatedLink(self.endpoint, lambda data, peer: None, now=0.0)

    def receive(self, data: bytes) -> None:
        """Take bytes."""
        self.link.receive((data, 'peer'))

    @property
    def greeted_at(self) -> list[float]:
        """Return the times at which a new peer may have appeared."""
        return list(self.endpoint.greetings)


@pytest.fixture
def simulation() -> Iterator[Simulation]:
    """Return a link on which no time passes by itself, opened at 0 s."""
    one = Simulation()
    yield one
    one.link.stop()


def test_greetings_go_out_until_somebody_is_heard(simulation: Simulation) -> None:
    # A router that has restarted passes nothing on to whom it has not heard, and both our
    # heartbeat and then the other side's must have come within a second.
    simulation.link.run(0.6)
    simulation.receive(heartbeat_frame(LIGHT))
    simulation.link.run(1.0)
    assert simulation.greeted_at == [0.0, 0.25, 0.5, 0.6]


def test_nobody_is_greeted_again_while_somebody_is_heard(simulation: Simulation) -> None:
    for _ in range(5):
        simulation.receive(heartbeat_frame(LIGHT))
        simulation.link.run(1.4)
    assert simulation.greeted_at == [0.0, 0.0]


def test_greetings_go_out_once_nobody_is_heard_any_more(simulation: Simulation) -> None:
    simulation.receive(heartbeat_frame(LIGHT))
    simulation.link.run(2.1)
    assert simulation.greeted_at == [0.0, 0.0, 1.5, 1.75, 2.0]


def test_noise_is_no_sign_of_life(simulation: Simulation) -> None:
    simulation.receive(heartbeat_frame(LIGHT))
    simulation.link.run(1.0)
    simulation.receive(b'noise' + heartbeat_frame(LIGHT)[:-1] + b'x')
    simulation.link.run(0.6)
    assert simulation.greeted_at == [0.0, 0.0, 1.5]


def test_good_frames_behind_a_false_start_are_taken_when_it_is_given_up(
    simulation: Simulation,
) -> None:
    simulation.receive(heartbeat_frame(LIGHT))
    simulation.receive(b'\xfe\xfa\x00\x01\x01\x6e' + heartbeat_frame(LIGHT))
    simulation.link.run(2.0)
    assert simulation.heard_at == [0.0, STALL]
