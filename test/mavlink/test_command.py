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

"""The command protocol: how often is sent, and how it ends."""

from __future__ import annotations

from collections.abc import Sequence

from illuminator_ros.mavlink.command import CommandStatus
from illuminator_ros.mavlink.messages import CommandInt, CommandLong, MavResult
import pytest
from support.command_rig import (
    ACCEPTED,
    FAILED,
    IN_PROGRESS,
    LIGHT,
    LONG,
    REJECTED,
    Rig,
)

ANSWERED, NO_ANSWER = CommandStatus.ANSWERED, CommandStatus.NO_ANSWER

# QGroundControl's table of command tests: what each try is acknowledged with, the retries that
# are allowed -> ending, result, frames sent. (What QGroundControl calls progress is in
# test_command_progress.py.)
QGROUNDCONTROL: dict[str, tuple[list[list[int]], int, CommandStatus, int | None, int]] = {
    'always accepted': ([[ACCEPTED]], 3, ANSWERED, ACCEPTED, 1),
    'always failed': ([[FAILED]], 3, ANSWERED, FAILED, 1),
    'second attempt accepted': ([[], [ACCEPTED]], 3, ANSWERED, ACCEPTED, 2),
    'second attempt failed': ([[], [FAILED]], 3, ANSWERED, FAILED, 2),
    'no response': ([], 3, NO_ANSWER, None, 4),
    'no response, no retry': ([], 0, NO_ANSWER, None, 1),
    'in progress, accepted': ([[IN_PROGRESS, ACCEPTED]], 3, ANSWERED, ACCEPTED, 1),
    'in progress, failed': ([[IN_PROGRESS, FAILED]], 3, ANSWERED, FAILED, 1),
    'in progress, no ack': ([[IN_PROGRESS]], 3, CommandStatus.PROGRESS_STOPPED, IN_PROGRESS, 1),
}


@pytest.mark.parametrize(
    ('answers', 'retries', 'ending', 'result', 'frames'), QGROUNDCONTROL.values(),
    ids=QGROUNDCONTROL.keys())
def test_ends_as_in_qgroundcontrols_table(
        answers: Sequence[Sequence[int]], retries: int, ending: CommandStatus, result: int | None,
        frames: int) -> None:
    rig = Rig(*answers, retries=retries)
    run = rig.ended()
    assert (run.status, run.result) == (ending, result)
    assert run.outcome.tries == len(rig.frames) == frames
    assert rig.idle


# Every answer and none

def test_every_result_and_silence_end_in_exactly_one_outcome() -> None:
    for answers in ([], *([[result]] * 40 for result in range(256))):
        rig = Rig(*answers)
        assert len(rig.ended().outcomes) == 1, answers[:1]
        assert rig.idle


@pytest.mark.parametrize('result', [
    result for result in range(256)
    if result not in (MavResult.TEMPORARILY_REJECTED, MavResult.IN_PROGRESS,
                      MavResult.COMMAND_INT_ONLY)])
def test_result_ends_the_command_at_its_first_try(result: int) -> None:
    rig = Rig([result])
    run = rig.ended()
    assert (run.status, run.result, run.outcome.tries) == (ANSWERED, result, 1)
    assert run.outcome.accepted == (result == ACCEPTED)


def test_target_that_wants_command_int_gets_it_once() -> None:
    rig = Rig([MavResult.COMMAND_INT_ONLY], [ACCEPTED])
    run = rig.ended(406, params=(1.0, 50.0, 0.5, 25.0, 5.0, 6.0, 7.0))
    assert run.outcome.accepted
    long, as_int = rig.messages
    assert isinstance(long, CommandLong)
    assert isinstance(as_int, CommandInt)
    assert (as_int.param1, as_int.param2, as_int.param3, as_int.param4, as_int.x, as_int.y,
            as_int.z) == (1.0, 50.0, 0.5, 25.0, 5, 6, 7.0)
    assert (as_int.target_system, as_int.target_component, as_int.command) == (*LIGHT, 406)


def test_command_int_is_resent_as_such() -> None:
    rig = Rig([MavResult.COMMAND_INT_ONLY], [], [ACCEPTED])
    assert rig.ended().outcome.accepted
    assert [type(message) for message in rig.messages] == [CommandLong, CommandInt, CommandInt]


def test_second_refusal_of_command_long_does_not_end_the_command_int() -> None:
    # Two tries went out before the first was refused, so the refusal comes twice.
    rig = Rig()
    run = rig.start()
    rig.run(0.6)
    assert len(rig.frames) == 2
    rig.ack(MavResult.COMMAND_INT_ONLY)
    rig.ack(MavResult.COMMAND_INT_ONLY)
    assert run.outcomes == []
    rig.ack(ACCEPTED)
    assert run.outcome.accepted
    assert [type(message) for message in rig.messages] == [CommandLong, CommandLong, CommandInt]


def test_target_that_wants_now_the_one_and_now_the_other_form_is_believed_once() -> None:
    rig = Rig([MavResult.COMMAND_INT_ONLY], [MavResult.COMMAND_LONG_ONLY])
    run = rig.ended()
    assert (run.status, run.result) == (ANSWERED, MavResult.COMMAND_LONG_ONLY)
    assert len(rig.frames) == 2


def test_target_that_refuses_both_forms_the_same_way_is_given_up() -> None:
    rig = Rig(*[[MavResult.COMMAND_INT_ONLY]] * 20)
    assert rig.ended().status is NO_ANSWER


