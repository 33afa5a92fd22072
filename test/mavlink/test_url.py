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

"""Connection URLs: every notation of the three families, and what is said of wrong ones."""

from __future__ import annotations

from hypothesis import example, given, settings
from hypothesis import strategies as st
from illuminator_ros.mavlink.url import (
    EXAMPLES,
    HostPort,
    MemoryUrl,
    parse_url,
    SerialUrl,
    TcpUrl,
    UdpUrl,
    Url,
    UrlError,
)
import pytest

# All interfaces, any free port.
ANY = HostPort('', 0)


def listen(host: str, port: int) -> UdpUrl:
    return UdpUrl(HostPort(host, port))


def send(host: str, port: int, bind: HostPort = ANY, broadcast: str = '') -> UdpUrl:
    return UdpUrl(bind, HostPort(host, port), broadcast)


def connect(host: str, port: int) -> TcpUrl:
    return TcpUrl(HostPort(host, port))


def serve(host: str, port: int) -> TcpUrl:
    return TcpUrl(HostPort(host, port), listen=True)


MAVROS: dict[str, Url] = {
    'udp://@': listen('', 14555),
    'udp://:14540@': listen('', 14540),
    'udp://0.0.0.0:14540@': listen('0.0.0.0', 14540),
    'udp://192.168.1.2@': listen('192.168.1.2', 14555),
    'udp://:14540@127.0.0.1:14557': send('127.0.0.1', 14557, HostPort('', 14540)),
    'udp://127.0.0.1:14540@10.0.0.2:14557': send('10.0.0.2', 14557, HostPort('127.0.0.1', 14540)),
    'udp://@10.0.0.2': send('10.0.0.2', 14550, HostPort('', 14555)),
    'udp://@drone.local:14551': send('drone.local', 14551, HostPort('', 14555)),
    'udp://0.0.0.0:14555@:14550': listen('0.0.0.0', 14555),
    'udp://:14540@127.0.0.1:14557/': send('127.0.0.1', 14557, HostPort('', 14540)),
    'UDP://:14540@': listen('', 14540),
    'udp-b://@': send('255.255.255.255', 14550, HostPort('', 14555), 'until_peer'),
    'udp-b://:14540@:14551': send('255.255.255.255', 14551, HostPort('', 14540), 'until_peer'),
    'udp-b://@10.0.0.255': send('10.0.0.255', 14550, HostPort('', 14555), 'until_peer'),
    'udp-pb://@': send('255.255.255.255', 14550, HostPort('', 14555), 'always'),
    'udp-pb://:14540@:14551': send('255.255.255.255', 14551, HostPort('', 14540), 'always'),
    'tcp://': connect('localhost', 5760),
    'tcp://10.0.0.2': connect('10.0.0.2', 5760),
    'tcp://10.0.0.2:5762': connect('10.0.0.2', 5762),
    'tcp://10.0.0.2:5762/': connect('10.0.0.2', 5762),
    'tcp-l://': serve('', 5760),
    'tcp-l://:5762': serve('', 5762),
    'tcp-l://10.0.0.1': serve('10.0.0.1', 5760),
    'tcp-l://0.0.0.0:5762': serve('0.0.0.0', 5762),
    '/dev/ttyACM0:57600': SerialUrl('/dev/ttyACM0', 57600),
    'serial:///dev/ttyACM0': SerialUrl('/dev/ttyACM0', 57600),
    'serial:///dev/ttyACM0:921600': SerialUrl('/dev/ttyACM0', 921600),
    'serial-hwfc:///dev/ttyS1:921600': SerialUrl('/dev/ttyS1', 921600, True),
    'serial-hwfc:///dev/ttyS1': SerialUrl('/dev/ttyS1', 57600, True),
}

