# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Connection URLs: the notations of MAVROS, MAVSDK and pymavlink, and errors for wrong ones."""

from __future__ import annotations

from hypothesis import example, given, settings
from hypothesis import strategies as st
from illuminator_ros.mavlink.device_kind import DeviceKind
from illuminator_ros.mavlink.errors import UrlError
from illuminator_ros.mavlink.url import (
    AutoUrl,
    Broadcast,
    EXAMPLES,
    HostPort,
    MemoryUrl,
    parse_url,
    PtyUrl,
    SerialUrl,
    TcpUrl,
    UdpUrl,
    Url,
)
import pytest


def listen(host: str, port: int) -> UdpUrl:
    return UdpUrl(HostPort(host, port))


def send(
    host: str, port: int, bind: tuple[str, int] = ('', 0), broadcast: Broadcast = '',
) -> UdpUrl:
    return UdpUrl(HostPort(*bind), HostPort(host, port), broadcast)


def connect(host: str, port: int) -> TcpUrl:
    return TcpUrl(HostPort(host, port))


def serve(host: str, port: int) -> TcpUrl:
    return TcpUrl(HostPort(host, port), listen=True)


MAVROS: dict[str, Url] = {
    'udp://@': listen('', 14555),
    'udp://:14540@127.0.0.1:14557': send('127.0.0.1', 14557, ('', 14540)),
    'udp://127.0.0.1:14540@10.0.0.2:14557/': send('10.0.0.2', 14557, ('127.0.0.1', 14540)),
    'udp://@drone.local': send('drone.local', 14550, ('', 14555)),
    'UDP://:14540@': listen('', 14540),
    'udp-b://@': send('255.255.255.255', 14550, ('', 14555), 'until_peer'),
    'udp-pb://:14540@:14551': send('255.255.255.255', 14551, ('', 14540), 'always'),
    'tcp://': connect('localhost', 5760),
    'tcp://10.0.0.2:5762/': connect('10.0.0.2', 5762),
    'tcp-l://': serve('', 5760),
    'tcp-l://0.0.0.0:5762': serve('0.0.0.0', 5762),
    '/dev/ttyACM0:57600': SerialUrl('/dev/ttyACM0', 57600),
    'serial:///dev/ttyACM0': SerialUrl('/dev/ttyACM0', 57600),
    'serial:///dev/ttyACM0:921600': SerialUrl('/dev/ttyACM0', 921600),
    'serial-hwfc:///dev/ttyS1:921600': SerialUrl('/dev/ttyS1', 921600, True)}
# From the guide of MAVSDK and its CliArg tests.
MAVSDK: dict[str, Url] = {
    'udp://0.0.0.0:888': listen('0.0.0.0', 888),
    'udp://127.0.0.1:65535': send('127.0.0.1', 65535),
    'udpin://192.168.0.5:66': listen('192.168.0.5', 66),
    'udpout://192.168.0.5:66': send('192.168.0.5', 66),
    'tcpin://0.0.0.0:55': serve('0.0.0.0', 55),
    'tcpout://192.168.0.5:66': connect('192.168.0.5', 66),
    'serial_flowcontrol:///dev/ttyS0:4000000': SerialUrl('/dev/ttyS0', 4000000, True)}
PYMAVLINK: dict[str, Url] = {
    'udpin::14550': listen('', 14550),
    'udp:127.0.0.1:14550': listen('127.0.0.1', 14550),
    'udpout:127.0.0.1:14550': send('127.0.0.1', 14550),
    'udpbcast:192.168.2.255:14700': send('192.168.2.255', 14700, broadcast='always'),
    '127.0.0.1:14550': listen('127.0.0.1', 14550),
    ':14550': listen('', 14550),
    'tcp:127.0.0.1:5760': connect('127.0.0.1', 5760),
    'tcpin::5760': serve('', 5760),
    '/dev/ttyUSB0,57600': SerialUrl('/dev/ttyUSB0', 57600)}
# URLs that only this package has.
OURS: dict[str, Url] = {
    'udpin:[::]:14550': listen('::', 14550),
    'udp://[::]:14550': listen('::', 14550),
    'udpout://[fe80::1%eth0]:1': send('fe80::1%eth0', 1),
    'udp://[::1]:14541@[::1]:14540': send('::1', 14540, ('::1', 14541)),
    'udp://@[2001:db8::1]': send('2001:db8::1', 14550, ('', 14555)),
    'tcp://[::1]': connect('::1', 5760),
    '/dev/x:20000000': SerialUrl('/dev/x', 20_000_000),
    '/dev/by-path/pci-0000:00-port0:1': SerialUrl('/dev/by-path/pci-0000:00-port0', 1),
    'serial://auto': AutoUrl(),
    'serial://auto:9600?serial=SIM-1-243&ports=/dev/ttyUSB*': AutoUrl(
        (9600,), '/dev/ttyUSB*', 'SIM-1-243'),
    'serial://auto?kind=autopilot': AutoUrl(devices=(frozenset({'autopilot'}),)),
    'pty://': PtyUrl(),
    'pty:///tmp/ttyCAMERA': PtyUrl('/tmp/ttyCAMERA'),
    'memory://bench': MemoryUrl('bench')}
