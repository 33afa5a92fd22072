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

"""What a link does while there is nothing to do, or nobody to talk to."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
import socket
import threading
import time

import pytest
from support.frames import LIGHT
from support.heartbeats import heartbeat_frame
from support.live_link import Jump, LiveLink, Talker
from support.open_channel import bound_socket, free_port, OpenChannel
from support.ptys import PtyDevice
from support.simulated_link import SimulatedLink

from illuminator_ros.mavlink import opener
from illuminator_ros.mavlink.dialect import Source
from illuminator_ros.mavlink.link import KNOCK_INTERVAL, SILENCE
from illuminator_ros.mavlink.reception import STALL

Run = Callable[[LiveLink], LiveLink]


@pytest.fixture
def clock() -> Jump:
    """Return a clock that can be set forward."""
    return Jump()


def jump(link: LiveLink, clock: Jump, seconds: float) -> None:
    """Let time pass for a link."""
    clock.ahead += seconds
    link.link.call(lambda now: None)


@pytest.mark.parametrize('url', [
    'memory://quiet', 'udpin://127.0.0.1:{port}', 'tcp://127.0.0.1:{port}',
    'serial:///dev/illuminator_ros_has_no_such_device:57600'])
def test_waiting_takes_next_to_no_time_of_a_processor(run: Run, url: str) -> None:
    link = run(LiveLink(url.format(port=free_port(socket.SOCK_STREAM))))
    clock = time.pthread_getcpuclockid(link.link._thread.ident)
    link.ask(lambda now: None)
    begun, busy = time.monotonic(), time.clock_gettime(clock)
    # Longer than the longest pause between tries.
    threading.Event().wait(1.5 * opener.LAST_PAUSE)
    assert time.clock_gettime(clock) - busy < 0.1 * (time.monotonic() - begun)


def test_a_line_that_takes_nothing_makes_no_work(
    run: Run, tmp_path: Path,
) -> None:
    pytest.importorskip('serial', reason='pyserial is not installed')
    device = PtyDevice(tmp_path)
    link = run(LiveLink(f'serial://{device.path}:57600'))
    link.wait_open()

    def fill(now: float) -> None:
        for _ in range(3000):
            link.endpoint.heartbeat.send(now, link.endpoint.outgoing)

    link.ask(fill)
    link.ask(lambda now: None)
    before = link.endpoint.turns
    threading.Event().wait(0.2)
    assert link.endpoint.turns - before < 10
    assert link.link.state().traffic.frames_dropped > 0
    device.pull_out()


def heard(link: LiveLink, other: OpenChannel) -> int:
    """Have a link hear somebody, and return how many greetings there were by then."""
    count = len(link.endpoint.heard) + 1
    other.broadcast(heartbeat_frame(LIGHT))
    link.endpoint.heard.wait_for(lambda heard: True, count=count)
    return len(link.endpoint.greetings)


def test_nobody_is_greeted_again_while_somebody_is_heard(
    run: Run, clock: Jump, channel: Callable[[str], OpenChannel],
) -> None:
    other = channel('memory://talk')
    link = run(LiveLink('memory://talk', clock=clock))
    link.wait_open()
    greeted = heard(link, other)
    for _ in range(3):
        jump(link, clock, SILENCE - 0.5)
        assert heard(link, other) == greeted


@pytest.mark.parametrize('before', [False, True], ids=['nobody yet', 'nobody any more'])
def test_greetings_go_out_while_nobody_is_heard(
    run: Run, clock: Jump, channel: Callable[[str], OpenChannel], before: bool,
) -> None:
    # A router that has restarted passes nothing on to whom it has not heard.
    link = run(LiveLink('memory://silence', clock=clock))
    link.wait_open()
    if before:
        heard(link, channel('memory://silence'))
        jump(link, clock, SILENCE - KNOCK_INTERVAL)
    greeted = len(link.endpoint.greetings)
    for count in range(1, 4):
        jump(link, clock, KNOCK_INTERVAL)
        link.endpoint.greetings.wait_for(lambda at: True, count=greeted + count)


def test_greetings_come_often_enough_and_not_more_often(run: Run, clock: Jump) -> None:
    # Our heartbeat at a router and then the other side's must both have come within a second.
    link = run(LiveLink('memory://alone', clock=clock))
    link.endpoint.greetings.wait_for(lambda at: True, count=4)
    moments = list(link.endpoint.greetings)
    assert min(b - a for a, b in zip(moments, moments[1:], strict=False)) >= 0.25
    assert KNOCK_INTERVAL <= 0.25


def test_noise_is_no_sign_of_life(run: Run, clock: Jump) -> None:
    port = free_port()
    link = run(LiveLink(f'udpin://127.0.0.1:{port}', clock=clock))
    link.wait_open()
    with bound_socket() as noisy:
        for count in (2, 3):
            noisy.sendto(b'\xfd\xfe noise', ('127.0.0.1', port))
            jump(link, clock, KNOCK_INTERVAL)
            assert link.endpoint.greetings.wait_for(lambda at: True, count=count)


def test_good_frames_behind_a_false_start_are_taken_at_the_moment_that_it_is_given_up() -> None:
    endpoint = Talker()
    link = SimulatedLink(endpoint, lambda data, peer: None)
    came_at = []
    monitored = endpoint.receive

    def receive(source: Source, message: object, now: float) -> None:
        came_at.append(now)
        monitored(source, message, now)

    endpoint.receive = receive  # type: ignore[method-assign]
    begun = link.now
    link.receive((heartbeat_frame(LIGHT), 'peer'))
    link.receive((b'\xfe\xfa\x00\x01\x01\x6e' + heartbeat_frame(LIGHT), 'peer'))
    link.run(2.0)
    link.stop()
    assert came_at == [begun, begun + STALL]
