# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Channels that carry a stream: TCP in both directions, and serial lines."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import errno
import fcntl
import os
import socket
import struct
import termios
import tty
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from illuminator_ros.mavlink.errors import ChannelLost
from illuminator_ros.mavlink.frame import Decoder
from illuminator_ros.mavlink.messages import heartbeat
from illuminator_ros.mavlink.transport import base
from illuminator_ros.mavlink.transport.base import FrameQueue, MAX_QUEUED
from illuminator_ros.mavlink.transport.tcp import EXPIRY, MAX_CLIENTS
import pytest
from support.frames import frame_of
from support.open_channel import listening_socket, Open, OpenChannel
from support.ports import free_port
from support.ptys import PtyDevice
from support.waiting import eventually, PATIENCE


def numbered_frame(number: int) -> bytes:
    """Return a heartbeat that has a number as its custom_mode."""
    message = heartbeat(44)
    message.custom_mode = number
    return frame_of(message, number & 0xFF)


def numbers_in(data: bytes) -> list[int]:
    """Return the numbers of the frames in a stream, which must consist of whole frames."""
    decoder = Decoder()
    frames = decoder.feed(data)
    assert b''.join(frame.data for frame in frames) == data
    return [int.from_bytes(frame.payload[:4], 'little') for frame in frames]


# The rate of a serial line

def test_the_rate_of_an_open_serial_port_can_change_and_a_wrong_one_is_an_error(
        channel: Open, device: PtyDevice) -> None:
    one = channel(f'serial://{device.path}:57600').channel
    one.change_rate(921600)
    line = os.open(device.path, os.O_RDWR | os.O_NOCTTY)
    speed = termios.tcgetattr(line)[4]
    os.close(line)

    assert speed == termios.B921600
    assert (one.rate, one.name) == (92160.0, f'serial {device.path} at 921600 baud')
    with pytest.raises(OSError, match='has no -1 baud'):
        one.change_rate(-1)


# Queues of whole frames

@given(st.lists(st.integers(1, 4000) | st.floats(0, 1), max_size=60))
def test_queue_writes_frames_in_order_and_drops_the_oldest_whole_ones_beyond_its_bound(
        steps: list[int | float]) -> None:
    queue, waiting, begun, number = FrameQueue(), list[bytes](), False, 0
    for step in steps:
        if isinstance(step, int):
            number += 1
            frame = number.to_bytes(2, 'big') * step
            dropped = queue.put(frame)
            waiting.append(frame)
            # Half of the first frame may be on the wire.
            del waiting[begun:begun + dropped]
            kept = sum(map(len, waiting))
            assert kept <= MAX_QUEUED or len(waiting) <= begun + 1
            assert not dropped or kept + 8000 > MAX_QUEUED
        elif queue:
            count = int(step * sum(map(len, waiting)))
            queue.written(count)
            while count and count >= len(waiting[0]):
                count -= len(waiting.pop(0))
                begun = False
            if count:
                waiting[0], begun = waiting[0][count:], True
        assert bool(queue) == bool(waiting)
        assert queue.unwritten() == b''.join(waiting)


# Both sides of a stream

class Stream:
    """A channel, and the other side of its stream."""

    def __init__(self, ours: OpenChannel, write: Callable[[bytes], object],
                 read: Callable[[], bytes], close: Callable[[], object]) -> None:
        self.ours, self.write, self.read, self.close = ours, write, read, close


def _read(one: socket.socket) -> bytes:
    one.setblocking(False)
    with contextlib.suppress(BlockingIOError):
        return one.recv(1 << 20)
    return b''


def reset(one: socket.socket) -> None:
    """Close a connection with a reset."""
    one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack('ii', 1, 0))
    one.close()


@pytest.fixture(params=['tcp client', 'tcp server', 'serial'])
def stream(request: pytest.FixtureRequest, channel: Open) -> Iterator[Stream]:
    """Return a stream of each kind, whose other side buffers few unread bytes."""
    if request.param == 'serial':
        device: PtyDevice = request.getfixturevalue('device')
        yield Stream(channel(f'serial://{device.path}:57600'), device.write,
                     lambda: device.read(0), device.pull_out)
        return
    if request.param == 'tcp client':
        with listening_socket() as server:
            server.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            ours = channel(f'tcp://127.0.0.1:{server.getsockname()[1]}')
            other = server.accept()[0]
    else:
        port = free_port(socket.SOCK_STREAM)
        ours, other = channel(f'tcpin://127.0.0.1:{port}'), socket.socket()
        other.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        other.connect(('127.0.0.1', port))
        ours.turn(PATIENCE)
    with other:
        yield Stream(ours, other.sendall, lambda: _read(other), lambda: reset(other))


