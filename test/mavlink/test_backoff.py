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

"""The pauses between tries to open a link."""

from __future__ import annotations

import itertools
import threading
from types import SimpleNamespace

from illuminator_ros.mavlink import connector as opener
from illuminator_ros.mavlink.connector import Backoff, Connector
from illuminator_ros.mavlink.transport import Channel
from illuminator_ros.mavlink.transport.tcp import CONNECT_TIMEOUT
from illuminator_ros.mavlink.url import MemoryUrl, Url
import pytest


def pauses(count: int, *, jitter: float = 1.0, spent: float = 0.0) -> list[float]:
    """Return the pauses after the first failures."""
    backoff = Backoff(lambda: jitter)
    found = []
    for _ in range(count):
        backoff.failed()
        found.append(backoff.pause(spent))
    return found


def test_the_first_try_comes_at_once() -> None:
    assert Backoff().pause(0.0) == 0.0


def test_pauses_double_up_to_the_longest() -> None:
    assert pauses(6) == [0.05, 0.1, 0.2, 0.4, 0.5, 0.5]


def test_every_pause_is_a_pause() -> None:
    # Without one a link that cannot be opened would keep a processor busy.
    assert min(pauses(50, jitter=0.0)) >= 0.025


@pytest.mark.parametrize('spent', [0.0, 0.3, CONNECT_TIMEOUT])
def test_tries_begin_within_a_second_of_each_other(spent: float) -> None:
    assert max(spent + pause for pause in pauses(50, spent=spent)) < 1.0


def test_a_try_that_took_long_is_followed_by_a_short_pause() -> None:
    assert pauses(50, spent=60.0)[-1] == 0.05


@pytest.mark.parametrize('failures', [1, 3, 50])
def test_jitter_shortens_pauses_down_to_half(failures: int) -> None:
    longest = pauses(failures, jitter=1.0)[-1]
    assert pauses(failures, jitter=0.0)[-1] == longest / 2


def test_two_bridges_do_not_knock_in_step() -> None:
    # With the randomness that is used when nothing else is said.
    def moments() -> list[float]:
        backoff, found = Backoff(), []
        for _ in range(10):
            backoff.failed()
            found.append(backoff.pause(0.0))
        return list(itertools.accumulate(found))

    assert moments() != moments()


def test_a_loss_of_what_worked_is_answered_at_once() -> None:
    backoff = Backoff(lambda: 1.0)
    for _ in range(10):
        backoff.failed()
    backoff.succeeded()
    assert backoff.pause(0.0) == 0.0


def test_failures_beyond_any_number_are_no_error() -> None:
    assert pauses(5000)[-1] == 0.5


def test_the_time_that_a_try_takes_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    now, spent, ended = [0.0], [], threading.Event()

    class Recorded(Backoff):

        def pause(self, seconds: float) -> float:
            spent.append(seconds)
            if len(spent) > 2:
                one.stop()
                ended.set()
            return 0.0

    def fail_slowly(url: Url) -> Channel:
        now[0] += 0.7
        raise OSError('nobody there')

    monkeypatch.setattr(opener, 'open_channel', fail_slowly)
    monkeypatch.setattr(opener, 'time', SimpleNamespace(monotonic=lambda: now[0]))
    one = Connector(MemoryUrl('x'), lambda channel: None, lambda reason: None, backoff=Recorded())
    one.start()
    assert ended.wait(20.0)
    assert spent == pytest.approx([0.0, 0.7, 0.7])
