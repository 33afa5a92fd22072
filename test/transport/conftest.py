# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Channels and links over loopback, ended and closed after each test."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
from pathlib import Path
import socket

from illuminator_ros.mavlink.transport import open_channel
from illuminator_ros.mavlink.url import parse_url, Url
import pytest
from support.live_link import resources, Run, wait_for_resources
from support.open_channel import Open, OpenChannel
from support.ptys import PtyDevice


def _has_ipv6() -> bool:
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET6, socket.SOCK_DGRAM) as probe:
        probe.bind(('::1', 0))
        return True
    return False


@pytest.fixture(params=['127.0.0.1', '[::1]'])
def loopback(request: pytest.FixtureRequest) -> str:
    """Return the loopback address of either IP version, as in a URL."""
    if request.param == '[::1]' and not _has_ipv6():
        pytest.skip('this machine has no ::1')
    return str(request.param)


@pytest.fixture
def run() -> Iterator[Run]:
    """Return a function that keeps a link until the test ends, and then checks for leaks."""
    before, one = resources(), Run()
    yield one
    one.stop()
    wait_for_resources(*before)


@pytest.fixture
def channel() -> Iterator[Open]:
    """Return a function that opens a channel, to be closed when the test ends."""
    with contextlib.ExitStack() as opened:
        def open_one(url: str | Url) -> OpenChannel:
            one = OpenChannel(open_channel(parse_url(url) if isinstance(url, str) else url))
            opened.callback(one.close)
            return one

        yield open_one


@pytest.fixture
def device(tmp_path: Path) -> Iterator[PtyDevice]:
    """Return a serial device."""
    pytest.importorskip('serial', reason='pyserial is not installed')
    one = PtyDevice(tmp_path)
    yield one
    one.pull_out()
