# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""
Connection URLs in the notations of MAVROS, MAVSDK and pymavlink, with the meaning they have there.

An empty host to listen on means all interfaces, as in all three. IPv6 addresses are in brackets.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable
import ipaddress
import re
from typing import Literal, NamedTuple, NoReturn

from .device_kind import DeviceKind
from .errors import UrlError
from .search.component_kinds import AUTOPILOT
from .search.rate_scan import RATES

MAVROS_UDP_BIND_PORT = 14555
MAVROS_UDP_REMOTE_PORT = 14550
MAVROS_TCP_PORT = 5760
MAVROS_BAUD = 57600
MAX_BAUD = 20_000_000

EXAMPLES = (
    'udpin://0.0.0.0:14550', 'udpout://192.168.1.10:14550', 'udp://:14541@127.0.0.1:14540',
    'tcpout://192.168.1.10:5760', 'serial:///dev/ttyACM0:57600')


class HostPort(NamedTuple):
    """Host name or IP address ('' = all interfaces, where listening) and port (0 = any)."""

    host: str
    port: int

    def __str__(self) -> str:
        return f'[{self.host}]:{self.port}' if ':' in self.host else f'{self.host}:{self.port}'


# All interfaces, with a port that the system chooses.
ANY = HostPort('', 0)


# When the remote gets messages as a broadcast address: never, until a peer is heard, or always.
Broadcast = Literal['', 'until_peer', 'always']


class UdpUrl(NamedTuple):
    """
    A UDP socket.

    :param bind: the local address; port 0 means any free one.
    :param remote: the only address it sends to; None means the peers that it hears.
    :param broadcast: when the remote is used as a broadcast address; '' if it is not one.
    """

    bind: HostPort
    remote: HostPort | None = None
    broadcast: Broadcast = ''


class TcpUrl(NamedTuple):
    """A TCP client, or a server where ``listen`` is set."""

    address: HostPort
    listen: bool = False


class SerialUrl(NamedTuple):
    """A serial port: device path, rate (Bd, up to :data:`MAX_BAUD`) and RTS/CTS flow control."""

    device: str
    baud: int
    hardware_flow_control: bool = False

    def __str__(self) -> str:
        scheme = 'serial-hwfc' if self.hardware_flow_control else 'serial'
        return f'{scheme}://{self.device}:{self.baud}'


class AutoUrl(NamedTuple):
    """
    The serial port on which a device is heard.

    :param rates: to try, Bd.
    :param ports: pattern of the paths of the ports, '' for those of the machine.
    :param serial: the serial number of the device, '' for any.
    :param known: the devices of payloads.
    :param devices: the sets of kinds, one of which must be heard; see
        :func:`~.component_kinds.kinds`. By default any of :attr:`known`.
    """

    rates: tuple[int, ...] = RATES
    ports: str = ''
    serial: str = ''
    devices: tuple[frozenset[str], ...] = ()
    known: tuple[DeviceKind, ...] = ()


class PtyUrl(NamedTuple):
    """
    A pseudo-terminal to be made: a serial line within this machine, without hardware.

    :param link: path of a symbolic link to its device, '' for none.
    """

    link: str = ''


class MemoryUrl(NamedTuple):
    """An in-process link for tests and examples: both sides open the same name."""

    name: str


Url = UdpUrl | TcpUrl | SerialUrl | AutoUrl | PtyUrl | MemoryUrl


def parse_url(
    text: str, *, can_search: bool = True, known: Collection[DeviceKind] = (),
) -> Url:
    """
    Parse a connection URL.

    :param can_search: whether the program looks for a device, as ``serial://auto`` does.
    :param known: the devices that it may look for.
    :raises UrlError: if it is wrong; the message quotes the wrong part.
    """
    parser = _Parser(text, known)
    url = parser.parse()
    if isinstance(url, AutoUrl) and not can_search:
        parser.fail('only the nodes and conformance look for a device')
    return url


def resource(url: Url) -> Hashable:
    """Return what a URL opens: two URLs with the same one cannot be used together."""
    if isinstance(url, SerialUrl):
        return url.device
    # A port that the system chooses is another one each time.
    if isinstance(url, UdpUrl) and url.bind.port:
        return UdpUrl, url.bind
    return url


