# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Errors of opening, and their messages."""

from __future__ import annotations

import os
from pathlib import Path
import re
import socket
import sys
from types import SimpleNamespace
from typing import Any

from illuminator_ros.mavlink.transport import open_channel, tcp
from illuminator_ros.mavlink.url import HostPort, parse_url, UdpUrl
import pytest
from support.open_channel import bound_socket, listening_socket
from support.ports import free_port
from support.ptys import PtyDevice


def reason(url: str) -> str:
    """Return the reason why a URL cannot be opened."""
    with pytest.raises(OSError, match='cannot|no answer|pyserial') as caught:
        open_channel(parse_url(url))
    return caught.value.strerror or str(caught.value)


@pytest.mark.parametrize('scheme', ['udpin', 'tcpin'])
def test_port_in_use_is_named(scheme: str, loopback: str) -> None:
    with (bound_socket if scheme == 'udpin' else listening_socket)(loopback) as taken:
        port = taken.getsockname()[1]
        assert reason(f'{scheme}://{loopback}:{port}') == (
            f'cannot listen on {loopback}:{port}: Address already in use '
            '(doc/routers.md: several programs on one link)')


@pytest.mark.parametrize(('url', 'said'), [
    *((f'{scheme}://192.0.2.1:14550', r'cannot listen on 192\.0\.2\.1:14550: Cannot assign .*')
      for scheme in ('udpin', 'tcpin')),
    *((f'{scheme}://{name}:14550', f'cannot resolve {name!r}: .+')
      for scheme in ('udpin', 'udpout', 'tcpin', 'tcpout')
      for name in ('no-such-host.invalid', f'{"x" * 70}.invalid')),
    ('tcp://127.0.0.1:{port}', 'cannot connect to 127.0.0.1:{port}: Connection refused'),
    ('serial://{path}/nothing:57600',
     'cannot open {path}/nothing: there is no such port: .*'),
    ('serial://{path}/file:57600', 'cannot open {path}/file: it is not a serial port'),
    ('serial://{path}:57600', 'cannot open {path}: Is a directory'),
    ('serial://{path}/others:57600', 'cannot open {path}/others: no permission; join its group.+')
])
def test_error_names_address_or_device_and_reason(
        tmp_path: Path, url: str, said: str) -> None:
    if 'serial' in url:
        pytest.importorskip('serial', reason='pyserial is not installed')
    if 'others' in url and os.geteuid() == 0:
        pytest.skip('root may open everything')
    (tmp_path / 'file').touch()
    (tmp_path / 'others').touch(mode=0)
    values = {'port': free_port(socket.SOCK_STREAM), 'path': tmp_path}
    assert re.fullmatch(said.format(**values), reason(url.format(**values)))


def test_missing_pyserial_is_named_with_the_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, 'serial', None)
    assert 'apt install python3-serial' in reason('serial:///dev/ttyLIGHT:57600')


def test_old_pyserial_is_named_with_its_version_and_the_remedy(
        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, 'serial', SimpleNamespace(__version__='3.4b1'))
    with pytest.raises(OSError, match="pyserial 3.4b1 is too old; .* pip install 'pyserial>=3.5'"):
        open_channel(parse_url('serial:///dev/ttyLIGHT:57600'))


def test_serial_device_is_closed_for_other_programs_while_it_is_open(device: PtyDevice) -> None:
    ours = open_channel(parse_url(f'serial://{device.path}:57600'))
    assert reason(f'serial://{device.path}:57600') == (
        f'cannot open {device.path}: it is in use by a program of another user, which root can '
        'see: end it, or share its link (doc/routers.md)')
    ours.close()
    open_channel(parse_url(f'serial://{device.path}:57600')).close()


def test_tcp_server_that_does_not_answer_is_given_up_in_time(
        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tcp, 'CONNECT_TIMEOUT', 0.05)
    # The queue of this server is full, so the kernel drops connection requests.
    with bound_socket(kind=socket.SOCK_STREAM) as silent:
        silent.listen(0)
        clients = [socket.socket() for _ in range(4)]
        for client in clients:
            client.setblocking(False)
            client.connect_ex(silent.getsockname())
        port = silent.getsockname()[1]
        assert reason(f'tcp://127.0.0.1:{port}') == f'no answer from 127.0.0.1:{port}'
    for client in clients:
        client.close()


class _Selfish(socket.socket):
    """Connects to itself, as the kernel does if the free port that it picks is the target."""

    def connect(self, address: Any) -> None:
        self.bind(address)
        super().connect(address)


def test_connection_with_itself_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    port = free_port(socket.SOCK_STREAM)
    monkeypatch.setattr(socket, 'socket', _Selfish)
    assert reason(f'tcp://127.0.0.1:{port}').endswith('no program listens there')


def test_addresses_of_different_ip_versions_are_named() -> None:
    with pytest.raises(OSError, match=r'127\.0\.0\.1:1.*\[::1\]:2.*different IP versions'):
        open_channel(UdpUrl(HostPort('127.0.0.1', 1), HostPort('::1', 2)))
