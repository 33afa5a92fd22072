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

"""Reports of the openings and losses of a link, and their rate."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import socket
from typing import Any

from illuminator_ros.mavlink import connector as opener
from illuminator_ros.mavlink import link as link_module
from illuminator_ros.mavlink.connector import FIRST_PAUSE
from illuminator_ros.mavlink.link_state import MAX_REASONS
from illuminator_ros.mavlink.transport import ChannelLost, open_channel
import pytest
from support.frames import LIGHT
from support.heartbeats import heartbeat_frame
from support.live_link import LiveLink
from support.open_channel import bound_socket, listening_socket
from support.ports import free_port
from support.waiting import Log

Run = Callable[[LiveLink], LiveLink]


@pytest.fixture
def port() -> int:
    """Return a free TCP port."""
    return free_port(socket.SOCK_STREAM)


def test_an_opening_is_reported_once(run: Run, port: int) -> None:
    with listening_socket(port=port) as server:
        link = run(LiveLink(f'tcp://127.0.0.1:{port}'))
        with server.accept()[0] as connection:
            connection.sendall(heartbeat_frame())
            link.endpoint.wait_for(LIGHT)
            assert [event.is_open for event in link.events] == [True]


def served_once(run: Run, port: int) -> LiveLink:
    """Return a link whose server has gone, after it had worked."""
    with listening_socket(port=port) as server:
        link = run(LiveLink(f'tcp://127.0.0.1:{port}'))
        connection = server.accept()[0]
    # Without a listener, the link cannot be in a queue when the connection ends.
    with connection:
        connection.sendall(heartbeat_frame())
        link.endpoint.wait_for(LIGHT)
    return link


def test_a_reason_for_not_opening_is_reported_once(
    run: Run, port: int, monkeypatch: pytest.MonkeyPatch,
) -> None:
    tries = count_tries(monkeypatch)
    link = run(LiveLink(f'tcp://127.0.0.1:{port}'))
    tries.wait_for(lambda one: True, count=4)
    assert link.history() == [False]
    assert link.events[0].reason == (
        f'cannot connect to 127.0.0.1:{port}: Connection refused')
    assert str(link.events[0]) == (
        f'link not open: tcp://127.0.0.1:{port}: {link.events[0].reason}; trying again')


def count_tries(monkeypatch: pytest.MonkeyPatch) -> Log[Any]:
    """Return a log that gets an entry for each try to open a link."""
    tries: Log[Any] = Log()

    def watched(url: Any) -> Any:
        tries.append(url)
        return open_channel(url)

    monkeypatch.setattr(opener, 'open_channel', watched)
    return tries


def test_a_loss_and_a_return_are_one_event_each(run: Run, port: int) -> None:
    link = served_once(run, port)
    link.wait_lost()
    with listening_socket(port=port) as server, server.accept()[0]:
        link.wait_open(2)
        assert link.history() == [True, False, True]
        name = f'tcp to 127.0.0.1:{port}'
        assert list(map(str, link.events)) == [
            f'link open: {name}',
            f'link lost: {name}: {link.events[1].reason}; trying again',
            f'link open: {name}']
        assert link.events[1].reason


def test_tries_after_a_loss_are_not_reported(
    run: Run, port: int, monkeypatch: pytest.MonkeyPatch,
) -> None:
    tries = count_tries(monkeypatch)
    link = served_once(run, port)
    tries.wait_for(lambda one: True, count=len(tries) + 4)
    assert link.history() == [True, False]


@pytest.fixture
def endless_probation(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have no channel count as one that leads somewhere for the time alone that it was open."""
    monkeypatch.setattr(link_module, 'PROBATION', 3600.0)


@pytest.fixture
def door(port: int) -> Iterator[socket.socket]:
    """Return a server that takes connections, for who drops them at once."""
    with listening_socket(port=port) as server:
        yield server


def slam(door: socket.socket, times: int) -> None:
    """Take connections and drop them at once, as a forwarded port without a program does."""
    for _ in range(times):
        door.accept()[0].close()


def test_a_server_that_drops_every_connection_is_reported_once(
    run: Run, port: int, door: socket.socket, endless_probation: None,
) -> None:
    link = run(LiveLink(f'tcp://127.0.0.1:{port}'))
    slam(door, 5)
    assert link.history()[:2] == [True, False]
    assert len(link.events) == 2


def test_a_server_that_drops_every_connection_is_asked_more_and_more_rarely(
    run: Run, port: int, door: socket.socket, monkeypatch: pytest.MonkeyPatch,
    endless_probation: None,
) -> None:
    pauses = record_pauses(monkeypatch)
    run(LiveLink(f'tcp://127.0.0.1:{port}'))
    slam(door, 5)
    assert [pauses[i] for i in range(5)] == [0.0, 0.05, 0.1, 0.2, 0.4]


