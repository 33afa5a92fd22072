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

"""The command protocol: how often a command is sent, which answer counts, and how it ends."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from illuminator_ros.mavlink.command_sender import (
    ACK_LIFETIME,
    Command,
    CommandResult,
    CommandSender,
    CommandStatus,
    format_seconds,
    MAX_SAMPLES,
    MAX_TARGETS,
    MAX_WAITING,
    MIN_SAMPLES,
    MIN_TIMEOUT,
    Position,
    PROGRESS_TIMEOUT,
    RttEstimator,
)
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address, CommandInt, CommandLong, heartbeat, Message
import pytest
from support.command_rig import (
    ACCEPTED,
    DENIED,
    FAILED,
    IN_PROGRESS,
    LIGHT,
    LONG,
    OURS,
    REJECTED,
    Rig,
)

OTHER = Address(1, 244)
INT_ONLY, LONG_ONLY = mavlink.MAV_RESULT_COMMAND_INT_ONLY, mavlink.MAV_RESULT_COMMAND_LONG_ONLY
STATUS = CommandStatus


# The answers to each try, 20 ms apart; retries and the limit -> the result as text, and when the
# tries were sent, s. The first nine are QGroundControl's own test cases.
@pytest.mark.parametrize(('answers', 'options', 'said', 'times'), [
    ([[ACCEPTED]], {}, 'MAV_RESULT_ACCEPTED (1 try, 20 ms)', [0.0]),
    ([[FAILED]], {}, 'MAV_RESULT_FAILED (1 try, 20 ms)', [0.0]),
    ([[], [ACCEPTED]], {}, 'MAV_RESULT_ACCEPTED (2 tries, 520 ms)', [0.0, 0.5]),
    ([[], [FAILED]], {}, 'MAV_RESULT_FAILED (2 tries, 520 ms)', [0.0, 0.5]),
    ([], {}, 'no acknowledgement (4 tries, 2.00 s)', [0.0, 0.5, 1.0, 1.5]),
    ([], {'retries': 0}, 'no acknowledgement (1 try, 500 ms)', [0.0]),
    ([[IN_PROGRESS, ACCEPTED]], {}, 'MAV_RESULT_ACCEPTED (1 try, 40 ms)', [0.0]),
    ([[IN_PROGRESS, FAILED]], {}, 'MAV_RESULT_FAILED (1 try, 40 ms)', [0.0]),
    ([[IN_PROGRESS]], {}, 'no final acknowledgement, last answer MAV_RESULT_IN_PROGRESS at 0 % '
     '(1 try, 3.02 s)', [0.0]),
    ([[77]], {}, 'MAV_RESULT 77 (unknown) (1 try, 20 ms)', [0.0]),
    # Progress ends the resending.
    ([[], [IN_PROGRESS]], {}, 'no final acknowledgement, last answer MAV_RESULT_IN_PROGRESS at '
     '0 % (2 tries, 3.52 s)', [0.0, 0.5]),
    ([[REJECTED, IN_PROGRESS]], {}, 'no final acknowledgement, last answer '
     'MAV_RESULT_IN_PROGRESS at 0 % (1 try, 3.04 s)', [0.0]),
    ([[IN_PROGRESS, REJECTED, ACCEPTED]], {}, 'MAV_RESULT_ACCEPTED (1 try, 60 ms)', [0.0]),
    # A temporary rejection is tried again with growing pauses, and is not one of the retries.
    ([[REJECTED], [REJECTED], [REJECTED], [ACCEPTED]], {}, 'MAV_RESULT_ACCEPTED (4 tries, '
     '780 ms)', [0.0, 0.12, 0.34, 0.76]),
    ([[REJECTED] * 3, [ACCEPTED]], {}, 'MAV_RESULT_ACCEPTED (2 tries, 140 ms)', [0.0, 0.12]),
    ([[REJECTED]] * 100, {}, 'MAV_RESULT_TEMPORARILY_REJECTED (5 tries, 1.60 s)',
     [0.0, 0.12, 0.34, 0.76, 1.58]),
    ([[REJECTED], [REJECTED]], {'retries': 1}, 'no acknowledgement, last answer '
     'MAV_RESULT_TEMPORARILY_REJECTED (4 tries, 1.34 s)', [0.0, 0.12, 0.34, 0.84]),
    # The try without an answer may keep the target busy, and may still succeed.
    ([[], *[[REJECTED]] * 100], {}, 'not finished in time, last answer '
     'MAV_RESULT_TEMPORARILY_REJECTED (5 tries, 1.28 s)', [0.0, 0.5, 0.62, 0.84, 1.26]),
    # COMMAND_INT is sent only after the target has requested it.
    ([[INT_ONLY], [], [ACCEPTED]], {}, 'MAV_RESULT_ACCEPTED (3 tries, 540 ms)',
     [0.0, 0.02, 0.52]),
    ([[INT_ONLY], [LONG_ONLY]], {}, 'MAV_RESULT_COMMAND_LONG_ONLY (2 tries, 40 ms)',
     [0.0, 0.02]),
    ([[INT_ONLY]] * 20, {}, 'no acknowledgement, last answer MAV_RESULT_COMMAND_INT_ONLY '
     '(5 tries, 2.02 s)', [0.0, 0.02, 0.52, 1.02, 1.52]),
    ([[IN_PROGRESS, INT_ONLY]], {}, 'MAV_RESULT_COMMAND_INT_ONLY (1 try, 40 ms)', [0.0]),
    # The deadline ends a command in any state.
    ([], {'limit': 0.9}, 'no acknowledgement (2 tries, 900 ms)', [0.0, 0.5]),
    ([], {'limit': 0.0}, 'not finished in time (0 tries, 0 ms)', []),
    ([[IN_PROGRESS] * 250], {'limit': 1.5}, 'not finished in time, last answer '
     'MAV_RESULT_IN_PROGRESS at 0 % (1 try, 1.50 s)', [0.0]),
    ([[REJECTED]] * 100, {'limit': 0.3}, 'MAV_RESULT_TEMPORARILY_REJECTED (2 tries, 140 ms)',
     [0.0, 0.12])])
def test_command_ends_as_its_answers_say(
        answers: Sequence[Sequence[int]], options: dict[str, Any], said: str,
        times: list[float]) -> None:
    rig = Rig(*answers, retries=options.get('retries', 3))
    run = rig.ended(limit=options.get('limit', math.inf))
    assert (str(run.outcome), rig.times, rig.idle) == (said, times, True)
    assert run.outcome.accepted == said.startswith('MAV_RESULT_ACCEPTED')


def test_command_int_carries_the_params_of_the_command_long() -> None:
    rig = Rig([INT_ONLY], [], [ACCEPTED])
    rig.ended(406, params=(1.0, 50.0, 0.5, 25.0, 5.0, 6.0, 7.0))
    as_int = CommandInt(*LIGHT, 0, 406, 0, 0, 1.0, 50.0, 0.5, 25.0, 5, 6, 7.0)
    assert rig.messages == [
        CommandLong(*LIGHT, 406, 0, 1.0, 50.0, 0.5, 25.0, 5.0, 6.0, 7.0), as_int, as_int]


def test_second_refusal_of_the_command_long_does_not_end_the_command_int() -> None:
    # Two tries were sent before the first was refused, so the refusal comes twice.
    rig = Rig()
    run = rig.start()
    rig.run(0.6)
    for result in (INT_ONLY, INT_ONLY, ACCEPTED):
        assert run.outcomes == []
        rig.ack(result)
    assert run.outcome.accepted
    assert [type(message) for message in rig.messages] == [CommandLong, CommandLong, CommandInt]


def test_refusal_of_the_command_long_after_the_deadline_ends_the_command() -> None:
    rig = Rig()
    run = rig.start(limit=0.3)
    rig.now += 0.4
    rig.ack(INT_ONLY)
    assert (run.status, run.result, len(rig.frames)) == (STATUS.ANSWERED, INT_ONLY, 1)


def test_confirmation_counts_the_resends_up_to_255() -> None:
    rig = Rig(timeout=0.1, retries=300)
    rig.ended()
    assert [message.confirmation for message in rig.messages] == [*range(256), *[255] * 45]


# Acknowledgements

@pytest.mark.parametrize('changes', [
    *({'source': source} for source in (
        Address(1, 1), Address(2, 243), OTHER, Address(0, 0), OURS)),
    {'command': 406},
    # A ground station may command the same light.
    *({'target': target} for target in (
        Address(255, 190), Address(1, 191), Address(2, 193), Address(255, 0), Address(0, 191)))])
def test_acknowledgement_of_another_source_command_or_target_does_not_count(
        changes: dict[str, Any]) -> None:
    rig = Rig()
    run = rig.start()
    rig.ack(DENIED, **changes)
    assert run.outcomes == []
    assert len(rig.sender.round_trip(LIGHT)) == 0


@pytest.mark.parametrize('target', [OURS, Address(0, 0), Address(1, 0), Address(0, 193)])
def test_acknowledgement_to_us_or_without_target_counts(target: Address) -> None:
    rig = Rig()
    run = rig.start()
    rig.ack(ACCEPTED, target=target)
    assert run.outcome.accepted


def test_acknowledgements_before_a_command_and_after_its_end_change_nothing() -> None:
    rig = Rig()
    rig.ack(ACCEPTED)
    run, silent = rig.start(), rig.start(406)
    for result in (DENIED, ACCEPTED, DENIED):
        rig.ack(result)
    rig.run(LONG)
    rig.ack(ACCEPTED, 406)
    assert (run.result, silent.status) == (DENIED, STATUS.NO_ANSWER)


def test_component_does_not_answer_a_command_to_all_components() -> None:
    rig = Rig()
    run = rig.start(target=Address(1, 0))
    rig.ack(ACCEPTED, source=LIGHT)
    rig.run(LONG)
    assert run.status is STATUS.NO_ANSWER


# Progress

def test_each_report_of_progress_lengthens_the_wait_and_nothing_is_resent() -> None:
    rig = Rig()
    run = rig.start()
    for percent in (0, 40, 80):
        rig.ack(IN_PROGRESS, progress=percent)
        assert rig.sender.next_deadline() == pytest.approx(rig.now + PROGRESS_TIMEOUT)
        rig.run(2.99)
    assert run.outcomes == []
    rig.run(0.02)
    assert (run.status, run.outcome.progress, len(run.frames)) == (
        STATUS.PROGRESS_STOPPED, 80, 1)
    assert run.outcome.elapsed == pytest.approx(8.98)


@pytest.mark.parametrize(('reported', 'known'), [(0, 0), (100, 100), (101, None), (255, None)])
def test_progress_above_100_is_unknown(reported: int, known: int | None) -> None:
    rig = Rig()
    run = rig.start()
    rig.ack(IN_PROGRESS, progress=reported)
    rig.ack(FAILED)
    assert run.outcome.progress == known
    assert '%' not in str(run.outcome)


def test_rejection_of_a_resend_does_not_end_the_try_in_progress() -> None:
    rig = Rig()
    run = rig.start()
    rig.run(0.6)
    for result in (IN_PROGRESS, REJECTED, ACCEPTED):
        assert run.outcomes == []
        rig.ack(result)
    assert run.outcome.accepted


# Several commands

def test_commands_of_one_kind_are_sent_one_after_the_other() -> None:
    rig = Rig()
    runs = [rig.start() for _ in range(3)]
    rig.run(1.2)
    assert [len(run.frames) for run in runs] == [3, 0, 0]
    for place, result in enumerate((ACCEPTED, DENIED, FAILED)):
        rig.ack(result)
        assert runs[place].result == result
        assert [bool(run.frames) for run in runs] == [True, True, place > 0]
    assert runs[1].frames[0][1].confirmation == 0


def test_command_behind_one_without_answer_is_sent_and_its_time_begins_then() -> None:
    rig = Rig([], [], [], [], [ACCEPTED])
    first, second = rig.start(), rig.start()
    rig.run(LONG)
    assert first.status is STATUS.NO_ANSWER
    assert str(second.outcome) == 'MAV_RESULT_ACCEPTED (1 try, 20 ms)'


@pytest.mark.parametrize('ended_by', ['acknowledgement', 'late poll', 'poll'])
def test_command_whose_deadline_passes_while_it_waits_is_never_sent(ended_by: str) -> None:
    rig = Rig()
    first, second = rig.start(), rig.start(limit=0.4)
    begun = rig.now
    if ended_by == 'poll':
        rig.run(0.45)
        assert second.ended_at == pytest.approx(begun + 0.4)
    rig.now = begun + 0.45
    if ended_by == 'acknowledgement':
        rig.ack(ACCEPTED)
    rig.poll()
    assert str(second.outcome) == 'not finished in time (0 tries, 0 ms)'
    rig.run(LONG)
    assert (second.frames, len(first.outcomes), len(second.outcomes)) == ([], 1, 1)


def test_command_beyond_the_bound_of_waiting_ones_is_refused() -> None:
    rig = Rig()
    runs = [rig.start() for _ in range(MAX_WAITING + 2)]
    assert [len(run.outcomes) for run in runs] == [0] * (MAX_WAITING + 1) + [1]
    assert str(runs[-1].outcome) == (
        'too many commands are waiting for this component (0 tries, 0 ms)')


def test_commands_of_other_kinds_and_targets_do_not_wait() -> None:
    rig = Rig()
    runs = [rig.start(405), rig.start(406), rig.start(405, OTHER),
            rig.start(512, params=(148.0,)), rig.start(512, params=(259.0,))]
    assert [message.command for message in rig.messages] == [405, 406, 405, 512, 512]
    for command, source in ((406, LIGHT), (405, OTHER), (512, LIGHT), (512, LIGHT)):
        rig.ack(ACCEPTED, command, source=source)
    assert [len(run.outcomes) for run in runs] == [0, 1, 1, 1, 1]


# Ended from outside

@pytest.mark.parametrize('ending', [STATUS.LINK_LOST, STATUS.CANCELLED])
def test_all_commands_that_are_sent_or_wait_can_be_ended_for_good(ending: CommandStatus) -> None:
    rig = Rig()
    for command, target in ((405, LIGHT), (405, LIGHT), (406, LIGHT), (405, OTHER)):
        rig.start(command, target)
    rig.ack(IN_PROGRESS, 406, progress=30)
    rig.now += 0.1
    for status in (ending, STATUS.OUT_OF_TIME):
        rig.sender.end_all(rig.now, status)
    rig.ack(ACCEPTED)
    rig.run(LONG)
    assert [run.status for run in rig.runs] == [ending] * 4
    assert (len(rig.frames), rig.idle) == (3, True)
    assert str(rig.runs[2].outcome) == (
        f'{ending.value}, last answer MAV_RESULT_IN_PROGRESS at 30 % (1 try, 100 ms)')
    again = rig.start()
    rig.ack(ACCEPTED)
    assert again.outcome.accepted


def test_commands_of_one_target_can_be_ended_without_those_of_others() -> None:
    rig = Rig()
    rig.start()
    rig.start()
    kept = rig.start(target=OTHER)
    rig.sender.end_all(rig.now, STATUS.CANCELLED, LIGHT)
    assert [len(run.outcomes) for run in rig.runs] == [1, 1, 0]
    rig.ack(ACCEPTED, source=OTHER)
    assert kept.outcome.accepted


def test_closed_sender_ends_all_commands_and_sends_no_others_than_those_of_the_end() -> None:
    rig = Rig()

    def may_send(sent: Command | Message) -> bool:
        return isinstance(sent, Command) and sent.params[:1] == (0.0,)

    sent, waiting, request = (rig.start(405, params=(1.0,)), rig.start(405, params=(1.0,)),
                              rig.start(mavlink.MAV_CMD_REQUEST_MESSAGE, OTHER, params=(440.0,)))
    last = rig.start(406, OTHER, params=(0.0,))
    rig.sender.close(rig.now, may_send)
    assert [run.status for run in (sent, waiting)] == [STATUS.CLOSED] * 2
    before = len(rig.frames)
    refused = [rig.start(405, params=(1.0,)), rig.start(406, params=(40.0,))]
    rig.sender.send(heartbeat(mavlink.MAV_TYPE_GCS))
    assert [run.status for run in refused] == [STATUS.CLOSED] * 2
    assert (rig.sender.refusal, len(rig.frames)) == ('the bridge is ending', before)

    began, off = rig.now, rig.start(405, params=(0.0,))
    rig.run(2.05)
    # It is repeated for as long as the process lasts.
    assert [round(at - began, 3) for at, message in rig.frames[before:]
            if message.command == 405] == [round(0.1 * number, 3) for number in range(21)]
    assert [run.outcomes for run in (off, last, request)] == [[]] * 3


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
            rig.sender.end_all(rig.now, STATUS.LINK_LOST)
    assert (len(outcomes), rig.idle) == (3, True)


def test_overtaking_command_cancels_those_that_wait_or_are_unacknowledged_and_is_sent() -> None:
    rig = Rig()
    others = [rig.start() for _ in range(31)]
    off = rig.start(overtake=True)
    assert [run.status for run in others] == [STATUS.CANCELLED] * 31
    assert (len(rig.frames), len(off.frames)) == (2, 1)
    rig.ack(ACCEPTED)
    assert off.outcome.accepted


@pytest.mark.parametrize('rejections', [0, 1])
def test_overtaking_command_is_sent_beside_one_in_progress(rejections: int) -> None:
    rig = Rig()
    on = rig.start()
    rig.ack(IN_PROGRESS)
    off, waiting = rig.start(overtake=True), rig.start()
    for _ in range(rejections):
        # A command in progress is not rejected: the rejection belongs to the other command.
        rig.ack(REJECTED)
        rig.run(0.15)
    assert [len(run.frames) for run in (on, off, waiting)] == [1, 1 + rejections, 0]
    for result in (ACCEPTED, DENIED, FAILED):
        # An acknowledgement names only the command, so it ends the oldest one.
        rig.ack(result)
    assert (on.result, off.result, waiting.result) == (ACCEPTED, DENIED, FAILED)


def test_command_that_is_not_resent_may_be_answered_and_one_that_waits_is_cancelled() -> None:
    rig = Rig()
    sent, waiting = rig.start(), rig.start()
    rig.sender.stop_resending(rig.now, LIGHT, lambda command: True)
    rig.run(0.3)
    assert (sent.outcomes, waiting.status) == ([], STATUS.CANCELLED)
    rig.ack(ACCEPTED)
    rig.run(LONG)
    assert (sent.result, len(sent.frames), len(waiting.frames)) == (ACCEPTED, 1, 0)


@pytest.mark.parametrize('place', [0, 1])
def test_cancelled_command_ends_and_the_other_is_sent(place: int) -> None:
    rig = Rig()
    runs = [rig.start(), rig.start()]
    rig.sender.cancel(runs[place].command, rig.now)
    rig.flush()
    assert runs[place].status is STATUS.CANCELLED
    assert (runs[1 - place].outcomes, len(runs[1 - place].frames)) == ([], 1)


@pytest.mark.parametrize(('first', 'second', 'after', 'ambiguous'), [
    (DENIED, DENIED, 4.9, True), (DENIED, DENIED, 5.1, False), (ACCEPTED, DENIED, 0.4, False),
    (None, DENIED, 0.4, True), (None, ACCEPTED, 0.4, True)])
def test_result_says_whether_it_may_be_that_of_the_command_before(
        first: int | None, second: int, after: float, ambiguous: bool) -> None:
    rig = Rig()
    before = rig.start()
    if first is None:
        rig.sender.cancel(before.command, rig.now)
    else:
        rig.ack(first)
    rig.now += after
    run = rig.start()
    rig.ack(second)
    assert not before.outcome.may_answer_earlier(rig.now)
    assert run.outcome.may_answer_earlier(rig.now) is ambiguous


@pytest.mark.parametrize(('first', 'copies', 'ambiguous'), [
    # The second command may have ended with the late answer to the first.
    (None, 0, True),
    # More copies may come where one came.
    (DENIED, 1, True), (DENIED, 0, False)])
def test_result_says_whether_it_may_be_that_of_a_command_before_the_last(
        first: int | None, copies: int, ambiguous: bool) -> None:
    rig = Rig()
    if first is None:
        rig.sender.cancel(rig.start().command, rig.now)
    else:
        rig.start()
        for _ in range(1 + copies):
            rig.ack(first)
    rig.start()
    rig.ack(ACCEPTED)
    run = rig.start()
    rig.ack(DENIED)
    assert run.outcome.may_answer_earlier(rig.now) is ambiguous


# Fields, arguments, texts and counters

@pytest.mark.parametrize(('command', 'as_int', 'message'), [
    (Command(LIGHT, 1, (1.0,)), False, CommandLong(*LIGHT, 1, 2, 1.0, *[0.0] * 6)),
    (Command(LIGHT, 1, (1.0,), math.nan), False, CommandLong(*LIGHT, 1, 2, 1.0, *[math.nan] * 6)),
    (Command(LIGHT, 1, (1.0,), math.nan), True, CommandInt(
        *LIGHT, 0, 1, 0, 0, 1.0, math.nan, math.nan, math.nan, 0x7FFFFFFF, 0x7FFFFFFF, math.nan)),
    (Command(LIGHT, 195, (1.0,), 0.0, Position(0, 47.3977418, -8.5455938, 488.25)), False,
     CommandInt(*LIGHT, 0, 195, 0, 0, 1.0, 0.0, 0.0, 0.0, 473977418, -85455938, 488.25)),
    (Command(LIGHT, 195, (), 0.0, Position(1, 12.5, -0.0001, -3.5)), False,
     CommandInt(*LIGHT, 1, 195, 0, 0, 0.0, 0.0, 0.0, 0.0, 125000, -1, -3.5)),
    (Command(LIGHT, 195, (), 0.0, Position(5, math.nan, math.nan, math.nan)), False, CommandInt(
        *LIGHT, 5, 195, 0, 0, 0.0, 0.0, 0.0, 0.0, 0x7FFFFFFF, 0x7FFFFFFF, math.nan))])
def test_message_has_unset_params_and_position_as_the_command_says(
        command: Command, as_int: bool, message: CommandLong | CommandInt) -> None:
    # As text, because NaN differs from itself.
    assert str(command.message(2, as_int)) == str(message)


def test_position_timeout_and_retries_out_of_range_are_refused() -> None:
    with pytest.raises(ValueError, match='position of 300, 0'):
        Position(0, 300.0, 0.0, 0.0)
    for timeout in (0.0, -0.5, math.nan, math.inf):
        with pytest.raises(ValueError, match='timeout'):
            CommandSender(OURS, timeout)
    with pytest.raises(ValueError, match='retries -1'):
        CommandSender(OURS, 0.5, -1)


def test_durations_are_in_ms_below_a_second() -> None:
    assert [format_seconds(seconds) for seconds in (0.0004, 0.9994, 0.9996, 12.345)] == [
        '0 ms', '999 ms', '1.00 s', '12.35 s']


def test_sender_counts_tries_and_silence_and_names_the_silent_target_until_it_answers() -> None:
    rig = Rig(retries=2)
    rig.ended()
    assert set(rig.sender.unanswering) == {LIGHT}
    for target in (OTHER, LIGHT):
        rig.start(target=target)
        assert set(rig.sender.unanswering) == {LIGHT}
        rig.ack(DENIED, source=target)
    rig.ack(ACCEPTED)
    counters = rig.sender.counters
    assert (counters.sent, counters.resent, counters.unanswered) == (5, 2, 1)
    assert not rig.sender.unanswering


@pytest.mark.parametrize(('pause', 'remembered'), [
    (ACK_LIFETIME - 2, True), (ACK_LIFETIME, False)])
def test_an_ended_command_is_remembered_while_its_acknowledgement_may_come(
        pause: float, remembered: bool) -> None:
    rig = Rig(timeout=0.5, retries=0)
    for target in (LIGHT, OTHER):
        rig.start(target=target)
        rig.run(1.0)
        rig.run(pause)

    run = rig.start()
    rig.ack(ACCEPTED)
    assert (run.outcome.earlier is not None) is remembered


def test_targets_that_do_not_answer_are_bounded() -> None:
    rig = Rig(retries=0)
    targets = [Address(system, 1) for system in range(1, MAX_TARGETS + 3)]
    for target in targets:
        rig.ended(target=target)

    assert list(rig.sender.unanswering) == targets[2:]


def test_callback_may_end_all_other_commands() -> None:
    rig = Rig(retries=0)
    ends: list[CommandStatus] = []

    def close(outcome: CommandResult, now: float) -> None:
        ends.append(outcome.status)
        rig.sender.end_all(now, STATUS.CANCELLED)

    for target in (LIGHT, OTHER) * 3:
        rig.sender.start(Command(target, 405), rig.now, close)
    rig.run(LONG)
    assert sorted(ends, key=str) == [STATUS.CANCELLED] * 5 + [STATUS.NO_ANSWER]
    assert rig.idle


# Round trips

def of(*seconds: float) -> RttEstimator:
    """Return an estimator with these samples."""
    estimator = RttEstimator()
    for sample in seconds:
        estimator.add(sample, 0.0)
    return estimator


@pytest.mark.parametrize(('samples', 'longest', 'timeout'), [
    *(([0.01] * known, 0.5, 0.5) for known in range(MIN_SAMPLES)),
    # Four times the round trip, at least the floor and at most the given time-out, which may be
    # below the floor.
    ([0.001] * 4, 0.5, 0.2), ([0.06] * 4, 0.5, 0.24), ([0.125] * 4, 0.5, 0.5),
    ([0.4] * 4, 0.5, 0.5), ([0.001] * 10, 0.05, 0.05),
    # One slow answer among many does not count, four do; old samples are dropped.
    ([0.06] * 30 + [0.45], 2.0, 0.24), ([0.06] * 30 + [0.45] * 4, 2.0, 1.8),
    ([0.45] * MAX_SAMPLES + [0.06] * MAX_SAMPLES, 2.0, 0.24)])
def test_timeout_is_four_times_the_95th_percentile_within_bounds(
        samples: list[float], longest: float, timeout: float) -> None:
    assert of(*samples).timeout(longest) == pytest.approx(timeout)


@given(st.lists(st.floats(0, 10), min_size=1, max_size=100), st.floats(0.01, 5))
def test_timeout_and_quantiles_stay_within_bounds_for_any_samples(
        samples: list[float], longest: float) -> None:
    estimator, last = of(*samples), sorted(samples[-MAX_SAMPLES:])
    assert min(MIN_TIMEOUT, longest) <= estimator.timeout(longest) <= longest
    for share in (0.0, 0.5, 0.95, 1.0):
        assert estimator.quantile(share) == last[min(int(share * len(last)), len(last) - 1)]


def test_quantile_of_no_sample_is_unknown() -> None:
    assert of().quantile(0.5) is None


def test_shortest_comes_from_unambiguous_samples_and_is_0_while_none_is_ambiguous() -> None:
    estimator = of(*[0.4] * 6)
    assert estimator.shortest(0.0) == 0.0
    estimator.expect_ambiguous(0.0)
    estimator.add(0.001, ACK_LIFETIME - 0.1)
    assert (estimator.shortest(ACK_LIFETIME - 0.1), estimator.shortest(ACK_LIFETIME)) == (0.4, 0.0)


def test_a_resend_before_the_first_sample_makes_that_ambiguous() -> None:
    rig = Rig()
    rig.start()
    rig.run(0.6)
    rig.ack(ACCEPTED)
    rig.start()
    rig.run(0.01)
    rig.ack(ACCEPTED)
    estimator = rig.sender.round_trip(LIGHT)
    assert len(estimator) == 1
    assert estimator.shortest(rig.now) == pytest.approx(0.01)


def taught(seconds: float, timeout: float) -> Rig:
    """Return a rig that has enough samples of this round-trip time, s."""
    rig = Rig(timeout=timeout)
    for _ in range(MIN_SAMPLES):
        rig.start()
        rig.now += seconds
        rig.ack(ACCEPTED)
    return rig


def test_a_line_that_becomes_slower_than_the_wait_is_measured_again() -> None:
    rig = taught(0.02, 0.5)
    tries = []
    for _ in range(5):
        run = rig.start()
        rig.run(0.4)
        rig.ack(ACCEPTED)
        if len(run.frames) > 1:
            # Acknowledge the second try, which was not needed.
            rig.run(0.2)
            rig.ack(ACCEPTED)
        tries.append(run.outcome.tries)
    assert (tries[0], tries[-1]) == (2, 1)


def test_a_copy_of_an_acknowledgement_is_not_taken_for_that_of_another_try() -> None:
    rig = taught(0.02, 0.5)
    for _ in range(5):
        run = rig.start()
        rig.run(0.4)
        rig.ack(ACCEPTED)
        rig.run(0.05)
        rig.ack(ACCEPTED)
        rig.run(1.0)
        assert run.outcome.tries == 2


@pytest.mark.parametrize(('seconds', 'timeout', 'times'), [
    # Each wait is twice the one before it, up to the given time-out.
    (0.06, 1.0, [0.0, 0.24, 0.72, 1.68, 2.68]), (0.4, 0.5, [0.0, 0.5, 1.0, 1.5, 2.0])])
def test_resends_follow_the_round_trip_times_of_the_target(
        seconds: float, timeout: float, times: list[float]) -> None:
    rig = taught(seconds, timeout)
    begun, run = rig.now, rig.ended()
    assert [*(time - begun for time, _ in run.frames), run.ended_at - begun] == pytest.approx(
        times)
    assert rig.sender.round_trip(Address(1, 244)).timeout(0.5) == 0.5


def test_wait_after_a_rejected_try_is_not_longer() -> None:
    rig = taught(0.06, 1.0)
    run = rig.start()
    rig.ack(REJECTED)
    rig.run(0.1)
    assert rig.sender.next_deadline() == pytest.approx(run.frames[1][0] + 0.24)


# An acknowledgement after a resend may belong to either try (Karn's algorithm).
@pytest.mark.parametrize(('answers', 'samples'), [
    ([(0.01, ACCEPTED)], [0.01]), ([(0.6, ACCEPTED)], []),
    ([(0.01, IN_PROGRESS), (0.05, ACCEPTED)], [0.01]),
    ([(0.01, REJECTED), (0.05, ACCEPTED)], [0.01]),
    ([(0.01, INT_ONLY), (0.01, ACCEPTED)], [0.01])])
def test_only_the_first_answer_to_the_only_try_is_measured(
        answers: list[tuple[float, int]], samples: list[float]) -> None:
    rig = Rig()
    rig.start()
    for after, result in answers:
        rig.run(after)
        rig.ack(result)
    estimator = rig.sender.round_trip(LIGHT)
    assert len(estimator) == len(samples)
    assert samples == [] or estimator.quantile(1.0) == pytest.approx(samples[0])