class _Parser:
    """Parses one URL; keeps it for the error messages."""

    def __init__(self, text: str, known: Collection[DeviceKind]) -> None:
        self.text = text
        self.known = tuple(known)

    def parse(self) -> Url:
        text = self.text
        if not text:
            self.fail('it is empty')
        if bad := re.search(r'[\s\x00-\x1f\x7f]', text):
            self.fail(f'{bad.group()!r} is not allowed in a URL')
        if text.startswith('/'):
            return self.device(text)
        if match := re.fullmatch(r'serial://auto(?::([^?]*))?(?:\?(.*))?', text):
            return self.auto(*match.groups())
        if '?' in text:
            query = text[text.index('?'):]
            self.fail(f'{query!r}: options are not supported; set the parameters system_id '
                      'and component_id')
        scheme, slashes, rest = text.partition('://')
        if slashes:
            if scheme.lower() not in _WITH_SLASHES:
                self.fail(f'unknown scheme {scheme!r}; known are '
                          + ', '.join(f'{name}://' for name in _WITH_SLASHES))
            if not scheme.lower().startswith(('serial', 'pty', 'memory')):
                rest = self.no_path(rest)
            return _WITH_SLASHES[scheme.lower()](self, rest)
        scheme, colon, rest = text.partition(':')
        if not colon:
            self.fail(f'{text!r} names neither a scheme nor a device path')
        if scheme in _WITHOUT_SLASHES:
            return _WITHOUT_SLASHES[scheme](self, self.no_path(rest))
        if scheme in _NOT_HERE:
            self.fail(f'{scheme + colon!r} of pymavlink is not supported here')
        if scheme in _WITH_SLASHES:
            self.fail(f'{scheme + colon!r} needs "//" after it')
        # pymavlink takes a bare host:port as an address to listen on with UDP.
        return UdpUrl(self.address(text))

    def fail(self, reason: str) -> NoReturn:
        raise UrlError(f'connection URL {self.text!r}: {reason}; for example '
                       + ' or '.join(EXAMPLES[::2]))

    # Addresses

    def address(
        self, text: str, *, default_host: str | None = '', default_port: int | None = None,
    ) -> HostPort:
        """Return host and port of ``[host][:port]``; a part without a default is required."""
        if match := re.fullmatch(r'\[([^\[\]]*)\](?::(.*))?', text):
            host, port = match.groups()
            if _ip_version(host) != 6:
                self.fail(f'{host!r} in brackets is not an IPv6 address')
        else:
            host, colon, port = text.partition(':')
            port = port if colon else None
            if ':' in (port or ''):
                self.fail(f'{text!r}: an IPv6 address must be in brackets, as in [::1]:14550')
            if not re.fullmatch(r'[A-Za-z0-9._-]*', host):
                self.fail(f'{host!r} is not a valid host name')
            if re.fullmatch(r'[0-9.]+', host) and _ip_version(host) != 4:
                self.fail(f'{host!r} is not an IPv4 address')
        if not host:
            if default_host is None:
                self.fail(f'no host in {text!r}')
            host = default_host
        if port is None:
            if default_port is None:
                self.fail(f'no port in {text!r}' if text else 'it names no port')
            return HostPort(host, default_port)
        return HostPort(host, self.port(port))

    def remote(self, text: str, *, default_port: int | None = None) -> HostPort:
        """Return an address to send to: its host is required and must not mean "any"."""
        address = self.address(text, default_host=None, default_port=default_port)
        if _means_any(address.host):
            self.fail(f'{address.host!r} is not an address to send to')
        return address

    def port(self, text: str) -> int:
        if not re.fullmatch(r'[0-9]+', text):
            self.fail(f'port {text!r} is not a number')
        # Check the length first: int() refuses numbers of thousands of digits.
        if len(text) > 5 or not 1 <= int(text) <= 65535:
            self.fail(f'port {text} is outside 1..65535')
        return int(text)

    # Schemes

    def udp(self, rest: str) -> Url:
        """
        Read MAVROS's ``udp://[bind]@[remote]`` or, without ``@``, MAVSDK's ``udp://host:port``.

        MAVROS ignores a remote port without a host, which is refused here. MAVSDK listens if the
        host means "any" and sends otherwise.
        """
        bind, at, remote = rest.partition('@')
        if not at:
            address = self.address(bind)
            return UdpUrl(address) if _means_any(address.host) else UdpUrl(ANY, self.remote(bind))
        bound = self.address(bind, default_port=MAVROS_UDP_BIND_PORT)
        if not remote:
            return UdpUrl(bound)
        if remote.startswith(':'):
            self.fail(f'{at + remote!r} names a port without a host: leave it out, as in '
                      f'udp://{bind + at}')
        return UdpUrl(bound, self.remote(remote, default_port=MAVROS_UDP_REMOTE_PORT))

    def udp_broadcast(self, rest: str, kind: Broadcast) -> Url:
        bind, at, remote = rest.partition('@')
        if not at:
            self.fail(f'{rest!r} lacks the "@" before the broadcast address')
        return UdpUrl(
            self.address(bind, default_port=MAVROS_UDP_BIND_PORT),
            self.address(remote, default_host='255.255.255.255',
                         default_port=MAVROS_UDP_REMOTE_PORT), kind)

    def tcp(self, rest: str) -> Url:
        """Read ``tcp://``: a client with MAVROS's defaults; MAVSDK listens without a host."""
        address = self.address(rest or 'localhost', default_port=MAVROS_TCP_PORT)
        if _means_any(address.host):
            self.fail(f'{rest!r} connects to this machine in MAVROS and listens in MAVSDK: use '
                      f'tcpout://localhost:{address.port} or tcpin://0.0.0.0:{address.port}')
        return TcpUrl(address)

    def serial(self, rest: str, hardware_flow_control: bool = False) -> Url:
        if not rest.startswith('/'):
            self.fail(f'{rest!r} is not an absolute device path, '
                      'as in serial:///dev/ttyACM0:57600')
        device, colon, baud = rest.rpartition(':')
        if not colon:
            return SerialUrl(rest, MAVROS_BAUD, hardware_flow_control)
        return SerialUrl(device, self.baud(baud), hardware_flow_control)

    def auto(self, baud: str | None, query: str | None) -> Url:
        url = AutoUrl(RATES if baud is None else (self.baud(baud),), known=self.known)
        kinds = {**{one.option or one.name.replace(' ', '_'): one.name for one in self.known},
                 AUTOPILOT: AUTOPILOT}
        for option in query.split('&') if query else ():
            name, _, value = option.partition('=')
            if not value or name not in ('ports', 'serial', 'kind'):
                self.fail(f'{option!r} is not ports=PATTERN, serial=NUMBER or kind=KIND')
            if name == 'kind':
                if value not in kinds:
                    self.fail(f'kind {value!r} is not one of {", ".join(kinds)}')
                url = url._replace(devices=(frozenset({kinds[value]}),))
            elif name == 'ports':
                url = url._replace(ports=value)
            else:
                url = url._replace(serial=value)
        return url

    def device(self, text: str) -> Url:
        """
        Read a bare path: ``/dev/x:baud`` of MAVROS or ``/dev/x,baud`` of pymavlink.

        The path may contain colons, as in /dev/serial/by-path.
        """
        if '://' in text:
            self.fail(f'{text!r} is not a device path')
        match = re.fullmatch(r'(.+)[,:]([^,:]*)', text)
        if not match:
            self.fail(f'no baud rate after {text!r}: MAVROS would take 57600 and pymavlink '
                      '115200')
        return SerialUrl(match.group(1), self.baud(match.group(2)))

    def pty(self, rest: str) -> Url:
        if rest and not rest.startswith('/'):
            self.fail(f'{rest!r} is not an absolute path, as in pty:///tmp/ttyDEVICE')
        return PtyUrl(rest)

    def memory(self, rest: str) -> Url:
        if not rest:
            self.fail('no name after "memory://"')
        return MemoryUrl(rest)

    def baud(self, text: str) -> int:
        if not re.fullmatch(r'[0-9]{1,8}', text) or not 1 <= int(text) <= MAX_BAUD:
            self.fail(f'{text!r} is not a baud rate')
        return int(text)

    def no_path(self, rest: str) -> str:
        """Return the part before the path; a single slash may follow, as in MAVROS's examples."""
        rest, slash, path = rest.partition('/')
        if path:
            self.fail(f'{slash + path!r} is not supported here')
        return rest