# Those of its guide, and the right ones of its CliArg tests.
MAVSDK: dict[str, Url] = {
    'udp://:777': listen('', 777),
    'udp://0.0.0.0:888': listen('0.0.0.0', 888),
    'udp://127.0.0.1:555': send('127.0.0.1', 555),
    'udp://localhost:99': send('localhost', 99),
    'udp://example.com:77': send('example.com', 77),
    'udp://something.local:42': send('something.local', 42),
    'udp://127.0.0.1:65535': send('127.0.0.1', 65535),
    'udpin://0.0.0.0:55': listen('0.0.0.0', 55),
    'udpin://192.168.0.5:66': listen('192.168.0.5', 66),
    'udpout://192.168.0.5:66': send('192.168.0.5', 66),
    'tcp://127.0.0.1:999': connect('127.0.0.1', 999),
    'tcp://localhost:444': connect('localhost', 444),
    'tcp://example.com:1234': connect('example.com', 1234),
    'tcp://something.local:42': connect('something.local', 42),
    'tcpin://0.0.0.0:55': serve('0.0.0.0', 55),
    'tcpin://192.168.0.5:66': serve('192.168.0.5', 66),
    'tcpout://192.168.0.5:66': connect('192.168.0.5', 66),
    'serial:///dev/ttyS0:115200': SerialUrl('/dev/ttyS0', 115200),
    'serial:///dev/tty.usbmodem1:115200': SerialUrl('/dev/tty.usbmodem1', 115200),
    'serial_flowcontrol:///dev/ttyS0:4000000': SerialUrl('/dev/ttyS0', 4000000, True),
}

PYMAVLINK: dict[str, Url] = {
    'udpin:0.0.0.0:14550': listen('0.0.0.0', 14550),
    'udpin:localhost:14550': listen('localhost', 14550),
    'udpin::14550': listen('', 14550),
    'udp:127.0.0.1:14550': listen('127.0.0.1', 14550),
    'udpout:127.0.0.1:14550': send('127.0.0.1', 14550),
    'udpbcast:192.168.2.255:14700': send('192.168.2.255', 14700, broadcast='always'),
    '127.0.0.1:14550': listen('127.0.0.1', 14550),
    ':14550': listen('', 14550),
    'tcp:127.0.0.1:5760': connect('127.0.0.1', 5760),
    'tcpin:0.0.0.0:5760': serve('0.0.0.0', 5760),
    'tcpin::5760': serve('', 5760),
    '/dev/ttyUSB0,57600': SerialUrl('/dev/ttyUSB0', 57600),
}

# URLs that none of the three has.
OURS: dict[str, Url] = {
    'udpin://[::1]:14550': listen('::1', 14550),
    'udpin:[::]:14550': listen('::', 14550),
    'udp://[::]:14550': listen('::', 14550),
    'udpout://[fe80::1%eth0]:14550': send('fe80::1%eth0', 14550),
    'udp://[::1]:14541@[::1]:14540': send('::1', 14540, HostPort('::1', 14541)),
    'udp://@[2001:db8::1]': send('2001:db8::1', 14550, HostPort('', 14555)),
    'tcp://[::1]': connect('::1', 5760),
    '[::1]:14550': listen('::1', 14550),
    'udpin://:55': listen('', 55),
    'udpin://:1': listen('', 1),
    '/dev/x:1': SerialUrl('/dev/x', 1),
    '/dev/x:20000000': SerialUrl('/dev/x', 20_000_000),
    '/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0-port0:57600': SerialUrl(
        '/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0-port0', 57600),
    'memory://bench': MemoryUrl('bench'),
}

