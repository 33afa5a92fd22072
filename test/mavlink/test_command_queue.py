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

"""Several commands at a time, and commands that are cut off."""

from __future__ import annotations

import math

from illuminator_ros.mavlink.command import (
    Command,
    CommandResult,
    CommandStatus,
    MAX_WAITING,
    Position,
)
from illuminator_ros.mavlink.messages import Address, CommandInt
import pytest
from support.command_rig import ACCEPTED, DENIED, FAILED, IN_PROGRESS, LIGHT, LONG, REJECTED, Rig

OTHER = Address(1, 244)


# One of a kind at a time

def test_second_command_of_a_kind_waits_for_the_first() -> None:
    # An acknowledgement names only the command.
    rig = Rig()
    first, second = rig.start(params=(1.0,)), rig.start(params=(0.0,))
    rig.run(1.2)
    assert [message.confirmation for message in rig.messages] == [0, 1, 2]
    assert {message.param1 for message in rig.messages} == {1.0}
    rig.ack(ACCEPTED)
    assert first.outcome.accepted
    assert second.outcomes == []
    assert (rig.messages[-1].param1, rig.messages[-1].confirmation) == (0.0, 0)
    rig.ack(DENIED)
    assert second.result == DENIED


def test_waiting_commands_go_out_in_order() -> None:
    rig = Rig(*[[ACCEPTED]] * 10)
    for number in range(10):
        rig.start(params=(float(number),))
    rig.run(LONG)
    assert [message.param1 for message in rig.messages] == [float(n) for n in range(10)]
    assert all(run.outcome.accepted for run in rig.runs)


def test_command_that_gets_no_answer_makes_way_for_the_next() -> None:
    rig = Rig([], [], [], [], [ACCEPTED])
    first, second = rig.start(), rig.start()
    rig.run(LONG)
    assert first.status is CommandStatus.NO_ANSWER
    assert second.outcome.accepted


def test_time_spent_waiting_is_none_of_the_time_taken() -> None:
    rig = Rig([], [], [], [], [ACCEPTED])
    rig.start()
    second = rig.start()
    rig.run(LONG)
    assert second.outcome.elapsed == pytest.approx(0.02)


def test_limit_of_a_command_that_waits_is_kept_to_the_moment() -> None:
    rig = Rig()
    rig.start()
    second = rig.start(limit=0.2)
    rig.run(0.4)
    assert second.status is CommandStatus.OUT_OF_TIME
    assert second.ended_at - rig.frames[0][0] == pytest.approx(0.2)


def test_only_so_many_wait_and_the_next_is_told() -> None:
    rig = Rig()
    runs = [rig.start() for _ in range(MAX_WAITING + 2)]
    assert [len(run.outcomes) for run in runs] == [0] * (MAX_WAITING + 1) + [1]
    assert runs[-1].status is CommandStatus.REFUSED_LOCALLY
    assert str(runs[-1].outcome) == (
        'too many commands are waiting for this component (0 tries, 0 ms)')
    rig.run(MAX_WAITING * LONG)
    assert all(len(run.outcomes) == 1 for run in runs)


def test_pending_is_what_is_under_way() -> None:
    rig = Rig()
    rig.start(405)
    assert rig.sender.pending(LIGHT, 405)
    assert not rig.sender.pending(LIGHT, 406)
    assert not rig.sender.pending(OTHER, 405)
    rig.ack(ACCEPTED)
    assert not rig.sender.pending(LIGHT, 405)


# In parallel

def test_commands_of_different_kinds_do_not_wait_for_each_other() -> None:
    rig = Rig()
    rig.start(405)
    rig.start(406)
    assert [message.command for message in rig.messages] == [405, 406]


def test_dead_light_does_not_delay_another() -> None:
    rig = Rig()
    rig.answers = lambda message, number: [ACCEPTED] if message.target_component == 244 else []
    dead, alive = rig.start(target=LIGHT), [rig.start(target=OTHER) for _ in range(3)]
    rig.run(0.1)
    assert all(run.outcome.accepted for run in alive)
    assert dead.outcomes == []
    rig.run(LONG)
    assert dead.status is CommandStatus.NO_ANSWER


def test_fifty_targets_get_an_answer_each_in_any_order() -> None:
    rig = Rig()
    targets = [Address(system, component) for system in (1, 2) for component in range(1, 26)]
    runs = {target: rig.start(target=target) for target in targets}
    for place, target in enumerate(reversed(targets)):
        rig.ack(100 + place, source=target)
    assert [runs[target].result for target in reversed(targets)] == list(range(100, 150))


