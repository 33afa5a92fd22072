# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""``discover``: baud rates, components, commands, and why nothing is heard."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
import contextlib
import errno
import json
import os
from pathlib import Path
import selectors
import socket
import sys
from typing import Any

from illuminator_ros.cli.discover.report import lines
from illuminator_ros.cli.discover.report import report as report_of
from illuminator_ros.cli.discover.run import CONSOLE, parse, ports_of, UDP_PORTS
from illuminator_ros.gimbal.messages import GimbalManagerStatus
from illuminator_ros.illuminator.messages import IlluminatorStatus
from illuminator_ros.mavlink.dialect import decode, mavlink
from illuminator_ros.mavlink.messages import Address, Heartbeat, heartbeat, Message
from illuminator_ros.mavlink.search.listener import Listener
from illuminator_ros.mavlink.search.rate_scan import RATES
from illuminator_ros.mavlink.transport import Channel, open_channel, Peer
from illuminator_ros.mavlink.transport.ports import serial_ports
from illuminator_ros.mavlink.url import HostPort, parse_url, SerialUrl, UdpUrl, Url
import pytest
from support.frames import Codec
from support.open_channel import bound_socket, has_nothing
from support.ports import free_port
from support.processes import Program, run
from support.ptys import PtyDevice
from support.signers import checker
from support.terminals import Terminal
from support.waiting import PATIENCE

DURATION = 20.0
LIGHT, AUTOPILOT, STATION, CAMERA, MOUNT = (
    Address(1, 243), Address(1, 1), Address(255, 190), Address(1, 100), Address(1, 154))
LIGHT_BEAT, GIMBAL_BEAT = (heartbeat(kind) for kind in (
    mavlink.MAV_TYPE_ILLUMINATOR, mavlink.MAV_TYPE_GIMBAL))
STATION_BEAT = heartbeat(mavlink.MAV_TYPE_GCS)
ARDUPILOT_BEAT = Heartbeat(
    mavlink.MAV_TYPE_SUBMARINE, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, 0, 0, 4, 3)
# As the serial API of the camera describes it.
CAMERA_BEAT = Heartbeat(0, 1, 2, 3, 4, 3)
STATUS, MANAGED = (decode(cls, b'') for cls in (IlluminatorStatus, GimbalManagerStatus))


class Wire(Channel):
    """
    A real pseudo-terminal, which ignores baud rates: here bytes at a wrong rate are garbage.

    :param rate: the right one, 0 where each is right.
    :param lacking: the rates that the hardware does not have.
    :ivar received: bytes.
    """

    def __init__(self, channel: Channel, first: int, rate: int, lacking: Sequence[int]) -> None:
        super().__init__()
        self.received = 0
        self._channel, self._present, self._right = channel, first, rate
        self._lacking = lacking

    def change_rate(self, baud: int) -> None:
        if baud in self._lacking:
            raise OSError(f'it has no {baud} baud')
        self._channel.change_rate(baud)
        self._present = baud

    def register(self, selector: selectors.BaseSelector, serve: Any) -> None:
        self._channel.register(selector, serve)

    def receive(self, handle: object) -> Iterator[tuple[Peer, bytes]]:
        for peer, data in self._channel.receive(handle):
            self.received += len(data)
            is_right = self._right in (0, self._present)
            yield peer, data if is_right else bytes(byte >> 1 | 0x80 for byte in data)

    def peers(self, now: float) -> Sequence[Peer]:
        raise AssertionError('it sends')

    def send(self, frames: Sequence[bytes], peers: Sequence[Peer]) -> None:
        raise AssertionError('it sends')

    def close(self) -> None:
        self._channel.close()