# Wrong URL -> the offending part, and what is said of it.
WRONG: dict[str, tuple[str, str]] = {
    # MAVSDK's CliArg tests and guide
    '': ('', 'it is empty'),
    'udp://127.0.0.1': ("'127.0.0.1'", 'no port'),
    'udp://555': ("'555'", 'not an IPv4 address'),
    'udp:/localhost:99': ("'/localhost:99'", 'not supported'),
    '/udp://localhost:99': ("'/udp://localhost:99'", 'not a device path'),
    'udp//localhost:99': ("'udp//localhost'", 'not a valid host name'),
    'ud://localhost:99': ("'ud'", 'unknown scheme'),
    'udp://0.0.0.0:100000': ('100000', 'outside 1..65535'),
    'udp://0.0.0.0:-5': ("'-5'", 'not a number'),
    'udpout://0.0.0.0:55': ("'0.0.0.0'", 'not an address to send to'),
    'udpout://:55': ("':55'", 'no host'),
    'tcpout://0.0.0.0:55': ("'0.0.0.0'", 'not an address to send to'),
    'tcp:/localhost:99': ("'/localhost:99'", 'not supported'),
    'tc://localhost:99': ("'tc'", 'unknown scheme'),
    'tcp://127.0.0.1:100000': ('100000', 'outside 1..65535'),
    'tcp://127.0.0.1:-5': ("'-5'", 'not a number'),
    'serial:///dev/ttyS0:': ("''", 'not a baud rate'),
    'serial///dev/ttyS0:57600': ("'serial///dev/ttyS0'", 'not a valid host name'),
    '/serial:///dev/ttyS0:57600': ("'/serial:///dev/ttyS0:57600'", 'not a device path'),
    'serial:/dev/ttyS0:57600': ("'serial:'", 'needs "//"'),
    'serial://dev/ttyS0:57600': ("'dev/ttyS0:57600'", 'not an absolute device path'),
    'serial://': ("''", 'not an absolute device path'),
    'serial://COM13:57600': ("'COM13:57600'", 'not an absolute device path'),
    'seri://COM3:57600': ("'seri'", 'unknown scheme'),
    'serial:///dev/ttyS0:-1': ("'-1'", 'not a baud rate'),
    'serial:///dev/ttyS0:0': ("'0'", 'not a baud rate'),
    'serial:///dev/ttyS0:57600xyz': ("'57600xyz'", 'not a baud rate'),
    'serial:///dev/ttyS0:20000001': ("'20000001'", 'not a baud rate'),
    'serial:///dev/ttyS0:999999999': ("'999999999'", 'not a baud rate'),
    'serial_flowcontrol:///dev/ttyS0:4000000nope': ("'4000000nope'", 'not a baud rate'),
    'raw://': ("'raw'", 'unknown scheme'),
    'udp://127.0.0.1:8080abc': ("'8080abc'", 'not a number'),
    'udpin://0.0.0.0:8080abc': ("'8080abc'", 'not a number'),
    'udpout://127.0.0.1:0x50': ("'0x50'", 'not a number'),
    'tcpout://127.0.0.1:14550junk': ("'14550junk'", 'not a number'),
    'tcpin://0.0.0.0:5760x': ("'5760x'", 'not a number'),
    'udp://127.0.0.1:0': ('0', 'outside 1..65535'),
    'tcpout://127.0.0.1:0': ('0', 'outside 1..65535'),
    # MAVROS
    'udp://:abc@': ("'abc'", 'not a number'),
    'udp://:70000@': ('70000', 'outside 1..65535'),
    'udp://@host:abc': ("'abc'", 'not a number'),
    'udp://@:99999': ('99999', 'outside 1..65535'),
    'udp://@0.0.0.0:14550': ("'0.0.0.0'", 'not an address to send to'),
    'udp://a@b@c': ("'b@c'", 'not a valid host name'),
    'udp-b://10.0.0.255:14550': ("'10.0.0.255:14550'", 'lacks the "@"'),
    'udp://@?ids=1,240': ("'?ids=1,240'", 'system_id and component_id'),
    'tcp://10.0.0.2:5760/path': ("'/path'", 'not supported'),
    'tcpin://': ("''", 'no port'),
    '/dev/ttyACM0': ("'/dev/ttyACM0'", 'MAVROS would take 57600 and pymavlink 115200'),
    # Where MAVROS connects to this machine, MAVSDK listens.
    'tcp://:5762': ("':5762'", 'tcpout://localhost:5762 or tcpin://0.0.0.0:5762'),
    'tcp://0.0.0.0:5762': ("'0.0.0.0:5762'", 'tcpout://localhost:5762'),
    # pymavlink
    'udpout:127.0.0.1': ("'127.0.0.1'", 'no port'),
    'udpout:127.0.0.1:99999': ('99999', 'outside 1..65535'),
    'mcast:14550': ("'mcast:'", 'not supported'),
    'mcast:239.255.145.50:14550': ("'mcast:'", 'not supported'),
    'ws://host:1': ("'ws'", 'unknown scheme'),
    'wss:host:443': ("'wss:'", 'not supported'),
    'wsserver:0.0.0.0:5000': ("'wsserver:'", 'not supported'),
    'uds:/tmp/mavlink': ("'uds:'", 'not supported'),
    'csv:flight.csv': ("'csv:'", 'not supported'),
    '/dev/ttyUSB0,fast': ("'fast'", 'not a baud rate'),
    'flight.tlog': ("'flight.tlog'", 'neither a scheme nor a device path'),
    'tcpout:host:1': ("'tcpout:'", 'needs "//"'),
    # Ours
    'udpin://::1:14550': ("'::1:14550'", 'in brackets'),
    'udpin://[1.2.3.4]:14550': ("'1.2.3.4'", 'not an IPv6 address'),
    'udpin://[:::]:14550': ("':::'", 'not an IPv6 address'),
    'udpin://[::1]': ("'[::1]'", 'no port'),
    'udpout://[::]:14550': ("'::'", 'not an address to send to'),
    'udpin://300.1.1.1:14550': ("'300.1.1.1'", 'not an IPv4 address'),
    'udpin://ho st:1': ("' '", 'not allowed'),
    'udpin://host:1\n': (r"'\n'", 'not allowed'),
    'udpin://höst:1': ("'höst'", 'not a valid host name'),
    'memory://': ('memory://', 'no name'),
    'udpin://host:' + '1' * 5000: ('1' * 5000, 'outside 1..65535'),
    'serial:///dev/x:' + '1' * 5000: ('1' * 5000, 'not a baud rate'),
    'udpin://1.2.3.' + '1' * 5000 + ':1': ('1' * 5000, 'not an IPv4 address'),
}


