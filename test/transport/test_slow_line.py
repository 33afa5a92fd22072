# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A line that is slower than the frames of others: what it sends, when, and what it leaves out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
import contextlib
import os
import select
import selectors
import socket

from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.forwarding.forward_queue import MAX_DELAY, MAX_QUEUED
from illuminator_ros.mavlink.frame import Decoder, Frame, MAX_FRAME
from illuminator_ros.mavlink.messages import Address, CommandLong, heartbeat, Message
from illuminator_ros.mavlink.transport.base import FORWARD_AHEAD, FORWARD_SIZE, StreamChannel
from illuminator_ros.mavlink.transport.tcp import open_tcp, TcpServer
from illuminator_ros.mavlink.url import HostPort, TcpUrl
import pytest
from support.frames import frame_of, LIGHT, only
from support.waiting import eventually

# 57,600 baud.
RATE = 5760.0
COMMAND = CommandLong(1, 243, 405, 0, 1, 0, 0, 0, 0, 0, 0)
FILE = mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, [7] * 251)
ATTITUDE, SERVO = mavlink.MAVLINK_MSG_ID_ATTITUDE, mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW


def telemetry(sequence: int, system: int) -> Frame:
    """Return one of two messages of an autopilot."""
    message: Message = (
        mavlink.MAVLink_attitude_message(sequence, 1, 1, 1, 1, 1, 1) if sequence % 2 else
        mavlink.MAVLink_servo_output_raw_message(sequence, 0, *[1500] * 8))
    return only(frame_of(message, sequence & 0xFF, Address(system, 1)))


class SocketChannel(StreamChannel):
    """A stream whose socket the test closes."""

    def close(self) -> None:
        pass


class SlowLine:
    """One end of a pair of sockets as a line of 57,600 baud, whose other end is read at once."""

    def __init__(self, rate: float = RATE) -> None:
        near, self._far = socket.socketpair()
        near.setblocking(False)
        self._far.setblocking(False)
        self._near = near
        self._selector = selectors.DefaultSelector()
        self.channel = SocketChannel('line', near, 'closed', rate)
        self.channel.register(self._selector, lambda handle, events: None)
        self._decoder = Decoder()
        self.now = 10.0
        self.bytes = 0

    def forward(self, *frames: Frame) -> None:
        self.channel.forward(frames, (None,), self.now)

    def send(self, data: bytes) -> None:
        """Send a frame of our own, as :class:`Line` does."""
        self.channel.send([data], (None,))
        self.channel.free_at = max(self.now, self.channel.free_at) + len(data) / RATE

    def run(self, seconds: float) -> list[tuple[float, Frame]]:
        """Let time pass; return each frame that was written meanwhile, with its time."""
        end, found = self.now + seconds, []
        while True:
            found += [(self.now, frame) for frame in self.read()]
            due = self.channel.forward_due
            if due > end:
                self.now = end
                return found
            self.now = max(self.now, due)
            self.channel.forward_more(self.now)

    def read(self) -> list[Frame]:
        """Return the frames at the other end."""
        try:
            data = self._far.recv(1 << 20)
        except BlockingIOError:
            return []
        self.bytes += len(data)
        return [frame for frame in self._decoder.feed(data) if isinstance(frame, Frame)]

    def close(self) -> None:
        self._near.close()
        self._far.close()
        self._selector.close()


@pytest.fixture
def line() -> Iterator[SlowLine]:
    one = SlowLine()
    yield one
    one.close()


def test_a_saturated_line_carries_the_newest_telemetry_within_its_rate_and_counts_the_rest(
        line: SlowLine) -> None:
    written: list[tuple[float, Frame]] = []
    for number in range(2000):
        line.forward(telemetry(number, 1 + number % 3))
        written += line.run(0.001)
    # Less than the nominal rate, so that a port with a slower clock keeps up.
    assert line.bytes <= 0.96 * 2.0 * RATE + MAX_FRAME
    assert line.bytes >= 0.94 * 2.0 * RATE
    # Each of the six kinds gets its share, and none is old: the number is the time in ms.
    kinds = Counter((frame.message_id, frame.source) for _, frame in written)
    assert len(kinds) == 6
    assert max(kinds.values()) - min(kinds.values()) <= 2
    ages = [at - 10.0 - int.from_bytes(frame.payload[:4], 'little') / 1000
            for at, frame in written]
    assert max(ages) < 0.1
    left = line.run(1.0)
    dropped = line.channel.not_forwarded
    assert set(dropped) == {ATTITUDE, SERVO}
    assert sum(dropped.values()) + len(written) + len(left) == 2000


