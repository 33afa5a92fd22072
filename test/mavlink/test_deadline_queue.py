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

"""The deadline queue, compared with a search over all deadlines."""

import math

from hypothesis import example, given
from hypothesis import strategies as st
from illuminator_ros.mavlink.deadline_queue import DeadlineQueue

TIMES = st.integers(0, 20)
KEYS = st.integers(0, 4)
STEPS = st.lists(st.tuples(st.just('set'), KEYS, TIMES | st.just(math.inf))
                 | st.tuples(st.sampled_from(['due', 'changed']), KEYS, TIMES), max_size=60)


@given(STEPS)
@example([('set', 0, 5), ('set', 0, 3), ('set', 0, 5), ('due', 0, 5)])
def test_queue_agrees_with_search_over_all_deadlines(steps: list[tuple[str, int, float]]) -> None:
    deadlines: dict[int, float] = {}
    queue: DeadlineQueue[int] = DeadlineQueue()
    for kind, key, moment in steps:
        if kind == 'set':
            queue.set(key, moment)
            deadlines[key] = moment
        elif kind == 'changed':
            deadlines[key] = -math.inf
            queue.changed(key)
        else:
            assert sorted(queue.due(moment)) == sorted(
                key for key, deadline in deadlines.items() if deadline <= moment)
        assert queue.next_deadline() == min(deadlines.values(), default=math.inf)


def test_postponing_one_deadline_takes_no_time_that_grows() -> None:
    class Deadline(float):
        comparisons = 0

        def __lt__(self, other: float) -> bool:
            Deadline.comparisons += 1
            return float(self) < other

    queue: DeadlineQueue[str] = DeadlineQueue()
    for second in range(10_000):
        queue.set('light', Deadline(second + 3.0))
        assert queue.due(float(second)) == []
    assert queue.due(10_003.0) == ['light']
    assert Deadline.comparisons < 50_000
