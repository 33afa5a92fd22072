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

"""Channels and links over loopback, ended and closed after each test."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import selectors
import socket
from typing import Any

from illuminator_ros.mavlink.transport import open_channel
from illuminator_ros.mavlink.url import parse_url, Url
import pytest
from support.live_link import LiveLink, resources, wait_for_resources
from support.open_channel import OpenChannel


def _has_ipv6() -> bool:
    try:
        with socket.socket(socket.AF_INET6, socket.SOCK_DGRAM) as probe:
            probe.bind(('::1', 0))
    except OSError:
        return False
    return True


@pytest.fixture(params=['127.0.0.1', '[::1]'])
def loopback(request: pytest.FixtureRequest) -> str:
    """Return the loopback address of either IP version, as it stands in a URL."""
    if request.param == '[::1]' and not _has_ipv6():
        pytest.skip('this machine has no ::1')
    return str(request.param)


@pytest.fixture
def run() -> Iterator[Callable[..., Any]]:
    """Return a function that keeps a link until the test ends, and then checks for leaks."""
    threads, descriptors = resources()
    links: list[LiveLink] = []

    def keep(link: Any) -> Any:
        links.append(link)
        return link

    yield keep
    for link in links:
        link.stop()
    wait_for_resources(threads, descriptors)


@pytest.fixture
def channel() -> Iterator[Callable[[str | Url], OpenChannel]]:
    """Return a function that opens a channel, to be closed when the test ends."""
    opened: list[OpenChannel] = []

    def open_one(url: str | Url) -> OpenChannel:
        parsed = parse_url(url) if isinstance(url, str) else url
        opened.append(OpenChannel(open_channel(parsed)))
        return opened[-1]

    yield open_one
    for one in opened:
        one.close()


@pytest.fixture
def selector() -> Iterator[selectors.BaseSelector]:
    """Return a selector, to be closed when the test ends."""
    with selectors.DefaultSelector() as one:
        yield one