class Line:
    """A port of ``discover`` on a pseudo-terminal, in simulated time."""

    def __init__(self, directory: Path, *, first: int = RATES[0], rate: int = 0,
                 lacking: Sequence[int] = ()) -> None:
        self.device = PtyDevice(directory)
        self.url = f'serial://{self.device.path}'
        self.now = 100.0
        self.selector = selectors.DefaultSelector()
        self.port = Listener(
            SerialUrl(str(self.device.path), first), str(self.device.path), lambda: self.now,
            rates=[*dict.fromkeys((first, *RATES))])

        def opener(url: Url) -> Channel:
            self.wire = Wire(open_channel(url), first, rate, lacking)
            return self.wire

        self.port.listen(self.selector, opener)

    def listen(self, send: Callable[[], bytes] = bytes) -> dict[str, Any]:
        """Listen to what is sent each 0.5 s, and return the report."""
        for _ in range(int(2 * DURATION)):
            expected = self.wire.received
            if data := send():
                self.device.write(data)
                expected += len(data)
            while self.wire.received < expected:
                self.turn()
            self.now += 0.5
            self.port.poll()
        self.port.close()
        assert self.device.read(0.0) == b''
        return report_of(self.port)

    def turn(self) -> None:
        """Serve what is ready, after waiting for it."""
        ready = self.selector.select(PATIENCE)
        assert ready
        for key, events in ready:
            key.data(key.fileobj, events)


def frames(codec: Codec, *sent: tuple[Address, Message]) -> bytes:
    return b''.join(codec.frame(source, message) for source, message in sent)


@pytest.fixture(autouse=True)
def started_by_ros2(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, 'argv', ['/ws/install/lib/illuminator_ros/discover'])


@pytest.mark.parametrize('rate', [*RATES, 12345])
def test_a_light_at_any_rate_is_found_with_the_command_for_this_rate(
    tmp_path: Path, rate: int,
) -> None:
    codec = Codec()
    line = Line(tmp_path, first=rate if rate not in RATES else RATES[0], rate=rate)
    report = line.listen(lambda: frames(codec, (LIGHT, LIGHT_BEAT)))

    assert report['run'] == [f'ros2 run illuminator_ros bridge {line.url}:{rate}']
    assert [one['address'] for one in report['components']] == ['1/243']
    assert 1.5 <= report['components'][0]['frames_per_s'] <= 2.5


def test_a_rate_that_the_hardware_does_not_have_is_left_out(tmp_path: Path) -> None:
    codec = Codec()
    line = Line(tmp_path, rate=RATES[3], lacking=[115200, 921600])

    assert line.listen(lambda: frames(codec, (LIGHT, LIGHT_BEAT)))['url'] == (
        f'{line.url}:{RATES[3]}')


SIGNED = '--ros-args -p signing_mode:=sign -p signing_key_file:=KEY_FILE'
BOTH = 'bridge URL --ros-args -p payloads:="[illuminator, gimbal]"'


@pytest.mark.parametrize(('codec', 'sent', 'kinds', 'commands'), [
    (Codec(), [(AUTOPILOT, ARDUPILOT_BEAT), (LIGHT, LIGHT_BEAT), (STATION, STATION_BEAT)],
     {'1/1': 'autopilot, ArduPilot', '1/243': 'light', '255/190': 'ground station'},
     ['bridge URL']),
    (Codec(), [(AUTOPILOT, ARDUPILOT_BEAT), (AUTOPILOT, STATUS)],
     {'1/1': 'autopilot, ArduPilot, light'}, ['bridge URL']),
    (Codec(checker()), [(LIGHT, LIGHT_BEAT)], {'1/243': 'light'}, [f'bridge URL {SIGNED}']),
    (Codec(), [(AUTOPILOT, ARDUPILOT_BEAT), (AUTOPILOT, MANAGED), (LIGHT, LIGHT_BEAT)],
     {'1/1': 'autopilot, ArduPilot, gimbal manager', '1/243': 'light'}, [BOTH]),
    (Codec(), [(MOUNT, GIMBAL_BEAT)], {'1/154': 'gimbal'}, ['gimbal_manager URL']),
    # The autopilot may manage it, and says so only on request.
    (Codec(), [(MOUNT, GIMBAL_BEAT), (AUTOPILOT, ARDUPILOT_BEAT)],
     {'1/1': 'autopilot, ArduPilot', '1/154': 'gimbal'}, ['gimbal URL']),
    (Codec(version=1), [(CAMERA, CAMERA_BEAT)], {'1/100': 'MicaSense camera'}, ['rededge URL']),
])
def test_each_component_has_its_kinds_and_the_port_its_command(
    tmp_path: Path, codec: Codec, sent: list[tuple[Address, Message]], kinds: dict[str, str],
    commands: list[str],
) -> None:
    line = Line(tmp_path)
    report = line.listen(lambda: frames(codec, *sent))

    assert {one['address']: ', '.join(one['kinds']) for one in report['components']} == kinds
    assert report['run'] == [
        f'ros2 run illuminator_ros {one}'.replace('URL', f'{line.url}:57600') for one in commands]
    assert (report['trouble'], report['try']) == ('', [])
    for one in report['components']:
        version = codec.decoder.feed(frames(codec, sent[0]))[0].version
        assert (one['mavlink_versions'], one['signed']) == ([version], SIGNED in report['run'][0])


