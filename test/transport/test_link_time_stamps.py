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

"""The time stamps of signing go on over restarts of the program."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from illuminator_ros.mavlink.link import STORE_INTERVAL
from illuminator_ros.mavlink.signing import Signing, SigningMode
from illuminator_ros.mavlink.signing_files import TimestampStore
import pytest
from support.live_link import Jump, LiveLink
from support.waiting import eventually, Log

# 1970, as a computer has it whose clock has not been set; and 2023. s, Unix time.
NO_CLOCK, NOW = 0.0, 1.7e9

Run = Callable[[LiveLink], LiveLink]


class Noting(TimestampStore):
    """A store that notes what it is given."""

    def __init__(self, directory: Path) -> None:
        super().__init__('key', 'test', directory)
        self.stored: Log[int] = Log()

    def store(self, timestamp: int, unix_time: float = 0.0, *, last: bool = False) -> None:
        super().store(timestamp, unix_time, last=last)
        self.stored.append(timestamp)


@pytest.fixture
def store(tmp_path: Path) -> Noting:
    return Noting(tmp_path)


def signer(store: TimestampStore, unix_time: float = NO_CLOCK) -> Signing:
    return Signing(SigningMode.SIGN, bytes(32), timestamp=store.begin(unix_time))


def signing_link(
    store: Noting, signing: Signing, unix_time: float = NO_CLOCK, **options: Any,
) -> LiveLink:
    """Return a link that has sent something signed."""
    link = LiveLink('memory://time_stamps', signing=signing, store=store,
                    wall_clock=lambda: unix_time, **options)
    link.wait_open()
    link.ask(lambda now: None)
    return link


def test_the_last_one_is_kept_when_the_link_ends(run: Run, store: Noting) -> None:
    signing = signer(store)

    run(signing_link(store, signing)).stop()

    assert signing.timestamp > 0
    assert store.load() == signing.timestamp


def test_the_next_run_goes_on_behind_the_last_one(run: Run, store: Noting) -> None:
    first = signer(store)
    run(signing_link(store, first)).stop()
    second = signer(store)

    run(signing_link(store, second)).stop()

    assert second.timestamp > first.timestamp > 0


def test_a_run_that_ends_without_a_word_repeats_none(run: Run, store: Noting) -> None:
    clock, signing = Jump(), signer(store)
    link = run(signing_link(store, signing, clock=clock))
    count = len(store.stored)

    clock.ahead += STORE_INTERVAL
    link.ask(lambda now: None)

    eventually(lambda: len(store.stored) > count, 'stored again')
    # The file as a crash leaves it.
    assert store.load() > store.stored[-1]
    assert store.load() > signing.timestamp


@pytest.mark.parametrize('unix_time', [NO_CLOCK, NOW])
def test_a_run_that_ends_so_as_soon_as_it_has_begun_repeats_none(
    run: Run, store: Noting, unix_time: float,
) -> None:
    signing = signer(store, unix_time)

    run(signing_link(store, signing, unix_time))

    assert store.load() > signing.timestamp > 0
