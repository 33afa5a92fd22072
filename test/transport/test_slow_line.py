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

"""Lines that take less than there is to send: bounded queues of whole frames."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
import socket
from typing import Any

from illuminator_ros.mavlink.transport.base import FrameQueue, MAX_QUEUED
import pytest
from support.heartbeats import numbered_frames, numbers_in
from support.open_channel import listening_socket, OpenChannel
from support.ptys import PtyDevice
from support.waiting import eventually, PATIENCE


def contents(queue: FrameQueue) -> bytes:
    """Return what a queue still has to write."""
    data = b''
    while queue:
        data += queue.head()
        queue.written(len(queue.head()))
    return data


def fill(queue: FrameQueue, frames: list[bytes]) -> int:
    """Put frames into a queue and return how many were dropped."""
    return sum(queue.put(frame) for frame in frames)


FRAMES = numbered_frames(10_000)


def test_a_queue_gives_frames_in_order() -> None:
    queue = FrameQueue()
    assert fill(queue, FRAMES[:5]) == 0
    assert contents(queue) == b''.join(FRAMES[:5])


def test_a_full_queue_drops_the_oldest_frames() -> None:
    queue = FrameQueue()
    dropped = fill(queue, FRAMES)
    assert contents(queue) == b''.join(FRAMES[dropped:])


def test_a_queue_is_bounded_and_uses_its_bound() -> None:
    queue = FrameQueue()
    fill(queue, FRAMES)
    assert MAX_QUEUED - 300 < len(contents(queue)) <= MAX_QUEUED


def test_a_frame_that_is_half_written_is_finished_whatever_comes() -> None:
    queue = FrameQueue()
    queue.put(FRAMES[0])
    queue.written(7)
    fill(queue, FRAMES[1:])
    assert contents(queue).startswith(FRAMES[0][7:] + b'\xfd')


def test_a_frame_that_was_finished_protects_none_behind_it() -> None:
    queue = FrameQueue()
    fill(queue, FRAMES[:2])
    queue.written(7)
    queue.written(len(FRAMES[0]) - 7)
    dropped = fill(queue, FRAMES[2:])
    assert contents(queue) == b''.join(FRAMES[1 + dropped:])


def test_writing_nothing_changes_nothing() -> None:
    queue = FrameQueue()
    fill(queue, FRAMES[:2])
    queue.written(0)
    assert contents(queue) == FRAMES[0] + FRAMES[1]


def test_an_empty_queue_has_nothing_to_write() -> None:
    queue = FrameQueue()
    queue.put(FRAMES[0])
    queue.written(len(FRAMES[0]))
    assert not queue


@pytest.fixture(params=['serial', 'tcp client', 'tcp server'])
def slow_line(
    request: pytest.FixtureRequest, channel: Callable[[str], OpenChannel], tmp_path: Path,
) -> Iterator[tuple[OpenChannel, Callable[[], bytes]]]:
    """Return a channel without a reader, and a function that reads."""
    if request.param == 'serial':
        pytest.importorskip('serial', reason='pyserial is not installed')
        device = PtyDevice(tmp_path)
        yield channel(f'serial://{device.path}:57600'), lambda: device.read(0)
        device.pull_out()
        return
    with listening_socket() as server:
        server.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        port = server.getsockname()[1]
        if request.param == 'tcp client':
            ours = channel(f'tcp://127.0.0.1:{port}')
            other = server.accept()[0]
        else:
            server.close()
            ours = channel(f'tcpin://127.0.0.1:{port}')
            other = socket.socket()
            other.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            other.connect(('127.0.0.1', port))
            ours.turn(PATIENCE)
        with other:
            yield ours, lambda: _read(other)


def _read(one: socket.socket) -> bytes:
    one.setblocking(False)
    try:
        return one.recv(1 << 20)
    except BlockingIOError:
        return b''


def test_a_line_that_nobody_reads_gets_whole_frames_and_the_newest(slow_line: Any) -> None:
    ours, read = slow_line
    sent = 0
    for frame in FRAMES:
        ours.broadcast(frame)
        sent += 1
        if ours.channel.dropped == 100:
            break
    data = bytearray()

    def all_read() -> bool:
        ours.turn()
        data.extend(read())
        return data.endswith(frame)

    eventually(all_read, 'the newest frame')
    assert ours.channel.dropped == 100, 'there was room for all'
    numbers, decoder = numbers_in(bytes(data))
    assert decoder.counters.skipped_bytes == 0
    assert numbers == sorted(numbers)
    assert len(numbers) == sent - 100
