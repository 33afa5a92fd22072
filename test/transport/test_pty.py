# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Pseudo-terminals that a channel makes: bytes, the link to the device, and unread bytes."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path
import select
import struct
import termios

from illuminator_ros.mavlink.transport import open_channel
from illuminator_ros.mavlink.transport.serial import MAX_UNREAD
from illuminator_ros.mavlink.url import PtyUrl
import pytest
from support.open_channel import Open, OpenChannel
from support.waiting import eventually, PATIENCE


def device_of(channel: OpenChannel) -> int:
    """Return a descriptor of the device that the channel's name announces."""
    path = channel.channel.name.partition('serial://')[2].partition(':')[0]
    return os.open(path, os.O_RDWR | os.O_NOCTTY)


def read(device: int, size: int = 1) -> bytes:
    """Return the readable bytes, at least ``size`` of them."""
    data = b''
    while len(data) < size:
        assert select.select([device], [], [], PATIENCE)[0]
        data += os.read(device, 4096)
    return data


@pytest.mark.parametrize('linked', [False, True])
def test_bytes_go_both_ways_unchanged(channel: Open, tmp_path: Path, linked: bool) -> None:
    every = bytes(range(256))
    one = channel(PtyUrl(str(tmp_path / 'tty') if linked else ''))
    device = device_of(one)
    one.broadcast(every)
    os.write(device, every)

    assert read(device, 256) == every
    assert one.receive_bytes(256) == every
    os.close(device)


def test_a_link_to_a_device_that_has_gone_is_replaced_and_removed_at_the_end(
        tmp_path: Path) -> None:
    link = tmp_path / 'tty'
    link.symlink_to('/dev/pts/gone')
    first, second = open_channel(PtyUrl(str(link))), open_channel(PtyUrl(str(link)))
    first.close()
    assert link.is_char_device()
    second.close()
    assert not link.is_symlink()


@pytest.mark.parametrize(('path', 'reason'), [
    ('file', 'exists and is not a symbolic link'), ('missing/tty', 'No such file or directory')])
def test_a_path_that_cannot_be_the_link_is_named(tmp_path: Path, path: str, reason: str) -> None:
    (tmp_path / 'file').write_text('precious')
    with pytest.raises(OSError, match=f'{tmp_path / path} to /dev/pts/.*: .*{reason}'):
        open_channel(PtyUrl(str(tmp_path / path)))
    assert (tmp_path / 'file').read_text() == 'precious'


def unread(device: int) -> int:
    return int(struct.unpack('i', fcntl.ioctl(device, termios.FIONREAD, bytes(4)))[0])


def test_bytes_that_no_program_reads_are_discarded_and_the_newest_are_kept(channel: Open) -> None:
    one = channel(PtyUrl())
    device = device_of(one)
    for number in range(100):
        before = unread(device)
        one.broadcast(bytes((number,)) * 100)
        # The kernel delivers the bytes a little later.
        eventually(lambda: unread(device) != before)  # noqa: B023 - called at once
    data = read(device)

    assert len(data) <= MAX_UNREAD + 100
    assert data.endswith(bytes((99,)) * 100)
    os.close(device)
