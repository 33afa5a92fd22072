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

"""Uptimes tell whether a light runs on or has restarted, or whether a frame is late."""

from __future__ import annotations

from illuminator_ros.illuminator.status import Uptime, UptimeClock, WRAP_MS
import pytest

RUNNING, RESTARTED, LATE, NO_CLOCK = (
    Uptime.RUNNING, Uptime.RESTARTED, Uptime.LATE, Uptime.NO_CLOCK)
HOUR_MS, DAY_MS = 3_600_000, 86_400_000


def meanings(*statuses: tuple[int, float]) -> list[Uptime]:
    """Return the meanings of uptimes, ms, that come at times, s."""
    clock = UptimeClock()
    return [clock.take(uptime_ms, now) for uptime_ms, now in statuses]


@pytest.mark.parametrize(('last_ms', 'new_ms', 'elapsed', 'meaning'), [
    # A stream, and the effects of clocks and lines on it.
    (10_000, 11_000, 1.0, RUNNING),
    (10_000, 11_000, 0.2, RUNNING),
    (10_000, 11_000, 2.5, RUNNING),
    (10_000, 10_001, 0.001, RUNNING),
    (HOUR_MS, 2 * HOUR_MS, 3600.0, RUNNING),
    (HOUR_MS, 2 * HOUR_MS + 100_000, 3600.0, RUNNING),
    (HOUR_MS, 2 * HOUR_MS - 100_000, 3600.0, RUNNING),
    # The next status, in time, after a status that was 4 s late.
    (10_000, 14_100, 0.1, RUNNING),
    # The same one twice.
    (10_000, 10_000, 0.0, RUNNING),
    # A wrap after 49.7 days.
    (WRAP_MS - 500, 500, 1.0, RUNNING),
    (WRAP_MS - HOUR_MS, HOUR_MS, 7200.0, RUNNING),
    # Late frames: newer ones have come before, however old these are.
    (10_000, 9_000, 0.1, LATE),
    (10_000, 4_000, 0.1, LATE),
    (DAY_MS, DAY_MS - 20_000, 1.0, LATE),
    (500, WRAP_MS - 500, 0.1, LATE),
    # A frame from just after the start of a light that has started lately may be late, too.
    (10_000, 300, 1.0, LATE),
    (200, 100, 0.001, LATE),
    (10_000, 50_000, 100.0, LATE),
    # Restarts: a frame that old does not come.
    (DAY_MS, 0, 1.0, RESTARTED),
    (DAY_MS, 1_500, 2.0, RESTARTED),
    (DAY_MS, HOUR_MS, 2 * 3600.0, RESTARTED),
    # A light without a clock.
    (0, 0, 1.0, RUNNING),
    (0, 0, 2.0, NO_CLOCK),
    (7, 7, 10.0, NO_CLOCK),
])
def test_one_more_uptime_tells(
    last_ms: int, new_ms: int, elapsed: float, meaning: Uptime,
) -> None:
    assert meanings((last_ms, 100.0), (new_ms, 100.0 + elapsed))[-1] is meaning


@pytest.mark.parametrize(('statuses', 'meaning'), [
    # A second status goes on from the first: a delayed frame does not do that.
    ([(10_000, 100.0), (300, 101.0), (450, 101.15)], RESTARTED),
    # A second restart 1.1 s after the first, whose first status comes late.
    ([(DAY_MS, 97.0), (30, 100.0), (1_080, 102.18), (1_200, 102.3)], RESTARTED),
    # Lost for long, restarted, and running for longer than before by now.
    ([(10_000, 100.0), (90_000, 200.0), (90_200, 200.2)], RESTARTED),
    # Frames that were queued while this process was suspended come in a burst.
    ([(1_000, 100.0), (2_000, 105.0), (3_000, 105.01), (4_000, 105.02)], LATE),
    # One frame from the start of a light that comes late, before the stream goes on.
    ([(9_000, 100.0), (500, 101.0), (10_010, 101.01)], RUNNING),
    # A clock that was set back is followed once that has lasted.
    ([(DAY_MS, 100.0), (HOUR_MS, 101.0), (HOUR_MS + 1000, 102.0)], LATE),
    ([(DAY_MS, 100.0), (HOUR_MS, 101.0), (HOUR_MS + 5100, 106.1)], RESTARTED),
])
def test_several_uptimes_tell(statuses: list[tuple[int, float]], meaning: Uptime) -> None:
    assert meanings(*statuses)[-1] is meaning


@pytest.mark.parametrize('drift', [0.96, 1.0, 1.04])
@pytest.mark.parametrize('interval', [0.02, 1.0, 10.0, 3600.0])
def test_a_clock_that_is_a_little_wrong_is_no_restart(drift: float, interval: float) -> None:
    statuses = [(int(1000 * n * interval * drift), 50.0 + n * interval) for n in range(1, 200)]
    assert set(meanings(*statuses)) == {RUNNING}