def test_a_command_over_a_saturated_line_waits_for_one_frame_only(line: SlowLine) -> None:
    delays = []
    for number in range(600):
        line.forward(*(telemetry(6 * number + one, 1 + one) for one in range(6)))
        if number % 20 == 10:
            begun = line.now
            line.forward(only(frame_of(COMMAND, number & 0xFF, Address(255, 190))))
            written: list[tuple[float, Frame]] = []
            while COMMAND.get_msgId() not in [frame.message_id for _, frame in written]:
                written = line.run(0.001)
            delays.append(line.now - begun)
        line.run(0.004)
    # The longest of these frames takes 8 ms.
    assert max(delays) < 0.008 + FORWARD_AHEAD + 0.002


def test_our_own_message_is_written_at_once_ahead_of_all_that_wait(line: SlowLine) -> None:
    line.forward(*(telemetry(one, 1 + one) for one in range(6)))
    line.read()
    own = frame_of(heartbeat(18), 3, LIGHT)
    line.send(own)
    assert [frame.data for frame in line.read()] == [own]
    assert len(line.run(1.0)) >= 4


def test_a_blocked_line_holds_a_bounded_number_of_bytes_and_sends_nothing_old_later() -> None:
    line = SlowLine(float('inf'))
    try:
        for number in range(20000):
            line.now += 0.001
            line.forward(only(frame_of(COMMAND, number & 0xFF, Address(1 + number % 250, 1))))
        assert line.channel.is_waiting
        assert line.channel.forward_due == float('inf')
        assert line.channel._forwarded.size <= MAX_QUEUED
        assert line.channel.dropped == 0
        waiting, held = len(line.channel._queue.unwritten()), line.channel._forwarded.size
        # Our own messages wait behind these.
        assert waiting <= FORWARD_SIZE + MAX_FRAME
        line.now += 2 * MAX_DELAY
        line.read()
        while line.channel.is_waiting:
            line.channel.writable(line._near)
            line.read()
        line.channel.forward_more(line.now)
        assert line.read() == []
        assert (held > 0, line.channel._forwarded.size) == (True, 0)
    finally:
        line.close()


def test_our_own_message_waits_for_few_forwarded_bytes_in_a_tcp_connection_that_is_slow() -> None:
    selector = selectors.DefaultSelector()
    with socket.socket() as server, contextlib.ExitStack() as stack:
        server.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        server.bind(('127.0.0.1', 0))
        server.listen()
        channel = open_tcp(TcpUrl(HostPort(*server.getsockname())))
        stack.callback(channel.close)
        channel.register(selector, lambda handle, events: None)
        other = stack.enter_context(server.accept()[0])
        for number in range(1000):
            channel.forward([only(frame_of(FILE, number & 0xFF))], (None,), 0.0)
        own = frame_of(COMMAND, 0, Address(1, 193))
        channel.send([own], (None,))
        other.setblocking(False)
        data = b''
        while own not in data:
            eventually(lambda: select.select([other], [], [], 0.1)[0])
            data += other.recv(1024)
            channel.send((), (None,))
        assert data.index(own) < 4 * FORWARD_SIZE


def test_a_client_of_a_server_that_reads_nothing_delays_no_other_client() -> None:
    selector = selectors.DefaultSelector()
    server = TcpServer(HostPort('127.0.0.1', 0))
    server.register(selector, lambda handle, events: None)
    address = server._listener.getsockname()
    clients = [socket.socket() for _ in range(2)]
    clients[0].setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    for client in clients:
        client.connect(address)
    try:
        for _ in clients:
            eventually(lambda: selector.select(0.1))
            list(server.receive(server._listener))
        decoder, got = Decoder(), 0
        for number in range(5000):
            frame = only(frame_of(FILE, number & 0xFF, Address(255, 190)))
            server.forward([frame], server.peers(0.0), number / 1000)
            got += len(decoder.feed(os.read(clients[1].fileno(), 1 << 16)))
        assert got == 5000
        assert server.not_forwarded[FILE.get_msgId()] > 1000
    finally:
        server.close()
        selector.close()
        for client in clients:
            client.close()
