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

"""CommandStatus a link: from any thread, at any moment, and with nothing left open."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import socket
import threading
from typing import Any

from illuminator_ros.mavlink import connector as opener
from illuminator_ros.mavlink.transport import resolve, tcp
import pytest
from support.frames import LIGHT
from support.heartbeats import heartbeat_frame
from support.live_link import LiveLink, resources, wait_for_openers, wait_for_resources
from support.open_channel import bound_socket, listening_socket
from support.ports import free_port
from support.waiting import Log, PATIENCE


@pytest.fixture(autouse=True)
def _nothing_left() -> Iterator[None]:
    """Check that a link leaves no thread and no descriptor."""
    before = resources()
    yield
    wait_for_openers()
    wait_for_resources(*before)


@pytest.mark.parametrize('url', [
    'memory://stop', 'udpin://127.0.0.1:{port}', 'udpout://127.0.0.1:9',
    'tcpin://127.0.0.1:{port}', 'tcp://127.0.0.1:{port}',
    'serial:///dev/illuminator_ros_has_no_such_device:57600'])
def test_a_link_ends_when_it_is_told_to(url: str) -> None:
    link = LiveLink(url.format(port=free_port(socket.SOCK_STREAM)))
    link.events.wait_for(lambda event: True)
    link.stop()
    assert link.has_ended()


def test_a_link_ends_before_it_has_opened_anything() -> None:
    for _ in range(100):
        link = LiveLink(f'udpin://127.0.0.1:{free_port()}')
        link.stop()
        assert link.has_ended()


def test_a_link_with_traffic_ends() -> None:
    port = free_port()
    link = LiveLink(f'udpin://127.0.0.1:{port}')
    link.wait_open()
    stopping = threading.Event()

    def flood() -> None:
        with bound_socket() as sender:
            while not stopping.is_set():
                sender.sendto(heartbeat_frame(), ('127.0.0.1', port))

    thread = threading.Thread(target=flood)
    thread.start()
    link.endpoint.wait_for(LIGHT)
    link.stop()
    assert link.has_ended()
    stopping.set()
    thread.join()


def test_a_link_may_be_ended_twice_and_by_many() -> None:
    link = LiveLink('memory://stop')
    link.wait_open()
    threads = [threading.Thread(target=link.stop) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE)
    link.stop()
    assert link.has_ended()


def test_a_link_may_be_ended_in_its_own_thread() -> None:
    link = LiveLink('memory://stop')
    link.wait_open()
    link.ask(lambda now: link.link.stop())
    link.link._thread.join(PATIENCE)
    assert link.has_ended()


def test_a_link_may_be_ended_by_who_hears_that_it_is_open() -> None:
    links: Log[Any] = Log()
    link = LiveLink('memory://stop', on_event=lambda event: links.wait_for(
        lambda link: True).link.stop())
    links.append(link)
    link.link._thread.join(PATIENCE)
    link.stop()
    assert link.has_ended()


def test_a_link_that_was_ended_does_not_start() -> None:
    link = LiveLink('memory://stop')
    link.stop()
    link.link.start()
    assert link.has_ended()


@contextlib.contextmanager
def ended_while_opening() -> Iterator[Callable[[str], None]]:
    """Return a function that begins to open a URL, whose link then ends all the same."""
    links: list[LiveLink] = []

    def end(url: str) -> None:
        links.append(LiveLink(url))

    yield end
    links[0].stop()
    assert links[0].has_ended()


def test_a_link_ends_while_a_name_is_looked_up(monkeypatch: pytest.MonkeyPatch) -> None:
    # A name server that does not answer takes tens of seconds.
    asked, answer = threading.Event(), threading.Event()

    def getaddrinfo(*arguments: Any, **named: Any) -> Any:
        asked.set()
        answer.wait(2 * PATIENCE)
        return genuine(*arguments, **named)

    genuine = socket.getaddrinfo
    monkeypatch.setattr(resolve.socket, 'getaddrinfo', getaddrinfo)
    with ended_while_opening() as end:
        end('udpout://127.0.0.1:9')
        assert asked.wait(PATIENCE)
    # A late channel is closed again, which the fixture checks.
    answer.set()


def test_a_link_ends_while_it_connects_to_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    connecting = threading.Event()
    genuine = tcp._connect

    def connect(address: Any) -> Any:
        connecting.set()
        return genuine(address)

    monkeypatch.setattr(tcp, 'CONNECT_TIMEOUT', 2 * PATIENCE)
    monkeypatch.setattr(tcp, '_connect', connect)
    with bound_socket(kind=socket.SOCK_STREAM) as silent, contextlib.ExitStack() as clients:
        # Its queue is full, so that the kernel drops what comes.
        silent.listen(0)
        for _ in range(4):
            client = clients.enter_context(socket.socket())
            client.setblocking(False)
            client.connect_ex(silent.getsockname())
        with ended_while_opening() as end:
            end(f'tcp://127.0.0.1:{silent.getsockname()[1]}')
            assert connecting.wait(PATIENCE)


def test_what_opens_at_the_moment_of_ending_is_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    genuine = opener.open_channel
    opened, go_on = threading.Event(), threading.Event()

    def open_late(url: Any) -> Any:
        channel = genuine(url)
        opened.set()
        go_on.wait(2 * PATIENCE)
        return channel

    monkeypatch.setattr(opener, 'open_channel', open_late)
    with ended_while_opening() as end:
        end(f'udpin://127.0.0.1:{free_port()}')
        assert opened.wait(PATIENCE)
    go_on.set()


def test_what_was_opened_and_not_taken_yet_is_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    genuine = opener.open_channel
    inside, go_on = threading.Event(), threading.Event()

    def open_behind(url: Any) -> Any:
        assert inside.wait(PATIENCE)
        return genuine(url)

    monkeypatch.setattr(opener, 'open_channel', open_behind)
    link = LiveLink(f'udpin://127.0.0.1:{free_port()}')

    def hold(now: float) -> None:
        inside.set()
        go_on.wait(PATIENCE)

    # The channel comes behind this call and behind the end.
    link.link.call(hold)
    assert inside.wait(PATIENCE)
    wait_for_openers()
    threading.Thread(target=link.stop).start()
    while not link.link._stopping.is_set():
        threading.Event().wait(0.001)
    go_on.set()
    link.stop()
    assert link.has_ended()
    assert link.history() == []


def test_an_ended_link_tells_that_it_is_closed() -> None:
    link = LiveLink('memory://stop')
    link.wait_open()
    link.stop()
    assert not link.link.state().is_open


def test_a_connection_is_closed_with_the_link() -> None:
    with listening_socket() as server:
        link = LiveLink(f'tcp://127.0.0.1:{server.getsockname()[1]}')
        with server.accept()[0] as connection:
            link.wait_open()
            link.stop()
            data = b'x'
            while data:
                data = connection.recv(300)
