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

"""Address conflicts over real UDP; our own returning frames are none."""

from collections.abc import Callable, Iterator
import select
import socket
import threading
from typing import Any

from illuminator_ros.mavlink.messages import MavType
import pytest
from support.heartbeats import heartbeat_frame
from support.live_link import BRIDGE, Bridge
from support.waiting import eventually, Log


class Loop:
    """A badly set up router: what it gets goes back to where it came from."""

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(('127.0.0.1', 0))
        self.url = f'udpout://127.0.0.1:{self._socket.getsockname()[1]}'
        self.seen: Log[tuple[bytes, Any]] = Log()
        self._end, self._ended = socket.socketpair()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while self._ended not in select.select([self._socket, self._ended], [], [])[0]:
            data, sender = self._socket.recvfrom(2048)
            self._socket.sendto(data, sender)
            self.seen.append((data, sender))

    def send(self, data: bytes) -> None:
        """Send bytes to the first sender heard."""
        self._socket.sendto(data, self.seen[0][1])

    def close(self) -> None:
        """End it."""
        self._end.send(b'\0')
        self._thread.join()
        for one in (self._socket, self._end, self._ended):
            one.close()


@pytest.fixture
def loop() -> Iterator[Loop]:
    """Return a router that sends everything back."""
    loop = Loop()
    yield loop
    loop.close()


def clashes(bridge: Bridge) -> bool:
    """Return whether a bridge reports another sender with its address."""
    return bool(bridge.ask(bridge.endpoint.address_conflict))


def test_our_own_frames_that_come_back_are_no_clash(run: Callable[..., Any], loop: Loop) -> None:
    bridge = run(Bridge(loop.url))
    loop.seen.wait_for(lambda entry: True, count=4)
    assert not clashes(bridge)


def test_somebody_else_with_our_address_is_a_clash(run: Callable[..., Any], loop: Loop) -> None:
    bridge = run(Bridge(loop.url))
    loop.seen.wait_for(lambda entry: True)
    ours = loop.seen[0][0][4]
    loop.send(heartbeat_frame(BRIDGE, (ours + 100) & 0xFF, MavType.ONBOARD_CONTROLLER))
    eventually(lambda: clashes(bridge), 'no clash seen')


def test_two_bridges_of_one_address_that_start_together_begin_at_different_numbers(
    run: Callable[..., Any],
) -> None:
    loops = [Loop() for _ in range(8)]
    for loop in loops:
        run(Bridge(loop.url))
    firsts = {loop.seen.wait_for(lambda entry: True)[0][4] for loop in loops}
    for loop in loops:
        loop.close()
    assert len(firsts) > 1