def test_without_a_served_device_the_report_says_what_a_program_that_sends_may_find(
    tmp_path: Path,
) -> None:
    codec, line = Codec(), Line(tmp_path)
    report = line.listen(lambda: frames(codec, (AUTOPILOT, ARDUPILOT_BEAT)))

    assert report['run'] == []
    assert report['try'] == [
        f'ros2 run illuminator_ros {BOTH}'.replace('URL', f'{line.url}:57600')]
    assert report['trouble'].startswith('none of these is a light, a gimbal or a MicaSense camera')
    assert list(lines(report)) == [
        f'{line.url}:57600',
        '  1/1      autopilot, ArduPilot             MAVLink 2              2.0 frames/s',
        f'  {report["trouble"]}', f'  try: {report["try"][0]}']


def test_a_light_on_a_line_of_mavlink_1_has_a_remedy_and_a_camera_beside_it_its_command(
    tmp_path: Path,
) -> None:
    codec, line = Codec(version=1), Line(tmp_path)
    report = line.listen(
        lambda: frames(codec, (LIGHT, LIGHT_BEAT), (CAMERA, CAMERA_BEAT)))

    assert report['run'] == [f'ros2 run illuminator_ros rededge {line.url}:57600']
    assert report['try'] == [f'ros2 run illuminator_ros bridge {line.url}:57600']
    assert report['trouble'].startswith('only MAVLink 1 is heard, which cannot carry')


def test_noise_and_silence_have_their_likely_causes(tmp_path: Path) -> None:
    noise = iter(range(1 << 30))
    line = Line(tmp_path)
    report = line.listen(lambda: bytes(next(noise) * 89 & 0xFF for _ in range(50)))
    assert report['trouble'].startswith(
        '2000 bytes, no valid frame: another baud rate, a bad wire or ground, or not MAVLink')
    assert Line(tmp_path).listen()['trouble'].startswith('nothing is received: check the power')


def test_a_port_that_is_lost_says_so_and_keeps_what_was_heard(tmp_path: Path) -> None:
    line = Line(tmp_path)
    line.device.write(frames(Codec(), (LIGHT, LIGHT_BEAT)))
    line.turn()
    line.device.pull_out()
    line.turn()

    report = report_of(line.port)
    assert report['trouble'].startswith('lost: ')
    assert report['run'] == [f'ros2 run illuminator_ros bridge {line.url}:57600']


# Programs that hold a port open until they are ended.
SERIAL_USER = 'import sys, signal; port = open(sys.argv[1], "rb"); print("open"); signal.pause()'
UDP_USER = """
import signal, socket, sys
port = socket.socket(type=socket.SOCK_DGRAM)
port.bind(('127.0.0.1', int(sys.argv[1])))
print('open')
signal.pause()
"""


