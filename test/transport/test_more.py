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

"""The amount of one read, and whether more is available."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import errno
from pathlib import Path
import socket
from typing import Any

from illuminator_ros.mavlink.transport import ChannelLost, serial, tcp, udp
import pytest
from support.open_channel import bound_socket, listening_socket, OpenChannel
from support.ports import free_port
from support.ptys import PtyDevice
from support.waiting import PATIENCE

OpenFunction = Callable[[str], OpenChannel]
Pair = tuple[OpenChannel, Callable[[bytes], Any]]
SIZE = 4


@pytest.fixture(autouse=True)
def _little_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tcp, 'READ_SIZE', SIZE)
    monkeypatch.setattr(serial, 'READ_SIZE', SIZE)
    monkeypatch.setattr(udp, 'BATCH', SIZE)


@pytest.fixture(params=['client', 'server', 'serial'])
def stream(
    request: pytest.FixtureRequest, channel: OpenFunction, tmp_path: Path,
) -> Iterator[Pair]:
    """Return a channel that carries a stream, and what writes to its other side."""
    if request.param == 'serial':
        pytest.importorskip('serial', reason='pyserial is not installed')
        device = PtyDevice(tmp_path)
        yield channel(f'serial://{device.path}:57600'), device.write
        device.pull_out()
    elif request.param == 'client':
        with listening_socket() as listener:
            ours = channel(f'tcp://127.0.0.1:{listener.getsockname()[1]}')
            with listener.accept()[0] as other:
                yield ours, other.sendall
    else:
        port = free_port(socket.SOCK_STREAM)
        ours = channel(f'tcpin://127.0.0.1:{port}')
        with socket.create_connection(('127.0.0.1', port), PATIENCE) as other:
            ours.turn(PATIENCE)
            yield ours, other.sendall


def test_of_a_stream_there_may_be_more_where_as_much_came_as_was_asked_for(stream: Pair) -> None:
    ours, write = stream
    write(b'123456')
    assert ours.receive_bytes(SIZE) == b'1234'
    assert ours.channel.more
    assert ours.receive_bytes(2) == b'56'
    assert not ours.channel.more


@pytest.fixture
def port() -> int:
    """Return a port for a channel to listen on."""
    return free_port()


@pytest.fixture
def ours(channel: OpenFunction, port: int) -> OpenChannel:
    """Return a channel that listens on it."""
    return channel(f'udpin://127.0.0.1:{port}')


def test_of_datagrams_there_may_be_more_where_as_many_came_as_were_asked_for(
    ours: OpenChannel, port: int,
) -> None:
    with bound_socket() as other:
        for _ in range(SIZE + 1):
            other.sendto(b'x', ('127.0.0.1', port))
        assert [data for _, data in ours.receive()] == [b'x', (SIZE - 1) * b'x']
        assert ours.channel.more
        assert [data for _, data in ours.receive()] == [b'x']
        assert not ours.channel.more


def test_behind_the_first_datagrams_that_a_peer_sends_in_a_row_come_as_one_piece(
    ours: OpenChannel, port: int,
) -> None:
    with bound_socket() as one, bound_socket() as other:
        for sender, data in ((one, b'a'), (one, b'b'), (one, b'c'), (other, b'd')):
            sender.sendto(data, ('127.0.0.1', port))
        names = {one.getsockname(): 'one', other.getsockname(): 'other'}
        assert [(names[peer], data) for peer, data in ours.receive()] == [
            ('one', b'a'), ('one', b'bc'), ('other', b'd')]


class _LostSocket:
    """Has one datagram, and is then of no use."""

    def __init__(self) -> None:
        self._left = [b'last']

    def recvfrom(self, size: int) -> tuple[bytes, Any]:
        if not self._left:
            raise OSError(errno.ENETDOWN, 'network is down')
        return self._left.pop(), ('127.0.0.1', 14550)


def test_what_came_before_the_channel_was_lost_is_not_lost(ours: OpenChannel) -> None:
    channel: Any = ours.channel
    real, channel._socket = channel._socket, _LostSocket()
    coming = channel.receive(real)
    assert next(coming) == (('127.0.0.1', 14550), b'last')
    with pytest.raises(ChannelLost):
        next(coming)
    channel._socket = real


def test_of_large_datagrams_only_a_few_are_read_at_a_time(
    channel: OpenFunction, monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(udp, 'BATCH_SIZE', 10)
    port = free_port()
    ours = channel(f'udpin://127.0.0.1:{port}')
    with bound_socket() as other:
        for _ in range(SIZE):
            other.sendto(b'garbage', ('127.0.0.1', port))
        assert len(ours.receive_bytes(14)) == 14
        assert ours.channel.more
