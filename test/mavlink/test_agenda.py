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

"""The agenda gives the same answers as looking at every deadline."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st
from illuminator_ros.mavlink.deadline_queue import DeadlineQueue

TIMES = st.integers(0, 20)
STEPS = st.lists(st.one_of(
    st.tuples(st.just('set'), st.integers(0, 4), st.one_of(TIMES, st.just(math.inf))),
    st.tuples(st.just('due'), TIMES)), max_size=60)


@given(STEPS)
@settings(deadline=None)
def test_agrees_with_a_plain_search(steps: list[tuple]) -> None:
    agenda: DeadlineQueue[int] = DeadlineQueue()
    deadlines: dict[int, float] = {}
    for kind, *arguments in steps:
        if kind == 'set':
            key, deadline = arguments
            agenda.set(key, deadline)
            deadlines[key] = deadline
        else:
            (now,) = arguments
            assert sorted(agenda.due(now)) == sorted(
                key for key, deadline in deadlines.items() if deadline <= now)
        assert agenda.next_deadline() == min(deadlines.values(), default=math.inf)


def test_postponing_does_not_pile_up() -> None:
    agenda: DeadlineQueue[str] = DeadlineQueue()
    for second in range(10_000):
        agenda.set('light', second + 3.0)
        agenda.due(float(second))
    assert len(agenda._heap) <= 2