def opened(url: Url, opener: Callable[[Url], Channel] = open_channel) -> str:
    """Return the trouble with a port after opening it."""
    with selectors.DefaultSelector() as selector:
        port = Listener(url, 'port', lambda: 0.0)
        port.listen(selector, opener)
        port.close()
        return port.trouble


@contextlib.contextmanager
def used(script: str, port: str) -> Iterator[Program]:
    """Have another program use a port."""
    program = Program(sys.executable, '-uc', script, port)
    try:
        program.wait_for('open')
        yield program
    finally:
        program.kill()


def never(url: Url) -> Channel:
    raise AssertionError('it takes bytes of another program')


def test_a_port_that_another_program_uses_is_not_read_and_names_the_program(
    tmp_path: Path,
) -> None:
    device, port = PtyDevice(tmp_path), free_port()
    with used(SERIAL_USER, str(device.path)) as program:
        trouble = opened(SerialUrl(str(device.path), 57600), never)
        assert trouble.startswith(f'in use by "{sys.executable} -uc import sys, ')
        assert f'(process {program.pid}): end it, or share its link' in trouble
    assert opened(SerialUrl(str(device.path), 57600)) == ''
    with used(UDP_USER, str(port)) as program:
        assert f'(process {program.pid})' in opened(UdpUrl(HostPort('', port)))


def test_a_port_that_a_program_of_another_user_has_locked_is_in_use(tmp_path: Path) -> None:
    def locked(url: Url) -> Channel:
        raise OSError(errno.EBUSY, 'cannot open /dev/ttyUSB0: it is in use by another program')

    assert opened(SerialUrl(str(tmp_path / 'tty'), 57600), locked).startswith(
        'in use by a program of another user')


def test_a_port_without_permission_has_the_remedy() -> None:
    far, near = os.openpty()
    name = os.ttyname(near)
    os.close(near)
    os.chmod(name, 0)
    user = os.geteuid()
    try:
        # root may open everything.
        os.seteuid(user or 65534)
        trouble = opened(SerialUrl(name, 57600))
    finally:
        os.seteuid(user)
        os.close(far)

    assert trouble == (f'cannot open {name}: no permission; join its group, as in "sudo usermod '
                       '-a -G dialout $USER", and log in again')


@pytest.mark.parametrize(('host', 'url'), [
    ('127.0.0.1', 'udpin://127.0.0.1:PORT'), ('', 'udpin://0.0.0.0:PORT')])
def test_a_light_on_udp_is_found_and_gets_nothing(host: str, url: str) -> None:
    with selectors.DefaultSelector() as selector, bound_socket() as light:
        number = free_port()
        port = Listener(
            UdpUrl(HostPort('', number)), f'udpin://0.0.0.0:{number}', lambda: 0.0)
        port.listen(selector)
        sender = light
        if not host:
            # An address of this machine that others can reach, if there is one.
            sender = bound_socket(own_address())
        sender.sendto(frames(Codec(), (LIGHT, LIGHT_BEAT)), (sender.getsockname()[0], number))
        for key, events in selector.select(PATIENCE):
            key.data(key.fileobj, events)
        report = report_of(port)
        port.close()

        assert report['run'] == [
            f'ros2 run illuminator_ros bridge {url}'.replace('PORT', str(number))]
        assert has_nothing(sender)
        sender.close()


def own_address() -> str:
    """Return an address of this machine that is not loopback, or skip the test."""
    with socket.socket(type=socket.SOCK_DGRAM) as probe:
        try:
            # Nothing is sent.
            probe.connect(('192.0.2.1', 9))
        except OSError:
            pytest.skip('this machine has loopback only')
        return str(probe.getsockname()[0])


def test_a_url_with_a_remote_that_is_silent_is_tried_with_a_program_that_sends() -> None:
    url = 'udpout://192.0.2.1:14550'
    port = Listener(parse_url(url), url, lambda: 0.0)

    assert report_of(port)['try'] == [f'ros2 run illuminator_ros {BOTH}'.replace('URL', url)]


