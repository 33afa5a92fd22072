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

"""Errors of opening, and their messages."""

from __future__ import annotations

from collections.abc import Callable
import os
from pathlib import Path
import socket

from illuminator_ros.mavlink.transport import open_channel
from illuminator_ros.mavlink.url import parse_url
import pytest
from support.open_channel import bound_socket, listening_socket


def reason(url: str) -> str:
    """Return why a URL cannot be opened."""
    with pytest.raises(OSError) as caught:
        open_channel(parse_url(url))
    return caught.value.strerror or str(caught.value)


@pytest.mark.parametrize(('scheme', 'taken_by'), [
    ('udpin', bound_socket), ('tcpin', listening_socket)])
def test_a_port_in_use(
    scheme: str, taken_by: Callable[[str], socket.socket], loopback: str,
) -> None:
    with taken_by(loopback) as taken:
        port = taken.getsockname()[1]
        assert reason(f'{scheme}://{loopback}:{port}') == (
            f'cannot listen on {loopback}:{port}: Address already in use')


@pytest.mark.parametrize('scheme', ['udpin', 'tcpin'])
def test_an_address_to_listen_on_that_is_not_ours(scheme: str) -> None:
    assert reason(f'{scheme}://192.0.2.1:14550') == (
        'cannot listen on 192.0.2.1:14550: Cannot assign requested address')


@pytest.mark.parametrize('scheme', ['udpin', 'udpout', 'tcpin', 'tcpout'])
@pytest.mark.parametrize('name', ['nobody.invalid', f'{"x" * 70}.invalid'])
def test_a_name_that_nobody_knows(scheme: str, name: str) -> None:
    assert reason(f'{scheme}://{name}:14550').startswith(f'cannot resolve {name!r}: ')


def test_a_device_that_is_not_there(tmp_path: Path) -> None:
    pytest.importorskip('serial', reason='pyserial is not installed')
    assert reason(f'serial://{tmp_path}/nothing:57600') == (
        f'cannot open {tmp_path}/nothing: No such file or directory')


def test_a_file_that_is_no_device(tmp_path: Path) -> None:
    pytest.importorskip('serial', reason='pyserial is not installed')
    path = tmp_path / 'file'
    path.touch()
    assert reason(f'serial://{path}:57600').startswith(f'cannot open {path}: ')


def test_a_device_that_belongs_to_others(tmp_path: Path) -> None:
    pytest.importorskip('serial', reason='pyserial is not installed')
    if os.geteuid() == 0:
        pytest.skip('root may open everything')
    path = tmp_path / 'device'
    path.touch(mode=0)
    assert reason(f'serial://{path}:57600') == f'cannot open {path}: Permission denied'
