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

"""In-memory channels."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from support.open_channel import OpenChannel

OpenFunction = Callable[[str], OpenChannel]


@pytest.fixture
def three(channel: OpenFunction) -> list[OpenChannel]:
    """Return three channels of one name."""
    return [channel('memory://one') for _ in range(3)]


def test_everybody_hears_everybody_else(three: list[OpenChannel]) -> None:
    three[0].broadcast(b'frame')
    assert [other.receive_bytes(5) for other in three[1:]] == [b'frame', b'frame']


def test_nobody_hears_himself(three: list[OpenChannel]) -> None:
    three[0].broadcast(b'frame')
    assert three[0].turn() == []


def test_names_are_links_of_their_own(channel: OpenFunction) -> None:
    channel('memory://one').broadcast(b'frame')
    assert channel('memory://other').turn() == []


def test_who_has_left_is_not_sent_to(three: list[OpenChannel]) -> None:
    three[1].close()
    three[0].broadcast(b'frame')
    assert three[2].receive_bytes(5) == b'frame'
    assert three[0].channel.dropped == 0


def test_what_nobody_reads_is_dropped_and_counted(three: list[OpenChannel]) -> None:
    while not three[0].channel.dropped:
        three[0].broadcast(bytes(280))
    assert len(three[1].turn()) > 1
