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

"""When frames for others are taken several at a time."""

from __future__ import annotations

from illuminator_ros.mavlink.crowd import COLLECTION, Crowd, FLOOD, HURRY, ROOM
import pytest


@pytest.fixture
def crowd() -> Crowd:
    """Return a link on which frames for others came at 10 s and just after."""
    one = Crowd()
    one.passed(1, 10.0)
    one.passed(1, 10.0 + COLLECTION)
    return one


def test_nothing_collects_where_nothing_came() -> None:
    assert not Crowd().collects(0.0)


def test_a_single_frame_makes_no_crowd() -> None:
    crowd = Crowd()
    crowd.passed(1, 10.0)
    assert not crowd.collects(10.0)


def test_frames_in_quick_succession_do(crowd: Crowd) -> None:
    assert crowd.collects(10.1)


def test_frames_now_and_then_do_not(crowd: Crowd) -> None:
    crowd.passed(1, 10.0 + 4 * COLLECTION)
    assert not crowd.collects(10.2)


def test_frames_that_there_would_be_no_room_for_do_not(crowd: Crowd) -> None:
    crowd.passed(ROOM // 2, 10.0 + 1.5 * COLLECTION)
    assert not crowd.collects(10.1)
    crowd.passed(ROOM // 2 - 1, 10.0 + 2 * COLLECTION)
    assert crowd.collects(10.1)


def test_a_wait_in_which_nothing_came_is_the_last(crowd: Crowd) -> None:
    assert crowd.collects(10.1)
    assert not crowd.collects(10.2)


def test_nothing_collects_while_an_answer_may_come(crowd: Crowd) -> None:
    crowd.asked(10.1)
    assert not crowd.collects(10.1 + HURRY - 0.01)
    crowd.passed(1, 20.0)
    crowd.passed(1, 20.0 + COLLECTION)
    assert crowd.collects(20.1)


def test_nothing_collects_before_all_has_been_read(crowd: Crowd) -> None:
    assert crowd.collects(10.1)
    crowd.passed(ROOM // 2, 10.0 + 2 * COLLECTION, more=True)
    assert not crowd.collects(10.1)
    crowd.passed(ROOM // 2 - 1, 10.0 + 2 * COLLECTION)
    assert crowd.collects(10.1)


def test_what_is_read_in_several_looks_needs_room_together(crowd: Crowd) -> None:
    assert crowd.collects(10.1)
    crowd.passed(ROOM // 2, 10.0 + 2 * COLLECTION, more=True)
    crowd.passed(ROOM // 2, 10.0 + 2 * COLLECTION)
    assert not crowd.collects(10.1)


def test_nothing_collects_for_a_while_after_a_flood(crowd: Crowd) -> None:
    crowd.passed(2 * ROOM - 1, 10.1, more=True)
    crowd.passed(1, 10.1)
    crowd.asked(10.1)
    assert not crowd.collects(10.1 + FLOOD - 0.01)
    crowd.passed(1, 30.0)
    crowd.passed(1, 30.0 + COLLECTION)
    assert crowd.collects(30.1)
