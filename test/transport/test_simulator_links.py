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

"""The simulator's process on each kind of link, with a client at the other end."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
import socket
from typing import Any

from illuminator_ros.mavlink.frame import Decoder
from illuminator_ros.mavlink.messages import Address
import pytest
from support.live_link import Bridge
from support.ports import free_port
from support.processes import ended, python
from support.ptys import PtyDevice
from support.waiting import eventually


def assert_switched(bridge: Bridge) -> None:
    # Retry: the clock of the machine may pause for longer than a confirmation takes.
    eventually(lambda: bridge.enable(True).success)


@pytest.mark.parametrize(('lights', 'drone'), [
    ('udp://@127.0.0.1:{}', 'udpin:127.0.0.1:{}'),
    ('udpin://127.0.0.1:{}', 'udpout://127.0.0.1:{}'),
    ('tcp://127.0.0.1:{}', 'tcpin:127.0.0.1:{}'),
    ('tcp-l://127.0.0.1:{}', 'tcpout://127.0.0.1:{}'),
], ids=['UDP, sends', 'UDP, listens', 'TCP client', 'TCP server'])
def test_a_light_of_the_simulator_is_found_and_switched_on_each_kind_of_link(
    run: Callable[..., Any], lights: str, drone: str,
) -> None:
    port = free_port(socket.SOCK_STREAM if 'tcp' in lights else socket.SOCK_DGRAM)
    with ended(python('illuminator_ros.simulator', lights.format(port))):
        assert_switched(run(Bridge(drone.format(port))))


def test_the_simulator_sends_frames_on_a_serial_line(tmp_path: Path) -> None:
    pytest.importorskip('serial', reason='pyserial is not installed')
    device, decoder = PtyDevice(tmp_path), Decoder()
    frames: list[Any] = []
    with ended(python('illuminator_ros.simulator', f'serial://{device.path}:57600')) as simulator:
        simulator.wait_for('link open')
        while not frames and (data := device.read()):
            frames = list(decoder.feed(data))
    device.pull_out()
    assert frames[0].source == Address(1, 243)


def test_a_light_of_the_simulator_is_switched_on_over_a_pseudo_terminal_that_it_makes(
    run: Callable[..., Any], tmp_path: Path,
) -> None:
    pytest.importorskip('serial', reason='pyserial is not installed')
    link = tmp_path / 'ttyLIGHT'
    with ended(python('illuminator_ros.simulator', f'pty://{link}')) as simulator:
        simulator.wait_for(f'to be opened as serial://{link}:57600')
        assert_switched(run(Bridge(f'serial://{link}:57600')))
    assert not link.is_symlink()
