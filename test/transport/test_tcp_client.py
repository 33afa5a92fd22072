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

"""TCP channels that connect."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import socket
import struct
from typing import Any

from illuminator_ros.mavlink.transport import ChannelLost, open_channel, tcp
from illuminator_ros.mavlink.url import parse_url
import pytest
from support.open_channel import bound_socket, listening_socket, OpenChannel
from support.ports import free_port

OpenFunction = Callable[[str], OpenChannel]


@pytest.fixture
def server(loopback: str) -> Iterator[socket.socket]:
    """Return a socket that listens."""
    with listening_socket(loopback) as one:
        yield one


@pytest.fixture
def ours(channel: OpenFunction, loopback: str, server: socket.socket) -> OpenChannel:
    """Return a channel to it."""
    return channel(f'tcp://{loopback}:{server.getsockname()[1]}')


def test_bytes_go_both_ways(ours: OpenChannel, server: socket.socket) -> None:
    with server.accept()[0] as other:
        other.sendall(b'hello')
        ours.broadcast(b'frame')
        assert ours.receive_bytes(5) == b'hello'
        assert other.recv(100) == b'frame'


def test_nothing_waits_for_more_to_be_sent(ours: OpenChannel) -> None:
    ours_socket: Any = next(iter(ours.selector.get_map().values())).fileobj
    assert ours_socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


def test_a_peer_that_stays_silent_is_found_out_within_seconds(ours: OpenChannel) -> None:
    ours_socket: Any = next(iter(ours.selector.get_map().values())).fileobj
    milliseconds = ours_socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT)
    assert 0 < milliseconds <= 2000
    # That is for what was sent; where nothing is, the kernel asks.
    assert ours_socket.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
    idle, interval, count = (ours_socket.getsockopt(socket.IPPROTO_TCP, option) for option in (
        socket.TCP_KEEPIDLE, socket.TCP_KEEPINTVL, socket.TCP_KEEPCNT))
    assert idle + interval * count <= 5


def test_a_server_that_ends_is_a_lost_channel(ours: OpenChannel, server: socket.socket) -> None:
    server.accept()[0].close()
    with pytest.raises(ChannelLost, match='the other side closed the connection'):
        ours.receive()


def test_a_connection_that_is_reset_is_a_lost_channel(
    ours: OpenChannel, server: socket.socket,
) -> None:
    other = server.accept()[0]
    other.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack('ii', 1, 0))
    other.close()
    with pytest.raises(ChannelLost, match='reset'):
        ours.receive()


def test_sending_to_who_is_gone_is_a_lost_channel(
    ours: OpenChannel, server: socket.socket,
) -> None:
    other = server.accept()[0]
    other.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack('ii', 1, 0))
    other.close()
    ours.selector.select(5)
    with pytest.raises(ChannelLost):
        for _ in range(3):
            ours.broadcast(b'frame')


def test_nobody_listening_is_said_with_the_address() -> None:
    port = free_port(socket.SOCK_STREAM)
    with pytest.raises(OSError, match=f'cannot connect to 127.0.0.1:{port}: Connection refused'):
        open_channel(parse_url(f'tcp://127.0.0.1:{port}'))


@contextlib.contextmanager
def silent_server() -> Iterator[int]:
    """Return the port of a server that does not answer any more: the kernel drops its input."""
    with bound_socket(kind=socket.SOCK_STREAM) as server, contextlib.ExitStack() as clients:
        server.listen(0)
        for _ in range(4):
            client = clients.enter_context(socket.socket())
            client.setblocking(False)
            client.connect_ex(server.getsockname())
        yield server.getsockname()[1]


def test_who_does_not_answer_is_given_up_in_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tcp, 'CONNECT_TIMEOUT', 0.05)
    with silent_server() as port, pytest.raises(OSError, match=f'no answer from 127.0.0.1:{port}'):
        open_channel(parse_url(f'tcp://127.0.0.1:{port}'))


def test_the_addresses_of_a_name_share_the_time_there_is(monkeypatch: pytest.MonkeyPatch) -> None:
    waits = []

    class Watched(socket.socket):

        def connect(self, address: Any) -> None:
            waits.append(self.gettimeout())
            raise TimeoutError

    monkeypatch.setattr(tcp.socket, 'socket', Watched)
    monkeypatch.setattr(tcp, 'resolve', lambda address, kind: [
        (socket.AF_INET, ('192.0.2.1', 1)), (socket.AF_INET, ('192.0.2.2', 1))])
    with pytest.raises(OSError, match='no answer'):
        open_channel(parse_url('tcp://somewhere:1'))
    assert sum(waits) == pytest.approx(tcp.CONNECT_TIMEOUT)


def test_the_second_address_of_a_name_is_tried_too(
    channel: OpenFunction, monkeypatch: pytest.MonkeyPatch,
) -> None:
    nobody = free_port(socket.SOCK_STREAM)
    with listening_socket() as server:
        monkeypatch.setattr(tcp, 'resolve', lambda address, kind: [
            (socket.AF_INET, ('127.0.0.1', nobody)), (socket.AF_INET, server.getsockname())])
        channel('tcp://somewhere:1').broadcast(b'frame')
        with server.accept()[0] as other:
            assert other.recv(100) == b'frame'


def test_a_connection_with_itself_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    # The kernel makes such a connection if the free port that it picks is the target.
    class Selfish(socket.socket):

        def connect(self, address: Any) -> None:
            self.bind(address)
            super().connect(address)

    monkeypatch.setattr(tcp.socket, 'socket', Selfish)
    with pytest.raises(OSError, match='no program listens'):
        open_channel(parse_url(f'tcp://127.0.0.1:{free_port(socket.SOCK_STREAM)}'))
