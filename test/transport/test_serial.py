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

"""Serial channels, over pseudo-terminals."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
import sys
import termios
from typing import Any

from illuminator_ros.mavlink.transport import ChannelLost, open_channel
from illuminator_ros.mavlink.url import parse_url
import pytest
from support.open_channel import OpenChannel
from support.ptys import PtyDevice

serial = pytest.importorskip('serial', reason='pyserial is not installed')

OpenFunction = Callable[[str], OpenChannel]


@pytest.fixture
def device(tmp_path: Path) -> Iterator[PtyDevice]:
    """Return a serial device."""
    one = PtyDevice(tmp_path)
    yield one
    one.pull_out()


@pytest.fixture
def ours(channel: OpenFunction, device: PtyDevice) -> OpenChannel:
    """Return a channel over it."""
    return channel(f'serial://{device.path}:57600')


def test_bytes_go_both_ways_unchanged(ours: OpenChannel, device: PtyDevice) -> None:
    # A terminal would act on some of them.
    every_byte = bytes(range(256))
    device.write(every_byte)
    ours.broadcast(every_byte)
    assert ours.receive_bytes(256) == every_byte
    assert device.read() == every_byte


def test_a_device_that_is_pulled_out_is_a_lost_channel(
    ours: OpenChannel, device: PtyDevice,
) -> None:
    device.pull_out()
    with pytest.raises(ChannelLost):
        ours.receive()


def test_sending_to_a_device_that_is_gone_is_a_lost_channel(
    ours: OpenChannel, device: PtyDevice,
) -> None:
    device.pull_out()
    with pytest.raises(ChannelLost):
        ours.broadcast(b'frame')


def test_it_is_closed_for_others_meanwhile(ours: OpenChannel, device: PtyDevice) -> None:
    with pytest.raises(OSError, match=f'cannot open {device.path}: it is in use'):
        open_channel(parse_url(f'serial://{device.path}:57600'))


def test_it_can_be_opened_again_once_it_is_closed(
    ours: OpenChannel, channel: OpenFunction, device: PtyDevice,
) -> None:
    ours.channel.close()
    again = channel(f'serial://{device.path}:57600')
    device.write(b'hello')
    assert again.receive_bytes(5) == b'hello'


def test_what_the_line_does_not_take_does_not_hold_up_the_closing(
    ours: OpenChannel, monkeypatch: pytest.MonkeyPatch,
) -> None:
    # A pseudo-terminal closes at once; a UART under flow control waits for what is still to go.
    steps: list[object] = []
    port: Any = ours.channel
    monkeypatch.setattr(termios, 'tcflush', lambda fd, queue: steps.append((fd, queue)))
    monkeypatch.setattr(port._port, 'close', lambda: steps.append('closed'))
    descriptor = port._fd
    ours.channel.close()
    assert steps == [(descriptor, termios.TCOFLUSH), 'closed']


def test_the_baud_rate_is_the_one_of_the_url(channel: OpenFunction, device: PtyDevice) -> None:
    ours: Any = channel(f'serial://{device.path}:921600').channel
    assert ours._port.baudrate == 921600


@pytest.mark.parametrize(('scheme', 'flow_control'), [('serial', False), ('serial-hwfc', True)])
def test_hardware_flow_control_is_on_where_the_url_says_so(
    channel: OpenFunction, device: PtyDevice, scheme: str, flow_control: bool,
) -> None:
    ours: Any = channel(f'{scheme}://{device.path}:57600').channel
    assert ours._port.rtscts is flow_control


@pytest.mark.parametrize('driver', [None, OSError(25, 'not known'), ValueError('odd driver')],
                         ids=['has it', 'lacks it', 'is odd'])
def test_low_latency_is_asked_for_and_does_without(
    channel: OpenFunction, device: PtyDevice, monkeypatch: pytest.MonkeyPatch,
    driver: Exception | None,
) -> None:
    asked = []

    def set_low_latency_mode(port: Any, on: bool) -> None:
        asked.append(on)
        if driver:
            raise driver

    monkeypatch.setattr(serial.Serial, 'set_low_latency_mode', set_low_latency_mode)
    ours = channel(f'serial://{device.path}:57600')
    device.write(b'hello')
    assert ours.receive_bytes(5) == b'hello'
    assert asked == [True]


def test_a_machine_without_pyserial_is_told_what_it_needs(
    device: PtyDevice, monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, 'serial', None)
    with pytest.raises(OSError, match='apt install python3-serial'):
        open_channel(parse_url(f'serial://{device.path}:57600'))