def test_all_bytes_go_both_ways_unchanged(stream: Stream) -> None:
    # A terminal would interpret some of them.
    every_byte, data = bytes(range(256)), b''
    stream.write(every_byte)
    stream.ours.broadcast(every_byte)
    assert stream.ours.receive_bytes(256) == every_byte
    while len(data) < 256:
        data += eventually(stream.read)
    assert data == every_byte


def test_read_that_fills_the_buffer_says_that_there_may_be_more(
        stream: Stream, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(base, 'READ_SIZE', 4)
    stream.write(b'12345678ab')
    for piece, more in ((b'12345678', True), (b'ab', False)):
        assert (stream.ours.receive_bytes(len(piece)), stream.ours.channel.more) == (piece, more)
    # The second read finds nothing.
    stream.write(b'1234')
    assert (stream.ours.receive_bytes(4), stream.ours.channel.more) == (b'1234', False)


def test_read_of_a_full_terminal_says_that_there_may_be_more(
        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(base, 'MAX_READS', 1)
    far, near = os.openpty()
    tty.setraw(near)
    os.write(far, bytes(2 * base.READ_SIZE))
    eventually(lambda: struct.unpack(
        'i', fcntl.ioctl(near, termios.FIONREAD, bytes(4))) >= (base.READ_SIZE,))

    class Line(base.StreamChannel):

        def close(self) -> None:
            os.close(near)

    line = Line('line', near, 'it has ended')
    assert next(line.receive(near))
    assert line.more
    os.close(far)
    line.close()


def test_line_without_reader_gets_whole_frames_and_the_newest(stream: Stream) -> None:
    ours, sent, data = stream.ours, 0, bytearray()
    while ours.channel.dropped < 100:
        ours.broadcast(numbered_frame(sent))
        sent += 1
        assert sent < 1_000_000

    def all_read() -> bool:
        ours.turn()
        data.extend(stream.read())
        return data.endswith(numbered_frame(sent - 1))

    eventually(all_read, 'the newest frame')
    numbers = numbers_in(bytes(data))
    assert numbers == sorted(numbers)
    assert (len(numbers), ours.channel.dropped) == (sent - 100, 100)


@pytest.mark.parametrize('use', ['receive', 'send'])
def test_other_side_that_is_gone_is_a_loss_but_not_a_client_of_a_server(
        stream: Stream, use: str) -> None:
    ours = stream.ours
    is_server = ours.channel.name.startswith('tcp server')
    stream.close()
    ours.selector.select(PATIENCE)
    with contextlib.nullcontext() if is_server else pytest.raises(ChannelLost):
        for _ in range(3):
            if use == 'receive':
                ours.turn(0.0)
            else:
                ours.broadcast(b'frame')
    assert not is_server or ours.channel.peers(0.0) == ()


def test_server_that_closes_the_connection_is_the_reason_of_the_loss(channel: Open) -> None:
    with listening_socket() as server:
        ours = channel(f'tcp://127.0.0.1:{server.getsockname()[1]}')
        server.accept()[0].close()
        with pytest.raises(ChannelLost, match='the other side closed the connection'):
            ours.receive()


# TCP clients

def test_tcp_connection_sends_at_once_and_notices_a_silent_peer_within_seconds(
        channel: Open, loopback: str) -> None:
    with listening_socket(loopback) as server:
        ours = channel(f'tcp://{loopback}:{server.getsockname()[1]}')
        (key,) = ours.selector.get_map().values()
        one: Any = key.fileobj
        no_delay, timeout, idle, interval, count = (
            one.getsockopt(socket.IPPROTO_TCP, option) for option in (
                socket.TCP_NODELAY, socket.TCP_USER_TIMEOUT, socket.TCP_KEEPIDLE,
                socket.TCP_KEEPINTVL, socket.TCP_KEEPCNT))
        assert no_delay and one.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
        assert 0 < timeout <= 2000
        assert idle + interval * count <= 5


# TCP servers

class Server:
    """A channel that listens, and its clients."""

    def __init__(self, channel: Open, loopback: str, stack: contextlib.ExitStack) -> None:
        self._address = loopback.strip('[]'), free_port(socket.SOCK_STREAM, loopback)
        self._stack = stack
        self.ours = channel(f'tcpin://{loopback}:{self._address[1]}')

    def connect(self) -> socket.socket:
        """Return a new client, which the server has accepted or refused."""
        client = self._stack.enter_context(socket.create_connection(self._address, PATIENCE))
        self.ours.turn(PATIENCE)
        return client

    def say(self, client: socket.socket) -> Any:
        """Let a client send data, and return its peer."""
        client.sendall(b'hello')
        ((peer, received),) = self.ours.receive()
        assert received == b'hello'
        return peer

    def count(self) -> int:
        """Return the number of clients."""
        return len(self.ours.channel.peers(0.0))


@pytest.fixture
def server(channel: Open, loopback: str) -> Iterator[Server]:
    with contextlib.ExitStack() as stack:
        yield Server(channel, loopback, stack)


def test_frames_go_to_one_client_or_to_all(server: Server) -> None:
    one, other = server.connect(), server.connect()
    peers = [server.say(one), server.say(other)]
    assert peers[0] != peers[1]
    server.ours.channel.send([b'to one'], peers[:1])
    server.ours.broadcast(b'to all')
    assert (one.recv(6), one.recv(6), other.recv(6)) == (b'to one', b'to all', b'to all')


def test_client_that_leaves_takes_no_other_with_it(server: Server) -> None:
    one, other, third = (server.connect() for _ in range(3))
    server.ours.channel.heard(server.say(one), 0.0)
    one.close()
    server.ours.turn(PATIENCE)
    assert server.count() == 2
    reset(third)

    def is_alone() -> bool:
        server.ours.broadcast(b'frame')
        return server.count() == 1

    eventually(is_alone)
    assert other.recv(5) == b'frame'


@pytest.mark.parametrize(('speaking', 'now', 'replaced'), [
    # All clients have sent; only the first one has; the first one has been silent for long.
    (MAX_CLIENTS, 0.0, None), (1, 0.0, 1), (MAX_CLIENTS, EXPIRY + 0.5, 0)])
def test_client_beyond_the_bound_replaces_only_a_silent_one(
        server: Server, speaking: int, now: float, replaced: int | None) -> None:
    clients = [server.connect() for _ in range(MAX_CLIENTS)]
    for number, client in enumerate(clients[:speaking]):
        server.ours.channel.heard(server.say(client), now and float(number))
    server.ours.channel.peers(now)
    newest = server.connect()
    closed = newest if replaced is None else clients[replaced]
    assert (closed.recv(100), server.count()) == (b'', MAX_CLIENTS)
    assert replaced is None or server.say(newest)


@pytest.mark.parametrize(('reason', 'is_loss'), [
    (errno.ECONNABORTED, False), (errno.EAGAIN, False), (errno.EPROTO, False),
    # The listener would stay readable, and the link's thread would spin.
    (errno.EMFILE, True), (errno.ENFILE, True)])
def test_failed_accept_is_a_loss_only_where_no_descriptor_is_left(
        server: Server, monkeypatch: pytest.MonkeyPatch, reason: int, is_loss: bool) -> None:
    def accept(listener: socket.socket) -> Any:
        raise OSError(reason, 'as the test says')

    monkeypatch.setattr(socket.socket, 'accept', accept)
    (key,) = server.ours.selector.get_map().values()
    with pytest.raises(ChannelLost) if is_loss else contextlib.nullcontext():
        assert list(server.ours.channel.receive(key.fileobj)) == []


# Serial lines

@pytest.mark.parametrize(('scheme', 'baud', 'flow_control'), [
    ('serial', 57600, False), ('serial', 921600, False), ('serial-hwfc', 57600, True)])
@pytest.mark.parametrize('driver', [None, OSError(25, 'not known'), ValueError('odd driver')])
def test_serial_port_is_set_as_the_url_says_with_low_latency_if_the_driver_has_it(
        channel: Open, device: PtyDevice, monkeypatch: pytest.MonkeyPatch, scheme: str, baud: int,
        flow_control: bool, driver: Exception | None) -> None:
    from serial import Serial
    asked = []

    def set_low_latency_mode(port: Serial, on: bool) -> None:
        asked.append((port.baudrate, port.rtscts, on))
        if driver:
            raise driver

    monkeypatch.setattr(Serial, 'set_low_latency_mode', set_low_latency_mode)
    ours = channel(f'{scheme}://{device.path}:{baud}')
    device.write(b'hello')
    assert (ours.receive_bytes(5), asked) == (b'hello', [(baud, flow_control, True)])


def test_bytes_that_a_line_does_not_take_do_not_delay_closing(
        channel: Open, device: PtyDevice, monkeypatch: pytest.MonkeyPatch) -> None:
    # A pseudo-terminal closes at once; a UART under flow control waits until its buffer is empty.
    from serial import Serial
    steps: list[object] = []
    genuine = Serial.close
    monkeypatch.setattr(termios, 'tcflush', lambda fd, queue: steps.append(queue))

    def close(port: Serial) -> None:
        steps.append('closed')
        genuine(port)

    monkeypatch.setattr(Serial, 'close', close)
    ours = channel(f'serial://{device.path}:57600')
    steps.clear()
    ours.channel.close()
    assert steps[:2] == [termios.TCOFLUSH, 'closed']