# Cut off

@pytest.mark.parametrize('ending', [CommandStatus.LINK_LOST, CommandStatus.CANCELLED])
def test_losing_the_link_ends_all_that_is_under_way_or_waiting(ending: CommandStatus) -> None:
    rig = Rig()
    rig.start(405)
    rig.start(405)
    rig.start(406)
    rig.start(405, target=OTHER)
    rig.ack(IN_PROGRESS, 406, progress=30)
    sent = len(rig.frames)
    rig.now += 0.1
    rig.sender.end_all(rig.now, ending)
    assert [run.status for run in rig.runs] == [ending] * 4
    rig.run(LONG)
    assert len(rig.frames) == sent
    assert rig.idle


def test_outcome_of_a_lost_link_says_how_far_it_came() -> None:
    rig = Rig()
    run = rig.start()
    rig.ack(IN_PROGRESS, progress=30)
    rig.now += 0.1
    rig.sender.end_all(rig.now, CommandStatus.LINK_LOST)
    assert str(run.outcome) == ('the link was lost, last answer MAV_RESULT_IN_PROGRESS at 30 % '
                                '(1 try, 100 ms)')


def test_ending_again_changes_nothing() -> None:
    rig = Rig()
    run = rig.start()
    for ending in (CommandStatus.CANCELLED, CommandStatus.LINK_LOST):
        rig.sender.end_all(rig.now, ending)
    assert run.status is CommandStatus.CANCELLED


def test_acknowledgement_after_the_link_was_lost_counts_for_nothing() -> None:
    rig = Rig()
    run = rig.start()
    rig.sender.end_all(rig.now, CommandStatus.LINK_LOST)
    rig.ack(ACCEPTED)
    assert run.status is CommandStatus.LINK_LOST


def test_commands_of_one_target_are_ended_without_those_of_others() -> None:
    rig = Rig()
    gone, waiting, kept = rig.start(), rig.start(), rig.start(target=OTHER)
    rig.sender.end_all(rig.now, CommandStatus.CANCELLED, LIGHT)
    assert (gone.status, waiting.status, kept.outcomes) == (
        CommandStatus.CANCELLED, CommandStatus.CANCELLED, [])
    rig.ack(ACCEPTED, source=OTHER)
    assert kept.outcome.accepted


def test_command_can_be_started_after_the_link_was_lost() -> None:
    rig = Rig()
    rig.start()
    rig.sender.end_all(rig.now, CommandStatus.LINK_LOST)
    again = rig.start()
    rig.ack(ACCEPTED)
    assert again.outcome.accepted


# Called back in the middle

@pytest.mark.parametrize('by', ['acknowledgement', 'silence', 'lost link'])
def test_callback_may_start_the_same_command_again(by: str) -> None:
    rig = Rig()
    outcomes: list[CommandResult] = []

    def again(outcome: CommandResult, now: float) -> None:
        outcomes.append(outcome)
        if len(outcomes) < 3:
            rig.sender.start(Command(LIGHT, 405), now, again)

    rig.sender.start(Command(LIGHT, 405), rig.now, again)
    for _ in range(3):
        if by == 'acknowledgement':
            rig.ack(ACCEPTED)
        elif by == 'silence':
            rig.run(2.0)
        else:
            rig.sender.end_all(rig.now, CommandStatus.LINK_LOST)
    assert len(outcomes) == 3
    assert rig.idle


def test_callback_may_end_all_the_others() -> None:
    # QGroundControl once crashed when the vehicle was closed by the callback of a failure.
    rig = Rig(retries=0)
    ends: list[CommandStatus] = []

    def close(outcome: CommandResult, now: float) -> None:
        ends.append(outcome.status)
        rig.sender.end_all(now, CommandStatus.CANCELLED)

    for target in (LIGHT, OTHER):
        for _ in range(3):
            rig.sender.start(Command(target, 405), rig.now, close)
    rig.run(LONG)
    assert sorted(ends, key=str) == [CommandStatus.CANCELLED] * 5 + [CommandStatus.NO_ANSWER]
    assert rig.idle


# Overtaking, cancelling, and acknowledgements that several commands may claim