# Sent messages

def test_params_that_are_not_given_are_zero() -> None:
    rig = Rig()
    rig.start(405, params=(1.0,))
    (message,) = rig.messages
    assert [getattr(message, f'param{number}') for number in range(1, 8)] == [1.0, *[0.0] * 6]
    assert (message.target_system, message.target_component, message.command) == (*LIGHT, 405)


def test_confirmation_counts_the_resends() -> None:
    rig = Rig(retries=4)
    rig.ended()
    assert [message.confirmation for message in rig.messages] == [0, 1, 2, 3, 4]


def test_confirmation_stays_within_its_field() -> None:
    rig = Rig(timeout=0.1, retries=300)
    rig.ended()
    assert len(rig.frames) == 301
    assert [message.confirmation for message in rig.messages][254:] == [254, *[255] * 46]


def test_is_resent_each_time_the_timeout_is_over() -> None:
    rig = Rig(timeout=0.5)
    run = rig.ended()
    assert rig.times == [0.0, 0.5, 1.0, 1.5]
    assert run.outcome.elapsed == pytest.approx(2.0)


def test_poll_before_it_is_due_sends_nothing() -> None:
    rig = Rig()
    rig.start()
    for _ in range(100):
        rig.sender.poll(rig.now + 0.499)
    assert len(rig.frames) == 1
    assert rig.sender.next_deadline() == pytest.approx(rig.now + 0.5)


# A target that is busy

def test_temporary_rejection_is_tried_again_with_growing_pauses() -> None:
    rig = Rig([REJECTED], [REJECTED], [REJECTED], [ACCEPTED])
    run = rig.ended()
    assert run.outcome.accepted
    assert rig.times == [0.0, 0.12, 0.34, 0.76]


def test_temporary_rejection_that_does_not_pass_is_the_answer_within_the_deadline() -> None:
    rig = Rig(*[[REJECTED]] * 100)
    run = rig.ended()
    assert (run.status, run.result) == (ANSWERED, REJECTED)
    assert run.outcome.elapsed < 4 * 0.5
    assert len(rig.frames) >= 4


def test_rejection_is_not_the_answer_where_an_earlier_try_got_none() -> None:
    # That may be what keeps the target busy, and succeed.
    rig = Rig([], *[[REJECTED]] * 100)
    run = rig.ended()
    assert (run.status, run.result) == (CommandStatus.OUT_OF_TIME, REJECTED)
    assert str(run.outcome).startswith(
        'not finished in time, last answer MAV_RESULT_TEMPORARILY_REJECTED (')


def test_rejected_try_is_none_of_the_retries() -> None:
    rig = Rig([REJECTED], [REJECTED], retries=1)
    run = rig.ended()
    assert (run.status, run.result) == (NO_ANSWER, REJECTED)
    assert len(rig.frames) == 4


def test_rejection_that_is_repeated_on_its_way_counts_once() -> None:
    rig = Rig([REJECTED, REJECTED, REJECTED], [ACCEPTED])
    assert rig.ended().outcome.accepted
    assert rig.times == [0.0, 0.12]


def test_rejection_is_not_retried_beyond_the_limit() -> None:
    rig = Rig(*[[REJECTED]] * 100)
    run = rig.ended(limit=0.3)
    assert (run.status, run.result) == (ANSWERED, REJECTED)
    assert run.outcome.elapsed < 0.3
    assert rig.times == [0.0, 0.12]


# The limit

def test_limit_ends_what_got_no_answer() -> None:
    rig = Rig()
    run = rig.ended(limit=0.9)
    assert (run.status, run.outcome.tries) == (NO_ANSWER, 2)
    assert run.outcome.elapsed == pytest.approx(0.9)


def test_limit_ends_what_is_in_progress() -> None:
    rig = Rig([IN_PROGRESS] * 250)
    run = rig.ended(limit=1.5)
    assert (run.status, run.result) == (CommandStatus.OUT_OF_TIME, IN_PROGRESS)
    assert run.outcome.elapsed == pytest.approx(1.5)


def test_nothing_is_sent_after_the_limit() -> None:
    rig = Rig()
    run = rig.start(limit=0.0)
    assert (run.status, rig.frames) == (CommandStatus.OUT_OF_TIME, [])


@pytest.mark.parametrize('ended_by', ['acknowledgement', 'poll'])
def test_command_whose_limit_passed_while_it_waited_is_never_sent(ended_by: str) -> None:
    rig = Rig()
    first, second = rig.start(), rig.start(limit=0.4)
    rig.now += 0.45
    if ended_by == 'acknowledgement':
        rig.ack(ACCEPTED)
    else:
        rig.sender.poll(rig.now)
    assert second.status is CommandStatus.OUT_OF_TIME
    assert second.outcome.tries == 0
    rig.run(LONG)
    assert second.frames == []
    assert len(first.outcomes) == len(second.outcomes) == 1


def test_refusal_of_the_form_after_the_limit_sends_no_other() -> None:
    rig = Rig()
    run = rig.start(limit=0.3)
    rig.now += 0.4
    rig.ack(MavResult.COMMAND_INT_ONLY)
    assert (run.status, run.result) == (ANSWERED, MavResult.COMMAND_INT_ONLY)
    assert len(rig.frames) == 1