def test_serial_ports_have_stable_names_and_those_without_hardware_are_left_out(
    tmp_path: Path,
) -> None:
    for folder in ('dev/serial/by-id', *(f'sys/class/tty/{name}/device' for name in (
            'ttyUSB0', 'ttyAMA0', 'ttyS0', 'ttyACM0', 'console'))):
        (tmp_path / folder).mkdir(parents=True)
    for name in ('ttyUSB0', 'ttyAMA0', 'ttyS0', 'tty1'):
        (tmp_path / 'dev' / name).touch()
    (tmp_path / 'dev/serial/by-id/usb-FTDI-port0').symlink_to('../../ttyUSB0')
    (tmp_path / 'sys/class/tty/ttyAMA0/type').write_text('32\n')
    (tmp_path / 'sys/class/tty/ttyS0/type').write_text('0\n')
    (tmp_path / 'sys/class/tty/console/active').write_text('tty0 ttyAMA0\n')

    assert serial_ports(tmp_path) == {
        f'{tmp_path}/dev/ttyAMA0': True, f'{tmp_path}/dev/serial/by-id/usb-FTDI-port0': False}


def test_a_given_url_replaces_the_same_port_and_a_console_is_opened_only_if_it_is_given(
    tmp_path: Path,
) -> None:
    (tmp_path / 'ttyUSB0').touch()
    (tmp_path / 'stable').symlink_to('ttyUSB0')
    given = [(text, parse_url(text)) for text in (
        f'{tmp_path}/ttyUSB0,9600', 'udpin://127.0.0.1:14550', 'tcp://router:5760')]
    ports = ports_of(given, DURATION, lambda: 0.0,
                     {f'{tmp_path}/stable': False, '/dev/ttyAMA0': True})

    assert {port.label: (port.rate, port.trouble) for port in ports} == {
        f'{tmp_path}/ttyUSB0,9600': (9600, ''), '/dev/ttyAMA0': (57600, CONSOLE),
        'udpin://127.0.0.1:14550': (0, ''), 'tcp://router:5760': (0, ''),
        **{f'udpin://0.0.0.0:{number}': (0, '') for number in UDP_PORTS if number != 14550}}


def test_a_serial_port_may_be_given_without_its_rate() -> None:
    by_path = '/dev/serial/by-path/platform-usb-0:1.2:1.0-port0'
    _, given = parse([by_path, f'{by_path}:9600', '/dev/ttyUSB0,9600', '/dev/ttyUSB0'])

    assert [url for _, url in given] == [
        SerialUrl(by_path, 57600), SerialUrl(by_path, 9600), SerialUrl('/dev/ttyUSB0', 9600),
        SerialUrl('/dev/ttyUSB0', 57600)]


DISCOVER = 'support.quiet_discover'


def test_ctrl_c_ends_the_listening_at_once_with_the_report(tmp_path: Path) -> None:
    device = PtyDevice(tmp_path)
    terminal = Terminal(DISCOVER, '--seconds', '3600', f'serial://{device.path}:115200')
    terminal.wait_for('nothing yet')
    device.write(frames(Codec(), (LIGHT, LIGHT_BEAT)))
    terminal.wait_for('heard: 1/243; at 115200 baud')
    terminal.type('\x03')

    assert terminal.wait() == 0
    terminal.wait_for(f'run: .*bridge serial://{device.path}:115200 ')


def test_without_a_device_the_status_is_1_and_json_has_each_port(tmp_path: Path) -> None:
    outcome = run(DISCOVER, '--seconds', '1', '--json', f'{tmp_path}/tty', 'tcp://127.0.0.1:9')

    assert outcome.returncode == 1
    assert [(one['port'], one['trouble']) for one in json.loads(outcome.stdout)] == [
        (f'{tmp_path}/tty', f'cannot open {tmp_path}/tty: there is no such port: '
                            '/dev/serial/by-id lists the present USB ports, and serial://auto '
                            'finds the port by itself'),
        ('tcp://127.0.0.1:9', 'cannot connect to 127.0.0.1:9: Connection refused')]
