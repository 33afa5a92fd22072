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

"""Lights and links that disappear and return: one event each, without help."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
import socket
import threading
from typing import Any, Protocol

from illuminator_ros.illuminator.light import Settings
from illuminator_ros.payload import request
import pytest
from support.live_link import Bridge, Jump, Lights, LiveLink
from support.ports import free_port
from support.ptys import PtyDevice
from support.relay import Relay
from support.waiting import PATIENCE

# s after which a light is lost; a machine that stands still for a while loses none.
SILENCE = 30.0


class Other(Protocol):
    """The other side of a bridge's link, which can disappear and return."""

    url: str

    def go(self) -> None:
        """Disappear, unless it has already."""

    def come(self) -> None:
        """Appear."""


class _TcpServer:

    def __init__(self, clock: Jump) -> None:
        self._clock = clock
        self._port = free_port(socket.SOCK_STREAM)
        self.url = f'tcp://127.0.0.1:{self._port}'
        self._lights: LiveLink | None = None

    def come(self) -> None:
        self._lights = Lights(f'tcpin://127.0.0.1:{self._port}', clock=self._clock)
        self._lights.wait_open()

    def go(self) -> None:
        if self._lights:
            self._lights.stop()


class _SerialDevice:

    def __init__(self, clock: Jump, directory: Path) -> None:
        self._clock = clock
        self._device = PtyDevice(directory)
        self._device.pull_out()
        self.url = f'serial://{self._device.path}:57600'
        self._light: Any = None

    def come(self) -> None:
        self._device.plug_in()
        self._light = self._device.connect_light(self._clock)

    def go(self) -> None:
        if self._light:
            self._light.stop()
            self._light = None
        self._device.pull_out()


class _UdpLight:
    """A light that takes another port each time."""

    def __init__(self, clock: Jump) -> None:
        self._clock = clock
        self._port = free_port()
        self.url = f'udpin://127.0.0.1:{self._port}'
        self._lights: LiveLink | None = None

    def come(self) -> None:
        self._lights = Lights(f'udpout://127.0.0.1:{self._port}', clock=self._clock)

    def go(self) -> None:
        if self._lights:
            self._lights.stop()


class _Router:
    """A light behind a UDP router, which is what goes and comes."""

    def __init__(self, clock: Jump) -> None:
        self._relay = Relay()
        self.url = f'udpout://127.0.0.1:{self._relay.near_port}'
        self._lights = Lights(f'udpout://127.0.0.1:{self._relay.far_port}', clock=clock)

    def come(self) -> None:
        self._relay.start()

    def go(self) -> None:
        self._relay.stop()

    def close(self) -> None:
        self._relay.stop()
        self._lights.stop()


@pytest.fixture(autouse=True)
def _patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have no change fail because the machine stood still behind its acknowledgement."""
    monkeypatch.setattr(request, 'CONFIRMATION_TIMEOUT', PATIENCE)


@pytest.fixture
def clock() -> Jump:
    """Return a clock that can be set forward, so that silence takes no time."""
    return Jump()


@pytest.fixture(params=['tcp', 'serial', 'udp', 'router'])
def other(
    request: pytest.FixtureRequest, tmp_path: Path, clock: Jump,
) -> Iterator[Other]:
    """Return the other side of a link, not there yet."""
    one: Any
    if request.param == 'serial':
        pytest.importorskip('serial', reason='pyserial is not installed')
        one = _SerialDevice(clock, tmp_path)
    else:
        one = {'tcp': _TcpServer, 'udp': _UdpLight, 'router': _Router}[request.param](clock)
    yield one
    one.go()
    if isinstance(one, _Router):
        one.close()


@pytest.fixture
def bridge(run: Callable[..., Any], other: Other, clock: Jump) -> Any:
    """Return the drone's side, which has heard no peer yet."""
    return run(Bridge(other.url, Settings(heartbeat_timeout=SILENCE), clock=clock))


def lose(bridge: Any, other: Other, clock: Jump, count: int = 1) -> None:
    """Make the other side go, and wait until that is noticed."""
    other.go()
    # Messages sent before are taken first.
    bridge.ask(lambda now: None)
    # On UDP only silence shows it.
    clock.ahead += SILENCE
    bridge.link.call(lambda now: None)
    bridge.lights.wait_for(lambda entry: entry[0] == 'lost', count=count)


def test_a_light_is_found_that_comes_later(bridge: Any, other: Other) -> None:
    other.come()
    assert bridge.wait_connected()


def test_a_light_that_has_gone_is_found_and_commanded_again(
    bridge: Any, other: Other, clock: Jump,
) -> None:
    other.come()
    bridge.wait_connected()
    for count in (1, 2):
        lose(bridge, other, clock, count)
        other.come()
        light = bridge.wait_connected(count + 1)
        assert bridge.enable(True, light).success


def test_each_going_and_coming_of_a_light_is_told_once(
    bridge: Any, other: Other, clock: Jump,
) -> None:
    other.come()
    bridge.wait_connected()
    lose(bridge, other, clock)
    other.come()
    bridge.wait_connected(2)
    assert [what for what, _ in bridge.lights] == ['connected', 'lost', 'connected']


def test_a_request_is_answered_while_the_other_side_is_gone(
    bridge: Any, other: Other, clock: Jump,
) -> None:
    other.come()
    light = bridge.wait_connected()
    lose(bridge, other, clock)
    result = bridge.enable(True, light)
    assert not result.success
    assert 'is lost' in result.message


def test_the_links_thread_works_while_the_other_side_is_gone(bridge: Any) -> None:
    assert bridge.ask(lambda now: threading.current_thread().name) == 'mavlink-link'
