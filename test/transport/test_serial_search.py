# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``serial://auto``: the port on which a wanted device is heard, in simulated time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
from pathlib import Path
import re
import selectors
import socket
import threading
from typing import cast

from illuminator_ros.cli.payloads import devices, PAYLOADS
from illuminator_ros.mavlink.dialect import decode, mavlink, replaced
from illuminator_ros.mavlink.frame_writer import FrameWriter
from illuminator_ros.mavlink.messages import (
    Address,
    CommandLong,
    ComponentInformationBasic,
    heartbeat,
)
from illuminator_ros.mavlink.search.serial_search import (
    AGAIN,
    DECISION,
    OTHERS,
    PASS,
    SerialSearch,
)
from illuminator_ros.mavlink.signing import Signing
from illuminator_ros.mavlink.transport import Channel
from illuminator_ros.mavlink.transport.base import StreamChannel
from illuminator_ros.mavlink.url import AutoUrl, parse_url, SerialUrl, Url
import pytest
from support import live_link
from support.frames import Codec

OURS, THEIRS = Address(1, 193), Address(1, 243)
NMEA = b'$GPGLL,4916.45,N,12311.12,W,225444,A*31\r\n'
LIGHT_BEAT, GIMBAL_BEAT = (Codec().frame(THEIRS, heartbeat(kind)) for kind in (
    mavlink.MAV_TYPE_ILLUMINATOR, mavlink.MAV_TYPE_GIMBAL))


class Line(StreamChannel):
    """One opening of a serial port."""

    def __init__(self, url: Url) -> None:
        assert isinstance(url, SerialUrl)
        self.far, self._near = socket.socketpair()
        self._near.setblocking(False)
        super().__init__(str(url), self._near, 'the device has gone')
        self._url = url

    def change_rate(self, baud: int) -> None:
        self.name = str(self._url._replace(baud=baud))

    def close(self) -> None:
        self._near.close()