def record_pauses(monkeypatch: pytest.MonkeyPatch) -> Log[float]:
    """Return a log of the pauses before tries, which take the longest that they may be."""
    pauses: Log[float] = Log()

    class Recorded(opener.Backoff):

        def __init__(self) -> None:
            super().__init__(lambda: 1.0)

        def pause(self, spent: float) -> float:
            pauses.append(super().pause(0.0))
            return pauses[-1]

    monkeypatch.setattr(opener, 'Backoff', Recorded)
    return pauses


def test_a_server_that_has_dropped_connections_is_open_once_it_says_something(
    run: Run, port: int, door: socket.socket, endless_probation: None,
) -> None:
    link = run(LiveLink(f'tcp://127.0.0.1:{port}'))
    slam(door, 2)
    with door.accept()[0] as connection:
        connection.sendall(heartbeat_frame())
        link.wait_open(2)
        assert link.history() == [True, False, True]
        assert link.link.state().is_open


def test_a_server_that_has_dropped_connections_is_open_once_it_keeps_one(
    run: Run, port: int, door: socket.socket, monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(link_module, 'PROBATION', 0.2)
    link = run(LiveLink(f'tcp://127.0.0.1:{port}'))
    slam(door, 2)
    with door.accept()[0]:
        assert link.wait_open(2)


def test_a_link_that_has_worked_is_tried_again_at_once(
    run: Run, port: int, monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(link_module, 'PROBATION', 0.0)
    pauses = record_pauses(monkeypatch)
    with listening_socket(port=port) as server:
        link = run(LiveLink(f'tcp://127.0.0.1:{port}'))
        for count in (1, 2, 3):
            with server.accept()[0] as connection:
                connection.sendall(heartbeat_frame())
                link.endpoint.heard.wait_for(lambda heard: True, count=count)
    link.wait_lost(3)
    assert [pauses[i] for i in range(3)] == [0.0, 0.0, 0.0]


def test_a_server_that_speaks_and_closes_is_given_a_pause(
    run: Run, port: int, monkeypatch: pytest.MonkeyPatch, endless_probation: None,
) -> None:
    pauses = record_pauses(monkeypatch)
    with listening_socket(port=port) as server:
        link = run(LiveLink(f'tcp://127.0.0.1:{port}'))
        for count in (1, 2, 3):
            with server.accept()[0] as connection:
                connection.sendall(heartbeat_frame())
                link.endpoint.heard.wait_for(lambda heard: True, count=count)
    link.wait_lost(3)
    assert [pauses[i] for i in range(3)] == [0.0, FIRST_PAUSE, FIRST_PAUSE]


def test_a_remote_without_a_way_to_it_is_not_open_and_reported_once(
    run: Run, monkeypatch: pytest.MonkeyPatch,
) -> None:
    # The socket can be opened, but nothing can be sent.
    tries = no_way_out(monkeypatch)
    link = run(LiveLink('udpout://127.0.0.1:9'))
    tries.wait_for(lambda one: True, count=4)
    assert link.history() == [False]
    assert link.events[0].reason == 'Network is unreachable'
    assert not link.link.state().is_open


def no_way_out(monkeypatch: pytest.MonkeyPatch) -> Log[Any]:
    """Have nothing that is opened able to send; return a log of the tries."""
    tries: Log[Any] = Log()

    def opened(url: Any) -> Any:
        channel = open_channel(url)

        def send(frames: Any, peers: Any) -> None:
            raise ChannelLost(101, 'Network is unreachable')

        monkeypatch.setattr(channel, 'send', send)
        tries.append(url)
        return channel

    monkeypatch.setattr(opener, 'open_channel', opened)
    return tries


def test_many_reasons_for_not_opening_are_reported_up_to_a_limit(
    run: Run, monkeypatch: pytest.MonkeyPatch,
) -> None:
    tries: Log[int] = Log()

    def fail(url: Any) -> Any:
        tries.append(len(tries))
        raise OSError(f'reason {len(tries)}')

    monkeypatch.setattr(opener, 'open_channel', fail)
    monkeypatch.setattr(opener, 'LAST_PAUSE', 0.001)
    link = run(LiveLink('udpout://127.0.0.1:9'))
    tries.wait_for(lambda one: True, count=40)
    assert link.ask(lambda now: len(link.events)) == MAX_REASONS


def test_a_taken_port_opens_once_it_is_free(run: Run) -> None:
    with contextlib.ExitStack() as stack:
        taken = stack.enter_context(bound_socket())
        link = run(LiveLink(f'udpin://127.0.0.1:{taken.getsockname()[1]}'))
        link.wait_lost()
        stack.close()
        link.wait_open()
        assert link.history() == [False, True]
