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

"""What an uptime tells beside the one before."""

from illuminator_ros.illuminator.uptime import compare_uptime, Uptime, WRAP_MS
import pytest

RUNNING, RESTARTED = Uptime.RUNNING, Uptime.RESTARTED
LATE, NO_CLOCK = Uptime.LATE, Uptime.NO_CLOCK
HOUR_MS, DAY_MS = 3_600_000, 86_400_000


def test_a_light_that_was_never_lost_has_not_restarted_and_overtaken_itself():
    # We stood still for 5 s while the light had just started; its statuses were queued.
    assert compare_uptime(3_000, 4_000, 5.0, away=False) is RUNNING
    assert compare_uptime(3_000, 4_000, 5.0, away=True) is RESTARTED


def test_two_statuses_swapped_just_after_the_start_are_no_restart():
    assert compare_uptime(200, 100, 0.001, away=False) is LATE


@pytest.mark.parametrize(('last_ms', 'new_ms', 'elapsed', 'meaning'), [
    # A stream, with what clocks and lines do to it.
    (10_000, 11_000, 1.0, RUNNING),
    (10_000, 11_000, 0.2, RUNNING),
    (10_000, 11_000, 2.5, RUNNING),
    (10_000, 10_001, 0.001, RUNNING),
    (HOUR_MS, 2 * HOUR_MS, 3600.0, RUNNING),
    (HOUR_MS, 2 * HOUR_MS + 100_000, 3600.0, RUNNING),
    (HOUR_MS, 2 * HOUR_MS - 100_000, 3600.0, RUNNING),
    # The next in time after one that was 4 s late.
    (10_000, 14_100, 0.1, RUNNING),
    # The same one twice.
    (10_000, 10_000, 0.0, RUNNING),
    (10_000, 10_000, 0.5, RUNNING),
    # A wrap after 49.7 days.
    (WRAP_MS - 500, 500, 1.0, RUNNING),
    (WRAP_MS - 1, 0, 0.001, RUNNING),
    (WRAP_MS - HOUR_MS, HOUR_MS, 7200.0, RUNNING),
    # Late frames: younger ones have come before.
    (10_000, 9_000, 0.1, LATE),
    (10_000, 5_001, 0.1, LATE),
    (500, WRAP_MS - 500, 0.1, LATE),
    (DAY_MS, DAY_MS - 1, 0.0, LATE),
    # Restarts.
    (10_000, 0, 1.0, RESTARTED),
    (10_000, 300, 1.0, RESTARTED),
    (DAY_MS, 1_500, 2.0, RESTARTED),
    (DAY_MS, HOUR_MS, 2 * 3600.0, RESTARTED),
    (10_000, 4_000, 0.1, RESTARTED),        # too old to be late
    # Out of hearing for long, restarted meanwhile, and running for longer than before by now.
    (10_000, 50_000, 100.0, RESTARTED),
    (10_000, 90_000, 100.0, RESTARTED),
    (1_000, 3 * HOUR_MS, 4 * 3600.0, RESTARTED),
    # Out of hearing for long and not restarted.
    (10_000, 110_000, 100.0, RUNNING),
    # A light without a clock.
    (0, 0, 1.0, RUNNING),
    (0, 0, 2.0, NO_CLOCK),
    (0, 0, 3600.0, NO_CLOCK),
    (7, 7, 10.0, NO_CLOCK),
])
def test_an_uptime_tells(last_ms, new_ms, elapsed, meaning):
    assert compare_uptime(last_ms, new_ms, elapsed) is meaning


@pytest.mark.parametrize('drift', [0.96, 1.0, 1.04])
@pytest.mark.parametrize('start_ms', [0, WRAP_MS - 30_000])
def test_a_light_whose_clock_goes_wrong_by_4_percent_never_restarts(drift, start_ms):
    uptimes = [int(start_ms + 1000 * drift * second) % WRAP_MS for second in range(120)]
    meanings = {compare_uptime(last, new, 1.0)
                for last, new in zip(uptimes, uptimes[1:], strict=False)}
    assert meanings == {RUNNING}


@pytest.mark.parametrize('absence', [1.0, 10.0, 1000.0, 100_000.0])
@pytest.mark.parametrize('before_s', [5.0, 100.0, 50_000.0])
@pytest.mark.parametrize('share', [0.13, 0.47, 0.91])
def test_a_restart_is_told_whenever_it_was_in_an_absence(absence, before_s, share):
    since_boot = absence * share
    if abs(before_s + absence - since_boot) <= 2.0 + 0.05 * absence:
        pytest.skip('the uptime is the one that a light without a restart would have')
    assert compare_uptime(int(before_s * 1000), int(since_boot * 1000), absence) is RESTARTED