# Wrong URL -> the wrong part, and the reason.
WRONG: dict[str, tuple[str, str]] = {
    '': ('', 'it is empty'),
    'serial://auto?kind=lamp': ('lamp', 'is not one of autopilot'),
    'serial://auto?baud=9600': ('baud=9600', 'is not ports=PATTERN, serial=NUMBER or kind=KIND'),
    'udp://127.0.0.1': ("'127.0.0.1'", 'no port'),
    '/udp://localhost:99': ("'/udp://localhost:99'", 'not a device path'),
    'udp//localhost:99': ("'udp//localhost'", 'not a valid host name'),
    'ud://localhost:99': ("'ud'", 'unknown scheme'),
    'udp://0.0.0.0:65536': ('65536', 'outside 1..65535'),
    'udp://127.0.0.1:0': ('0', 'outside 1..65535'),
    'udpout://127.0.0.1:0x50': ("'0x50'", 'not a number'),
    'udpout://0.0.0.0:55': ("'0.0.0.0'", 'not an address to send to'),
    'udpout://:55': ("':55'", 'no host'),
    'tcpout://[::]:55': ("'::'", 'not an address to send to'),
    'serial:/dev/ttyS0:57600': ("'serial:'", 'needs "//"'),
    'serial://COM13:57600': ("'COM13:57600'", 'not an absolute device path'),
    'serial:///dev/ttyS0:0': ("'0'", 'not a baud rate'),
    'serial_flowcontrol:///dev/ttyS0:20000001': ("'20000001'", 'not a baud rate'),
    '/dev/ttyUSB0,fast': ("'fast'", 'not a baud rate'),
    'udp://:1@:99': ("'@:99'", 'a port without a host'),
    'udp-b://10.0.0.255:14550': ("'10.0.0.255:14550'", 'lacks the "@"'),
    'udpbcast::14550': ("':14550'", 'no host'),
    'udp://@?ids=1,240': ("'?ids=1,240'", 'system_id and component_id'),
    'tcp://10.0.0.2:5760/path': ("'/path'", 'not supported'),
    'tcpin://': ('', 'it names no port'),
    '/dev/ttyACM0': ("'/dev/ttyACM0'", 'MAVROS would take 57600 and pymavlink 115200'),
    # Where MAVROS connects to this machine, MAVSDK listens.
    'tcp://:5762': ("':5762'", 'tcpout://localhost:5762 or tcpin://0.0.0.0:5762'),
    **{f'{scheme}:host:1': (f"'{scheme}:'", 'not supported') for scheme in (
        'mcast', 'uds', 'unix', 'ws', 'wss', 'wsserver', 'csv')},
    'flight.tlog': ("'flight.tlog'", 'neither a scheme nor a device path'),
    'tcpout:host:1': ("'tcpout:'", 'needs "//"'),
    'udpin://::1:14550': ("'::1:14550'", 'in brackets'),
    'udpin://[1.2.3.4]:14550': ("'1.2.3.4'", 'not an IPv6 address'),
    'udpin://[::1]': ("'[::1]'", 'no port'),
    'udpin://ho st:1': ("' '", 'not allowed'),
    'udpin://host:1\n': (r"'\n'", 'not allowed'),
    'udpin://höst:1': ("'höst'", 'not a valid host name'),
    'memory://': ('memory://', 'no name'),
    'pty://ttyCAMERA': ("'ttyCAMERA'", 'not an absolute path'),
    'udpin://host:' + '1' * 5000: ('1' * 5000, 'outside 1..65535'),
    'serial:///dev/x:' + '1' * 5000: ('1' * 5000, 'not a baud rate')}


@pytest.mark.parametrize(('text', 'meaning'), [
    (text, meaning) for family in (MAVROS, MAVSDK, PYMAVLINK, OURS)
    for text, meaning in family.items()])
def test_url_means_the_same_as_in_the_program_of_its_notation(text: str, meaning: Url) -> None:
    url = parse_url(text)
    # Named tuples of different types can be equal.
    assert (type(url), url) == (type(meaning), meaning)


@pytest.mark.parametrize(('text', 'part', 'reason'), [
    (text, *said) for text, said in WRONG.items()], ids=lambda value: value[:50])
def test_error_quotes_the_url_and_its_wrong_part(text: str, part: str, reason: str) -> None:
    with pytest.raises(UrlError) as caught:
        parse_url(text)
    said = str(caught.value).removeprefix(f'connection URL {text!r}: ')
    assert len(said) < len(str(caught.value))
    assert part in said
    assert reason in said


def test_a_search_takes_the_kinds_of_the_payloads_that_the_program_knows() -> None:
    known = DeviceKind('deck winch', 42), DeviceKind('MicaSense camera', 0, option='camera')

    for option, kind in (('deck_winch', 'deck winch'), ('camera', 'MicaSense camera')):
        url = parse_url(f'serial://auto?kind={option}', known=known)
        assert url == AutoUrl(devices=(frozenset({kind}),), known=known)
    with pytest.raises(UrlError, match='is not one of deck_winch, camera, autopilot'):
        parse_url('serial://auto?kind=light', known=known)


def test_examples_of_the_error_message_are_right_and_addresses_read_as_they_are_written() -> None:
    assert all(map(parse_url, EXAMPLES))
    assert [str(HostPort(host, 5)) for host in ('::1', 'h', '')] == ['[::1]:5', 'h:5', ':5']


pieces = st.lists(st.sampled_from([
    'udp', 'udpin', 'udpout', 'tcp', 'tcp-l', 'serial', 'udp-b', 'memory', '://', ':', '@', '/',
    '[', ']', '::1', '%', ',', '?', '/dev/x', '0.0.0.0', '.', '1', '14550', '9' * 20, 'host', '٣',
    '²', '\0']) | st.text(max_size=4), max_size=9).map(''.join)


@given(st.text() | pieces)
@example('\ud800')
@example('udpin://[fe80::1%]:1')
@settings(max_examples=100)
def test_any_text_has_a_meaning_or_is_a_wrong_url(text: str) -> None:
    try:
        url = parse_url(text)
    except UrlError as error:
        assert repr(text) in str(error)
    else:
        assert isinstance(url, Url)
