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

"""Refusals of the command sender, results of a command, and counters."""

from __future__ import annotations

import math

from illuminator_ros.mavlink.command import CommandSender, format_seconds
from illuminator_ros.mavlink.messages import Address
import pytest
from support.command_rig import ACCEPTED, DENIED, IN_PROGRESS, LIGHT, OURS, Rig


@pytest.mark.parametrize('timeout', [0.0, -0.5, math.nan, math.inf])
def test_timeout_that_is_none_is_refused(timeout: float) -> None:
    with pytest.raises(ValueError, match='timeout'):
        CommandSender(OURS, timeout)


def test_negative_number_of_retries_is_refused() -> None:
    with pytest.raises(ValueError, match='retries -1'):
        CommandSender(OURS, 0.5, -1)


@pytest.mark.parametrize(('answers', 'said'), [
    ([[ACCEPTED]], 'MAV_RESULT_ACCEPTED (1 try, 20 ms)'),
    ([[], [DENIED]], 'MAV_RESULT_DENIED (2 tries, 520 ms)'),
    ([[77]], 'MAV_RESULT 77 (unknown) (1 try, 20 ms)'),
    ([], 'no acknowledgement (4 tries, 2.00 s)'),
    ([[IN_PROGRESS]], 'no final acknowledgement, last answer MAV_RESULT_IN_PROGRESS at 0 % '
                      '(1 try, 3.02 s)'),
])
def test_outcome_says_what_happened(answers: list[list[int]], said: str) -> None:
    assert str(Rig(*answers).ended().outcome) == said


@pytest.mark.parametrize(('seconds', 'said'), [
    (0.0, '0 ms'), (0.0004, '0 ms'), (0.9994, '999 ms'), (0.9996, '1.00 s'), (12.345, '12.35 s')])
def test_durations_are_for_people(seconds: float, said: str) -> None:
    assert format_seconds(seconds) == said


def test_result_param2_is_kept() -> None:
    rig = Rig()
    run = rig.start()
    rig.ack(DENIED, result_param2=-7)
    assert run.outcome.result_param2 == -7


def test_who_leaves_a_command_unanswered_is_known_until_it_answers_one() -> None:
    rig = Rig(retries=0)
    rig.ended()
    assert rig.sender.unanswering == {LIGHT}
    rig.start()
    assert rig.sender.unanswering == {LIGHT}
    rig.ack(DENIED)
    assert not rig.sender.unanswering


def test_counters_tell_first_tries_resends_and_silence() -> None:
    rig = Rig(retries=2)
    rig.ended()
    for component in (98, 99):
        rig.start(target=Address(1, component))
        rig.ack(ACCEPTED, source=Address(1, component))
    rig.ack(ACCEPTED, source=Address(1, 99))
    counters = rig.sender.counters
    assert (counters.sent, counters.resent, counters.unanswered, counters.unexpected_acks) == (
        5, 2, 1, 1)
