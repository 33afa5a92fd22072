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

"""Two hundred losses and returns leave nothing behind: no thread, no descriptor, no event."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from illuminator_ros.mavlink import connector as opener
from illuminator_ros.mavlink.transport.udp import MAX_PEERS, PEER_EXPIRY
import pytest
from support.frames import LIGHT
from support.heartbeats import heartbeat_frame
from support.live_link import Jump, LiveLink, resources, wait_for_openers, wait_for_resources
from support.open_channel import bound_socket, listening_socket
from support.ports import free_port
from support.ptys import PtyDevice
from support.waiting import eventually

CYCLES = 8


@pytest.fixture(autouse=True)
def _short_pauses(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make tries follow each other quickly: there are many of them, and some must fail."""
    monkeypatch.setattr(opener, 'FIRST_PAUSE', 0.002)
    monkeypatch.setattr(opener, 'LAST_PAUSE', 0.002)


def cycle(link: LiveLink, come: Callable[[], None], go: Callable[[], None]) -> None:
    """Have the other side come and go, and check what is left of it."""
    come()
    link.wait_open()
    wait_for_openers()
    before = resources()
    for count in range(1, CYCLES + 1):
        go()
        link.wait_lost(count)
        come()
        link.wait_open(count + 1)
    wait_for_openers()
    wait_for_resources(*before)
    assert link.history() == [True] + CYCLES * [False, True]


def test_a_tcp_server_that_is_restarted(run: Callable[[LiveLink], LiveLink]) -> None:
    server = listening_socket()
    port = server.getsockname()[1]
    link = run(LiveLink(f'tcp://127.0.0.1:{port}'))
    sockets = [server]

    def come() -> None:
        if not sockets:
            sockets.append(listening_socket(port=port))
        sockets.append(sockets[0].accept()[0])
        sockets[1].sendall(heartbeat_frame())

    def go() -> None:
        # A message must arrive, otherwise the connection was not used.
        link.endpoint.heard.wait_for(lambda heard: True, count=link.history().count(True))
        # The listener first, or the link would be in its queue before it is gone.
        while sockets:
            sockets.pop(0).close()

    cycle(link, come, go)
    go()


def test_a_tcp_client_that_comes_and_goes(run: Callable[[LiveLink], LiveLink]) -> None:
    import socket
    port = free_port(socket.SOCK_STREAM)
    link = run(LiveLink(f'tcpin://127.0.0.1:{port}'))
    link.wait_open()
    before = resources()
    for count in range(1, CYCLES + 1):
        with socket.create_connection(('127.0.0.1', port)) as client:
            client.sendall(heartbeat_frame())
            link.endpoint.heard.wait_for(lambda heard: True, count=count)
    wait_for_resources(*before)
    assert link.history() == [True]


def test_a_serial_device_that_is_pulled_out_and_plugged_in(
    run: Callable[[LiveLink], LiveLink], tmp_path: Path,
) -> None:
    pytest.importorskip('serial', reason='pyserial is not installed')
    device = PtyDevice(tmp_path)
    link = run(LiveLink(f'serial://{device.path}:57600'))
    plugged = [True]

    def come() -> None:
        if not plugged:
            device.plug_in()
            plugged.append(True)

    def go() -> None:
        # It counts as working, and its loss is answered at once, after something good.
        device.write(heartbeat_frame())
        link.endpoint.heard.wait_for(lambda heard: True, count=link.history().count(True))
        device.pull_out()
        plugged.clear()

    cycle(link, come, go)
    device.pull_out()


def test_a_udp_peer_that_takes_another_port_each_time(
    run: Callable[[LiveLink], LiveLink],
) -> None:
    port = free_port()
    clock = Jump()
    link = run(LiveLink(f'udpin://127.0.0.1:{port}', clock=clock))
    link.wait_open()
    before = resources()
    for count in range(1, CYCLES + 1):
        with bound_socket() as light:
            light.sendto(heartbeat_frame(), ('127.0.0.1', port))
            # It is a peer, whatever was before: it is greeted.
            assert light.recv(300)
            link.endpoint.wait_for(LIGHT, since=count - 1)
        clock.ahead += PEER_EXPIRY / MAX_PEERS + 0.1
    wait_for_resources(*before)
    assert link.history() == [True]
    clock.ahead += PEER_EXPIRY + 1
    assert link.state().peers == 0


def test_a_link_that_is_made_and_ended() -> None:
    def one() -> None:
        link = LiveLink('udpin://127.0.0.1:0'.replace(':0', f':{free_port()}'))
        link.wait_open()
        link.stop()

    one()
    before = resources()
    for _ in range(CYCLES):
        one()
    eventually(lambda: resources() == before, 'as many threads and descriptors as before')


def test_a_link_that_is_never_started(monkeypatch: pytest.MonkeyPatch) -> None:
    from illuminator_ros.mavlink.link import Link
    from illuminator_ros.mavlink.url import parse_url
    from support.live_link import Talker
    before = resources()
    links: list[Any] = [
        Link(parse_url('memory://x'), Talker(), label='x') for _ in range(10)]
    for link in links:
        link.stop()
    assert resources() == before
