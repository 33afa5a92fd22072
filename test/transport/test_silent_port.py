# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""An open serial port without a frame: the reason, and the time at other baud rates."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import math
from pathlib import Path
from unittest.mock import Mock

from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address, heartbeat
from illuminator_ros.mavlink.search.silent_port import SILENCE, SilentPort
from illuminator_ros.mavlink.transport import Channel
from illuminator_ros.mavlink.url import SerialUrl
import pytest
from support import live_link
from support.frames import Codec
from support.ptys import PtyDevice
from support.waiting import eventually, Log

URL = SerialUrl('/dev/ttyUSB0', 57600)
BEAT = Codec().frame(Address(1, 243), heartbeat(mavlink.MAV_TYPE_ILLUMINATOR))
NMEA = b'$GPGLL,4916.45,N,12311.12,W,225444,A*31\r\n'


class Port:
    """A device that sends each second at one rate, and the time (s)."""

    def __init__(self, rate: int = 0, data: bytes = BEAT, users: str = '') -> None:
        self.now = 0.0
        self.frames = 0
        self.rates: list[tuple[float, int]] = []
        self._rate, self._data = rate, data
        channel = Mock(spec=Channel)
        channel.change_rate = lambda baud: self.rates.append((self.now, baud))
        self._calls: Log[Callable[[float], None]] = Log()
        self._has_users = bool(users)
        self.silent = SilentPort(URL, channel, call=self._calls.append, users=lambda url: users)

    def run(self, seconds: float) -> str:
        """Let time pass, and return the reason."""
        end = self.now + seconds
        while self.now < end:
            self.now += 0.25
            present = self.rates[-1][1] if self.rates else URL.baud
            if self._data and self.now % 1 == 0:
                self.silent.feed(self._data if present == self._rate or not self._rate else
                                 bytes(byte >> 1 | 0x80 for byte in self._data))
            self.silent.poll(self.frames, self.now)
        return self.silent.reason

    def find_users(self) -> None:
        self._calls.wait_for(lambda call: True)(self.now)


def test_a_device_with_another_rate_is_named_with_the_url() -> None:
    port = Port(115200)

    assert port.run(SILENCE) == ''
    assert port.run(5.0).endswith(
        'no valid frame at 57600 baud; MAVLink is heard at 115200: use serial:///dev/ttyUSB0:'
        '115200')
    # Then it keeps the rate of the link.
    assert [rate for _, rate in port.rates] == [115200, 57600]
    port.run(300.0)
    assert len(port.rates) == 2


def test_each_rate_is_tried_and_the_line_is_away_for_less_than_2_s() -> None:
    port = Port(1)

    assert 'no valid frame: another baud rate, a bad wire or ground' in port.run(130.0)
    assert {rate for _, rate in port.rates} == {
        57600, 115200, 921600, 38400, 9600, 19200, 230400, 460800, 500000, 1000000, 1500000}
    begun = [at for at, rate in port.rates if rate != URL.baud]
    ended = [at for at, rate in port.rates if rate == URL.baud]
    assert max(end - begin for begin, end in zip(begun, ended, strict=True)) < 2.0
    port.frames += 1
    assert port.run(1.0) == ''


@pytest.mark.parametrize(('data', 'reason'), [
    (NMEA, 'this is NMEA text: a GPS receiver'), (b'', ''),
    # It was refused for its signature.
    (BEAT, '')])
def test_other_protocols_silence_and_refused_frames_need_no_other_rate(
    data: bytes, reason: str,
) -> None:
    port = Port(data=data)

    assert port.run(60.0) == reason
    assert port.rates == []


def test_a_program_that_reads_the_port_too_is_named() -> None:
    port = Port(1, users='"ModemManager" (process 612)')
    port.run(SILENCE + 1.0)
    port.find_users()

    assert port.run(60.0).startswith(
        '/dev/ttyUSB0 is in use by "ModemManager" (process 612): end it')
    assert len(port.rates) == 2


@pytest.fixture
def _at_once(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr('illuminator_ros.mavlink.line.SILENCE', -math.inf)
    monkeypatch.setattr('illuminator_ros.mavlink.search.silent_port.SILENCE', 0.0)
    yield


def test_a_link_on_a_gps_port_says_so(
    run: live_link.Run, tmp_path: Path, _at_once: None,
) -> None:
    pytest.importorskip('serial', reason='pyserial is not installed')
    device = PtyDevice(tmp_path)
    link = run(live_link.LiveLink(f'serial://{device.path}:57600'))
    link.wait_open()

    def is_named() -> bool:
        device.write(NMEA)
        return link.state().silence == 'this is NMEA text: a GPS receiver'

    eventually(is_named)
    device.pull_out()