@pytest.mark.parametrize(('text', 'meaning'), [
    (text, meaning) for family in (MAVROS, MAVSDK, PYMAVLINK, OURS)
    for text, meaning in family.items()])
def test_notation_means_what_it_means_where_it_comes_from(text: str, meaning: Url) -> None:
    assert parse_url(text) == meaning


@pytest.mark.parametrize(('text', 'part', 'reason'), [
    (text, *said) for text, said in WRONG.items()], ids=lambda value: value[:50])
def test_error_quotes_the_url_and_the_offending_part(text: str, part: str, reason: str) -> None:
    with pytest.raises(UrlError) as caught:
        parse_url(text)
    said = str(caught.value).removeprefix(f'connection URL {text!r}: ')
    assert len(said) < len(str(caught.value))
    assert part in said
    assert reason in said


@pytest.mark.parametrize('text', EXAMPLES)
def test_example_of_the_error_message_is_right(text: str) -> None:
    assert parse_url(text)


def test_address_reads_as_it_is_written() -> None:
    assert [str(HostPort('::1', 5)), str(HostPort('h', 5)), str(HostPort('', 5))] == [
        '[::1]:5', 'h:5', ':5']


pieces = st.lists(st.one_of(
    st.sampled_from(['udp', 'udpin', 'udpout', 'tcp', 'tcp-l', 'serial', 'udp-b', 'memory', '://',
                     ':', '@', '/', '[', ']', '::1', '%', ',', '?', '/dev/x', '0.0.0.0', '.', '1',
                     '14550', '9' * 20, 'host', '٣', '²', '\0']),
    st.text(max_size=4)), max_size=9).map(''.join)


@given(st.one_of(st.text(), pieces))
@example('\ud800')
@example('udpin://[fe80::1%]:1')
@settings(derandomize=True, deadline=None, max_examples=500)
def test_any_text_has_a_meaning_or_is_a_wrong_url(text: str) -> None:
    try:
        url = parse_url(text)
    except UrlError as error:
        assert repr(text) in str(error)
    else:
        assert isinstance(url, Url)