def _ip_version(host: str) -> int:
    """Return 4 or 6, 0 if it is not an IP address."""
    try:
        return ipaddress.ip_address(host).version
    except ValueError:
        return 0


def _means_any(host: str) -> bool:
    """Return whether a host means all interfaces."""
    return not host or _ip_version(host) > 0 and ipaddress.ip_address(host).is_unspecified


_Reader = Callable[[_Parser, str], Url]

_WITH_SLASHES: dict[str, _Reader] = {
    'udp': _Parser.udp,
    'udp-b': lambda parser, rest: parser.udp_broadcast(rest, 'until_peer'),
    'udp-pb': lambda parser, rest: parser.udp_broadcast(rest, 'always'),
    'udpin': lambda parser, rest: UdpUrl(parser.address(rest)),
    'udpout': lambda parser, rest: UdpUrl(ANY, parser.remote(rest)),
    'tcp': _Parser.tcp,
    'tcp-l': lambda parser, rest: TcpUrl(
        parser.address(rest, default_port=MAVROS_TCP_PORT), listen=True),
    'tcpout': lambda parser, rest: TcpUrl(parser.remote(rest)),
    'tcpin': lambda parser, rest: TcpUrl(parser.address(rest), listen=True),
    'serial': _Parser.serial,
    'serial-hwfc': lambda parser, rest: parser.serial(rest, True),
    'serial_flowcontrol': lambda parser, rest: parser.serial(rest, True),
    'pty': _Parser.pty,
    'memory': _Parser.memory,
}

_WITHOUT_SLASHES: dict[str, _Reader] = {
    'udpin': _WITH_SLASHES['udpin'],
    'udp': _WITH_SLASHES['udpin'],
    'udpout': _WITH_SLASHES['udpout'],
    'udpbcast': lambda parser, rest: UdpUrl(
        ANY, parser.address(rest, default_host=None), 'always'),
    'tcp': _WITH_SLASHES['tcpout'],
    'tcpin': _WITH_SLASHES['tcpin'],
}

# Other schemes of pymavlink, which would be taken for a host name before a port.
_NOT_HERE = ('mcast', 'uds', 'unix', 'ws', 'wss', 'wsserver', 'csv')