class Machine:
    """Serial ports that send something each second, and a search with its own clock."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.now = 100.0
        self._sent_at = 0.0
        # The data that each port sends, and its openings.
        self.ports: dict[str, bytes] = {}
        self.lines: dict[str, Line] = {}
        self.consoles: set[str] = set()
        self.each_second: Callable[[], None] = lambda: None

    def plug_in(self, name: str, data: bytes) -> str:
        """Add a port, and return its path."""
        path = self._folder / name
        path.touch()
        self.ports[str(path)] = data
        return str(path)

    def pull_out(self, path: str) -> None:
        del self.ports[path]
        self.lines.pop(path).far.close()

    def received(self, path: str) -> bytes:
        try:
            return self.lines[path].far.recv(4096, socket.MSG_DONTWAIT)
        except BlockingIOError:
            return b''

    def search(self, url: str, *kinds: str) -> SerialSearch:
        parsed = parse_url(url, known=devices(PAYLOADS))
        assert isinstance(parsed, AutoUrl)
        machine = self

        class Selector(selectors.DefaultSelector):

            def select(
                self, timeout: float | None = None,
            ) -> list[tuple[selectors.SelectorKey, int]]:
                machine.wait(timeout or 0.0)
                return super().select(0)

        return SerialSearch(
            parsed._replace(devices=tuple(frozenset({kind}) for kind in kinds)),
            FrameWriter(Signing()), OURS, make_selector=Selector, clock=lambda: self.now,
            ports=lambda: {path: path in self.consoles for path in self.ports}, opener=self.open)

    def open(self, url: Url) -> Channel:  # noqa: A003 - as a transport
        line = self.lines[cast(SerialUrl, url).device] = Line(url)
        return line

    def wait(self, seconds: float) -> None:
        self.now += seconds
        if self.now >= self._sent_at + 1.0:
            self._sent_at = self.now
            self.each_second()
            for path, line in self.lines.items():
                # It may be closed.
                with contextlib.suppress(BrokenPipeError):
                    line.far.send(self.ports[path])


@pytest.fixture
def machine(tmp_path: Path) -> Iterator[Machine]:
    one = Machine(tmp_path)
    yield one
    for line in one.lines.values():
        line.far.close()


def opened(search: SerialSearch) -> Channel:
    return search.open(threading.Event())


@contextlib.contextmanager
def taken(search: SerialSearch, path: str) -> Iterator[None]:
    channel = opened(search)
    assert channel.name == f'serial://{path}:57600'
    yield
    channel.close()


def test_the_port_with_the_device_is_opened_and_nothing_is_sent(machine: Machine) -> None:
    others = [machine.plug_in('gps', NMEA), machine.plug_in('gimbal', GIMBAL_BEAT),
              machine.plug_in('silent', b'')]
    path = machine.plug_in('light', LIGHT_BEAT)
    begun = machine.now

    with taken(machine.search('serial://auto', 'light'), path):
        assert DECISION <= machine.now - begun < DECISION + 2.0
        assert [machine.received(one) for one in (path, *others)] == [b''] * 4


def test_two_devices_are_both_named_until_one_is_unplugged(machine: Machine) -> None:
    first, second = (machine.plug_in(name, LIGHT_BEAT) for name in ('first', 'second'))
    search = machine.search('serial://auto', 'light')

    with pytest.raises(OSError, match=f'give one of serial://{first}:57600 .*'
                                      f'serial://{second}:57600 '):
        opened(search)
    machine.pull_out(first)
    with taken(search, second):
        pass


def test_a_device_with_the_wanted_serial_number_is_asked_for_it_and_chosen(
    machine: Machine,
) -> None:
    paths = {number: machine.plug_in(number, LIGHT_BEAT) for number in ('SIM-1', 'SIM-2')}
    asked = []

    def answer() -> None:
        codec = Codec()
        for number, path in paths.items():
            for frame in codec.decoder.feed(machine.received(path)):
                if frame.message_id == CommandLong.id:
                    command = decode(CommandLong, frame.payload)
                    asked.append((command.target_component, command.param1))
                    machine.lines[path].far.send(codec.frame(THEIRS, replaced(
                        decode(ComponentInformationBasic, b''), serial_number=number.encode())))

    machine.each_second = answer
    with taken(machine.search('serial://auto?serial=SIM-2', 'light'), paths['SIM-2']):
        assert {*asked} == {(243, 396)}


def test_without_the_device_the_reason_names_what_each_port_has(machine: Machine) -> None:
    gps, gimbal, console = (machine.plug_in(name, data) for name, data in (
        ('gps', NMEA), ('gimbal', GIMBAL_BEAT), ('console', LIGHT_BEAT)))
    machine.consoles.add(console)
    search = machine.search('serial://auto:57600', 'light')

    with pytest.raises(OSError, match='no light') as error:
        opened(search)
    assert str(error.value) == (f'no light: {gimbal}: 1/243 (gimbal); {gps}: this is NMEA text '
                                '(discover tells more)')
    # A port that is plugged in later.
    with taken(search, machine.plug_in('light', LIGHT_BEAT)):
        pass


def test_a_port_of_other_devices_is_closed_for_their_searches_and_tried_again(
    machine: Machine,
) -> None:
    path = machine.plug_in('gimbal', GIMBAL_BEAT)
    search = machine.search('serial://auto', 'light')
    for _ in range(2):
        with pytest.raises(OSError, match=re.escape(f'no light: {path}: 1/243 (gimbal)')):
            opened(search)
    with pytest.raises(BrokenPipeError):
        machine.lines[path].far.send(b'x')

    machine.ports[path], begun = LIGHT_BEAT, machine.now
    for _ in range(int((AGAIN - PASS) / PASS)):
        with pytest.raises(OSError, match='no light'):
            opened(search)
    with taken(search, path):
        assert machine.now - begun < OTHERS + AGAIN


def test_only_ports_that_match_the_pattern_are_tried(machine: Machine, tmp_path: Path) -> None:
    machine.plug_in('first', GIMBAL_BEAT)
    second = machine.plug_in('second', GIMBAL_BEAT)

    with taken(machine.search(f'serial://auto?ports={tmp_path}/sec*', 'gimbal'), second):
        pass


def test_a_search_that_is_stopped_closes_its_ports(machine: Machine) -> None:
    path, stopping = machine.plug_in('light', b''), threading.Event()
    machine.each_second = stopping.set

    with pytest.raises(OSError, match='stopped'):
        machine.search('serial://auto', 'light').open(stopping)
    with pytest.raises(BrokenPipeError):
        machine.lines[path].far.send(b'x')


def test_a_light_that_is_unplugged_is_found_under_another_name(
    run: live_link.Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip('serial', reason='pyserial is not installed')
    monkeypatch.setattr('illuminator_ros.mavlink.search.serial_search.DECISION', 0.0)
    monkeypatch.setattr('illuminator_ros.mavlink.search.serial_search.INTERVAL', 0.1)
    bridge = run(live_link.Bridge(parse_url(
        f'serial://auto?ports={tmp_path}/tty*', known=devices(PAYLOADS))))
    for count, name in enumerate(('ttyFIRST', 'ttySECOND'), 1):
        with live_link.Lights(f'pty://{tmp_path}/{name}'):
            light = bridge.wait_connected(count)
            assert bridge.enable(True, light).success
            assert bridge.wait_open(count).name == f'serial {tmp_path}/{name} at 57600 baud'
        bridge.wait_lost(count)