def test_overtaking_command_cancels_those_that_wait_or_are_unacknowledged_and_is_sent() -> None:
    rig = Rig()
    others = [rig.start() for _ in range(31)]

    off = rig.start(overtake=True)

    assert [run.status for run in others] == [CommandStatus.CANCELLED] * 31
    assert (len(rig.frames), len(off.frames)) == (2, 1)
    rig.ack(ACCEPTED)
    assert off.outcome.accepted


def test_overtaking_command_is_sent_beside_one_in_progress() -> None:
    rig = Rig()
    on = rig.start()
    rig.ack(IN_PROGRESS)
    off, waiting = rig.start(overtake=True), rig.start()

    assert (len(off.frames), on.outcomes, waiting.frames) == (1, [], [])
    for result in (ACCEPTED, DENIED, FAILED):
        # The acknowledgements name only the command: each answers the oldest.
        rig.ack(result)
    assert (on.result, off.result, waiting.result) == (ACCEPTED, DENIED, FAILED)


def test_rejection_beside_a_command_in_progress_is_that_of_the_other() -> None:
    rig = Rig()
    on = rig.start()
    rig.ack(IN_PROGRESS)
    off = rig.start(overtake=True)

    rig.ack(REJECTED)
    rig.run(0.15)

    assert (len(on.frames), len(off.frames)) == (1, 2)


@pytest.mark.parametrize('place', [0, 1])
def test_cancelled_command_ends_and_the_other_is_sent(place: int) -> None:
    rig = Rig()
    runs = [rig.start(), rig.start()]

    rig.sender.cancel(runs[place].command, rig.now)
    rig.flush()

    assert runs[place].status is CommandStatus.CANCELLED
    assert (runs[1 - place].outcomes, len(runs[1 - place].frames)) == ([], 1)


def test_requests_for_two_messages_do_not_wait_for_each_other() -> None:
    rig = Rig()
    first, second = (rig.start(512, params=(number,)) for number in (148.0, 259.0))

    assert [message.param1 for message in rig.messages] == [148.0, 259.0]
    rig.ack(DENIED, 512)
    rig.ack(ACCEPTED, 512)
    assert (first.result, second.result) == (DENIED, ACCEPTED)


@pytest.mark.parametrize(('first', 'second', 'after', 'doubtful'), [
    (DENIED, DENIED, 0.4, True), (DENIED, DENIED, 0.6, False), (ACCEPTED, DENIED, 0.4, False),
    (None, DENIED, 0.4, True), (None, ACCEPTED, 0.4, True)])
def test_result_says_whether_it_may_be_that_of_the_command_before(
        first: int | None, second: int, after: float, doubtful: bool) -> None:
    rig = Rig()
    before = rig.start()
    if first is None:
        rig.sender.cancel(before.command, rig.now)
    else:
        rig.ack(first)
    rig.now += after
    run = rig.start()
    rig.ack(second)

    assert not before.outcome.may_answer_earlier(rig.now, 0.5)
    assert run.outcome.may_answer_earlier(rig.now, 0.5) is doubtful


# The fields of a command

def test_params_that_are_not_given_are_nan_where_the_command_says_so() -> None:
    command = Command(LIGHT, 1000, (1.0,), math.nan)

    message = command.message(0, False)

    assert (message.param1, [math.isnan(getattr(message, f'param{n}')) for n in range(2, 8)]) == (
        1.0, [True] * 6)
    as_int = command.message(0, True)
    assert (as_int.x, as_int.y, math.isnan(as_int.z)) == (0x7FFFFFFF, 0x7FFFFFFF, True)


@pytest.mark.parametrize(('position', 'fields'), [
    (Position(0, 47.3977418, -8.5455938, 488.25), (0, 473977418, -85455938, 488.25)),
    (Position(1, 12.5, -0.0001, -3.5), (1, 125000, -1, -3.5)),
    (Position(5, math.nan, math.nan, math.nan), (5, 0x7FFFFFFF, 0x7FFFFFFF, math.nan))])
def test_position_is_sent_in_a_command_int(
        position: Position, fields: tuple[float, ...]) -> None:
    message = Command(LIGHT, 195, (1.0,), math.nan, position).message(2, False)

    assert isinstance(message, CommandInt)
    assert (message.frame, message.x, message.y, message.z) == pytest.approx(fields, nan_ok=True)
    assert (message.param1, math.isnan(message.param2)) == (1.0, True)


def test_position_that_does_not_fit_is_refused() -> None:
    with pytest.raises(ValueError, match='position of 300, 0'):
        Position(0, 300.0, 0.0, 0.0)
