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

"""TCP channels that listen: several clients on one link."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import errno
import socket
import struct
from typing import Any

from illuminator_ros.mavlink.transport import ChannelLost
from illuminator_ros.mavlink.transport.tcp import EXPIRY, MAX_CLIENTS
import pytest
from support.open_channel import free_port, OpenChannel
from support.waiting import PATIENCE


@pytest.fixture
def port(loopback: str) -> int:
    """Return a port to listen on."""
    return free_port(socket.SOCK_STREAM, loopback)


@pytest.fixture
def ours(channel: Callable[[str], OpenChannel], loopback: str, port: int) -> OpenChannel:
    """Return a channel that listens."""
    return channel(f'tcpin://{loopback}:{port}')


Connect = Callable[[], socket.socket]


@pytest.fixture
def connect(ours: OpenChannel, loopback: str, port: int) -> Iterator[Connect]:
    """Return a function that makes a client, which the server has taken."""
    with contextlib.ExitStack() as clients:
        def one() -> socket.socket:
            client = socket.create_connection((loopback.strip('[]'), port), PATIENCE)
            clients.enter_context(client)
            ours.turn(PATIENCE)
            return client
        yield one


def say(ours: OpenChannel, client: socket.socket, data: bytes = b'hello') -> Any:
    """Have a client send something, and return the peer that it comes from."""
    client.sendall(data)
    ((peer, received),) = ours.receive()
    assert received == data
    return peer


def is_closed(client: socket.socket) -> bool:
    """Return whether the other side has closed a connection, waiting for it or for data."""
    return client.recv(100) == b''


def test_all_clients_are_heard(ours: OpenChannel, connect: Connect) -> None:
    one, other = connect(), connect()
    assert say(ours, one) != say(ours, other)


def test_a_broadcast_goes_to_all_clients(ours: OpenChannel, connect: Connect) -> None:
    clients = [connect(), connect()]
    ours.broadcast(b'frame')
    assert [client.recv(100) for client in clients] == [b'frame', b'frame']


def test_what_is_sent_to_one_client_goes_to_no_other(ours: OpenChannel, connect: Connect) -> None:
    one, other = connect(), connect()
    peer = say(ours, one)
    ours.channel.send([b'to one'], [peer])
    ours.broadcast(b'to all')
    assert other.recv(100) == b'to all'


def test_a_client_that_leaves_is_no_loss(ours: OpenChannel, connect: Connect) -> None:
    one, other = connect(), connect()
    one.close()
    ours.turn(PATIENCE)
    ours.broadcast(b'frame')
    assert other.recv(100) == b'frame'
    assert len(ours.channel.peers(0.0)) == 1


def test_a_client_that_is_reset_while_it_is_sent_to_is_no_loss(
    ours: OpenChannel, connect: Connect,
) -> None:
    one, other = connect(), connect()
    one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack('ii', 1, 0))
    one.close()
    for _ in range(3):
        ours.broadcast(b'frame')
    assert other.recv(5) == b'frame'
    assert len(ours.channel.peers(0.0)) == 1


def test_a_client_is_new_with_its_first_good_frame(ours: OpenChannel, connect: Connect) -> None:
    peer = say(ours, connect())
    assert [ours.channel.heard(peer, 0.0), ours.channel.heard(peer, 0.0)] == [True, False]


def test_nothing_is_kept_of_a_client_that_has_left(ours: OpenChannel, connect: Connect) -> None:
    channel: Any = ours.channel
    client = connect()
    channel.heard(say(ours, client), 0.0)
    client.close()
    ours.turn(PATIENCE)
    assert (len(channel._clients), len(channel._heard)) == (0, 0)


def test_a_client_more_than_there_is_room_for_is_turned_away(
    ours: OpenChannel, connect: Connect,
) -> None:
    for _ in range(MAX_CLIENTS):
        ours.channel.heard(say(ours, connect()), 0.0)
    assert is_closed(connect())
    assert len(ours.channel.peers(0.0)) == MAX_CLIENTS


def test_a_client_that_never_said_anything_good_makes_room(
    ours: OpenChannel, connect: Connect,
) -> None:
    ours.channel.heard(say(ours, connect()), 0.0)
    silent = [connect() for _ in range(MAX_CLIENTS - 1)]
    newest = connect()
    assert say(ours, newest) in ours.channel.peers(0.0)
    assert is_closed(silent[0])


def test_a_client_that_has_gone_silent_makes_room(
    ours: OpenChannel, connect: Connect,
) -> None:
    clients = [connect() for _ in range(MAX_CLIENTS)]
    for now, client in enumerate(clients):
        ours.channel.heard(say(ours, client), float(now))
    ours.channel.peers(EXPIRY + 0.5)
    newest = connect()
    assert say(ours, newest) in ours.channel.peers(EXPIRY + 0.5)
    assert is_closed(clients[0])


class _FailingListener:
    """Fails to accept, in one way."""

    def __init__(self, real: socket.socket, reason: int) -> None:
        self._real = real
        self._reason = reason

    def accept(self) -> Any:
        raise OSError(self._reason, 'as the test says')

    def close(self) -> None:
        self._real.close()


def failing(ours: OpenChannel, reason: int) -> Any:
    """Return the channel's listener, which now fails to accept."""
    channel: Any = ours.channel
    channel._listener = _FailingListener(channel._listener, reason)
    return channel._listener


@pytest.mark.parametrize('reason', [errno.ECONNABORTED, errno.EAGAIN, errno.EPROTO])
def test_a_client_that_is_gone_before_it_is_taken_is_no_loss(
    ours: OpenChannel, reason: int,
) -> None:
    assert list(ours.channel.receive(failing(ours, reason))) == []


@pytest.mark.parametrize('reason', [errno.EMFILE, errno.ENFILE])
def test_no_descriptor_left_to_accept_with_is_a_loss(ours: OpenChannel, reason: int) -> None:
    # The listener would stay readable and the link's thread would spin.
    with pytest.raises(ChannelLost):
        list(ours.channel.receive(failing(ours, reason)))
