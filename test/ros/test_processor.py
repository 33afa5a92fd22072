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

"""Yielding the processor, in simulated time."""

from __future__ import annotations

from illuminator_ros.ros.processor import LimitedYield, MAX_YIELD, YIELD_PAUSE
import pytest


@pytest.mark.parametrize(('taken', 'yields'), [
    (0.0, 200), (MAX_YIELD, 200), (1.1 * MAX_YIELD, 2)])
def test_processor_is_yielded_seldom_where_other_threads_keep_it(
        taken: float, yields: int) -> None:
    now, count = 0.0, 0

    def sched_yield() -> None:
        nonlocal now, count
        now += taken
        count += 1

    yield_processor = LimitedYield(lambda: now, sched_yield)
    for turn in range(200):
        now = max(now, turn * YIELD_PAUSE / 100)
        yield_processor()
    assert count == yields
