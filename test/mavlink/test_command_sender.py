# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The command protocol: how often a command is sent, which answer counts, and how it ends."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Any

from illuminator_ros.mavlink.command_sender import (
    Command,
    CommandPosition,
    CommandResult,
    CommandSender,
    CommandStatus,
    MAX_TARGETS,
    PROGRESS_TIMEOUT,
    request_message,
)
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.durations import format_seconds
from illuminator_ros.mavlink.messages import Address, CommandInt, CommandLong, heartbeat, Message
from illuminator_ros.mavlink.retries import CLOSING
import pytest
from support.command_rig import DELAY, LIGHT, LONG, OURS, Rig

OTHER = Address(1, 244)
REQUEST = mavlink.MAV_CMD_REQUEST_MESSAGE
ACCEPTED, REJECTED, DENIED, FAILED, IN_PROGRESS, INT_ONLY, LONG_ONLY = (
    mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_TEMPORARILY_REJECTED,
    mavlink.MAV_RESULT_DENIED, mavlink.MAV_RESULT_FAILED, mavlink.MAV_RESULT_IN_PROGRESS,
    mavlink.MAV_RESULT_COMMAND_INT_ONLY, mavlink.MAV_RESULT_COMMAND_LONG_ONLY)
# The times of the tries that get no answer, s.
SILENT = [0.0, 0.25, 0.75, 1.75]


# The answers to each try, 20 ms apart; retries and the limit -> the result as text, and when the
# tries were sent, s. The first nine are QGroundControl's own test cases.
@pytest.mark.parametrize(('answers', 'options', 'said', 'times'), [
    ([[ACCEPTED]], {}, 'MAV_RESULT_ACCEPTED (1 try, 20 ms)', [0.0]),
    ([[FAILED]], {}, 'MAV_RESULT_FAILED (1 try, 20 ms)', [0.0]),
    ([[], [ACCEPTED]], {}, 'MAV_RESULT_ACCEPTED (2 tries, 270 ms)', SILENT[:2]),
    ([[], [FAILED]], {}, 'MAV_RESULT_FAILED (2 tries, 270 ms)', SILENT[:2]),
    ([], {}, 'no acknowledgement (4 tries, 2.75 s)', SILENT),
    ([], {'retries': 0}, 'no acknowledgement (1 try, 250 ms)', [0.0]),
    ([[IN_PROGRESS, ACCEPTED]], {}, 'MAV_RESULT_ACCEPTED (1 try, 40 ms)', [0.0]),
    ([[IN_PROGRESS, FAILED]], {}, 'MAV_RESULT_FAILED (1 try, 40 ms)', [0.0]),
    ([[IN_PROGRESS]], {}, 'no final acknowledgement, last answer MAV_RESULT_IN_PROGRESS at 0 % '
     '(1 try, 3.02 s)', [0.0]),
    # Each wait is twice the one before it, up to 1 s, or as long as the time-out.
    ([], {'retries': 5}, 'no acknowledgement (6 tries, 4.75 s)', [*SILENT, 2.75, 3.75]),
    ([], {'retries': 1, 'timeout': 1.5}, 'no acknowledgement (2 tries, 3.00 s)', [0.0, 1.5]),
    # Progress ends the resending; then an earlier resend may still be rejected.
    ([[], [IN_PROGRESS]], {}, 'no final acknowledgement, last answer MAV_RESULT_IN_PROGRESS at '
     '0 % (2 tries, 3.27 s)', SILENT[:2]),
    ([[REJECTED, IN_PROGRESS]], {}, 'no final acknowledgement, last answer '
     'MAV_RESULT_IN_PROGRESS at 0 % (1 try, 3.04 s)', [0.0]),
    ([[IN_PROGRESS, REJECTED, ACCEPTED]], {}, 'MAV_RESULT_ACCEPTED (1 try, 60 ms)', [0.0]),
    # A temporary rejection is tried again with growing pauses, and is not one of the retries; it
    # ends with the time that a command without an answer has.
    ([[REJECTED], [REJECTED], [REJECTED], [ACCEPTED]], {}, 'MAV_RESULT_ACCEPTED (4 tries, '
     '780 ms)', [0.0, 0.12, 0.34, 0.76]),
    ([[REJECTED]] * 100, {}, 'MAV_RESULT_TEMPORARILY_REJECTED (6 tries, 2.42 s)',
     [0.0, 0.12, 0.34, 0.76, 1.58, 2.4]),
    ([[REJECTED], [REJECTED]], {'retries': 1}, 'no acknowledgement, last answer '
     'MAV_RESULT_TEMPORARILY_REJECTED (4 tries, 1.09 s)', [0.0, 0.12, 0.34, 0.59]),
    # COMMAND_INT is sent only after the target has requested it.
    ([[INT_ONLY], [], [ACCEPTED]], {}, 'MAV_RESULT_ACCEPTED (3 tries, 290 ms)',
     [0.0, 0.02, 0.27]),
    ([[REJECTED, INT_ONLY], [ACCEPTED]], {}, 'MAV_RESULT_ACCEPTED (2 tries, 60 ms)', [0.0, 0.04]),
    ([[INT_ONLY], [LONG_ONLY]], {}, 'MAV_RESULT_COMMAND_LONG_ONLY (2 tries, 40 ms)', [0.0, 0.02]),
    ([[INT_ONLY]] * 20, {}, 'MAV_RESULT_COMMAND_INT_ONLY (2 tries, 40 ms)', [0.0, 0.02]),
    ([[IN_PROGRESS, INT_ONLY]], {}, 'MAV_RESULT_COMMAND_INT_ONLY (1 try, 40 ms)', [0.0]),
    # The deadline ends a command in any state.
    ([], {'limit': 0.9}, 'no acknowledgement (3 tries, 900 ms)', SILENT[:3]),
    ([], {'limit': 0.0}, 'not finished in time (0 tries, 0 ms)', []),
    ([[IN_PROGRESS] * 250], {'limit': 1.5}, 'not finished in time, last answer '
     'MAV_RESULT_IN_PROGRESS at 0 % (1 try, 1.50 s)', [0.0]),
    ([[REJECTED]] * 100, {'limit': 0.3}, 'MAV_RESULT_TEMPORARILY_REJECTED (2 tries, 140 ms)',
     [0.0, 0.12])])
def test_command_ends_as_its_answers_say(
        answers: Sequence[Sequence[int]], options: dict[str, Any], said: str,
        times: list[float]) -> None:
    rig = Rig(*answers, **{name: options[name] for name in options if name != 'limit'})
    run = rig.start(limit=options.get('limit', math.inf))
    rig.run(LONG)
    assert (str(run.outcome), [round(at - 1000.0, 6) for at, _ in run.frames]) == (said, times)
    assert rig.sender.schedule.due == math.inf


def test_a_command_without_an_answer_names_a_clock_that_is_not_set() -> None:
    rig = Rig(clock_fault=lambda: 'the clock is wrong')
    unanswered, refused = rig.start(), rig.start(command=406)
    rig.ack(DENIED, 406)
    rig.run(LONG)

    assert str(unanswered.outcome) == 'no acknowledgement (the clock is wrong) (4 tries, 2.75 s)'
    assert 'clock' not in str(refused.outcome)


@pytest.mark.parametrize('result', range(256))
def test_each_result_but_three_ends_a_command_at_once(result: int) -> None:
    rig = Rig()
    run = rig.start()
    rig.ack(result)
    ends_it = result not in (IN_PROGRESS, REJECTED, INT_ONLY)
    assert bool(run.outcomes) is ends_it
    if ends_it:
        assert (run.outcome.result, run.outcome.accepted, run.outcome.refused) == (
            result, result == ACCEPTED, result != ACCEPTED)


def test_command_int_carries_the_params_and_each_resend_its_number_and_its_follow_up() -> None:
    rig = Rig([], [], [INT_ONLY], [], [ACCEPTED])
    params, request = (1.0, 50.0, 0.5, 25.0, 5.0, 6.0, 7.0), request_message(LIGHT, 440)
    rig.sender.start(Command(LIGHT, 406, params), rig.now, follow_up=request)
    rig.flush()
    rig.run(LONG)
    assert [message for _, message in rig.sent] == [
        *(message for one in (
            CommandLong(*LIGHT, 406, 0, *params), CommandLong(*LIGHT, 406, 1, *params),
            CommandInt(*LIGHT, 0, 406, 0, 0, *params[:4], 5, 6, 7.0))
          for message in (one, CommandLong(*LIGHT, 512, 0, 440.0, *[0.0] * 6)))]


def test_confirmation_counts_the_resends_and_earlier_tries_up_to_255() -> None:
    rig = Rig(retries=300)
    run = rig.start(tried=3)
    rig.run(400.0)
    assert [message.confirmation for _, message in rig.sent] == [*range(3, 256), *[255] * 48]
    assert (run.outcome.tries, rig.times[:4]) == (304, SILENT)


# Acknowledgements

@pytest.mark.parametrize(('changes', 'counts'), [
    *(({'source': source}, False) for source in (
        Address(1, 1), Address(2, 243), OTHER, Address(0, 0), OURS)),
    ({'command': 406}, False),
    # A ground station may command the same light.
    *(({'target': Address(*target)}, False) for target in (
        (255, 190), (1, 191), (2, 193), (255, 0), (0, 191))),
    *(({'target': Address(*target)}, True) for target in (OURS, (0, 0), (1, 0), (0, 193)))])
def test_acknowledgement_counts_from_the_target_for_the_command_and_for_us_or_all(
        changes: dict[str, Any], counts: bool) -> None:
    rig = Rig()
    run = rig.start()
    rig.now += 0.1
    rig.ack(DENIED, **changes)
    assert bool(run.outcomes) is counts
    assert rig.sender.round_trips == ({LIGHT: pytest.approx(0.1)} if counts else {})


def test_acknowledgements_before_a_command_and_after_its_end_change_nothing() -> None:
    rig = Rig()
    rig.ack(ACCEPTED)
    run, silent, to_all = rig.start(), rig.start(406), rig.start(407, Address(1, 0))
    for result in (DENIED, ACCEPTED, DENIED):
        rig.ack(result)
    rig.ack(ACCEPTED, 407)
    rig.run(LONG)
    rig.ack(ACCEPTED, 406)
    assert run.outcome.result == DENIED
    assert [one.outcome.status for one in (silent, to_all)] == [CommandStatus.NO_ANSWER] * 2


@pytest.mark.parametrize(('last', 'said'), [(0, ' at 0 %'), (100, ' at 100 %'), (101, '')])
def test_each_report_of_progress_lengthens_the_wait_and_nothing_is_resent(
        last: int, said: str) -> None:
    rig = Rig()
    run = rig.start()
    for percent in (0, 40, 80, last):
        rig.ack(IN_PROGRESS, progress=percent)
        rig.run(PROGRESS_TIMEOUT - 0.01)
        assert run.outcomes == []
    rig.run(0.02)
    assert (str(run.outcome), len(run.frames)) == (
        f'no final acknowledgement, last answer MAV_RESULT_IN_PROGRESS{said} (1 try, 11.97 s)', 1)
    assert rig.sender.round_trips == {LIGHT: 0.0}


# Several commands

def test_newer_command_replaces_the_one_of_its_kind_and_no_other() -> None:
    rig = Rig()
    kinds: list[dict[str, Any]] = [
        {}, {'command': 406}, {'target': OTHER}, {'command': REQUEST, 'param1': 148.0},
        {'command': REQUEST, 'param1': 259.0}]
    first, second = ([rig.start(**kind) for kind in kinds] for _ in range(2))
    assert [str(run.outcome) for run in first] == ['cancelled (1 try, 0 ms)'] * 5
    assert [(run.frames[0][1].confirmation, run.outcomes) for run in second] == [(0, [])] * 5
    assert len(rig.sender) == 5
    rig.ack(ACCEPTED)
    assert [len(run.outcomes) for run in second] == [1, 0, 0, 0, 0]
    # The acknowledgement of a request does not name the message.
    rig.ack(DENIED, REQUEST)
    assert [len(run.outcomes) for run in second] == [1, 0, 0, 1, 0]


@pytest.mark.parametrize('status', [CommandStatus.LINK_LOST, CommandStatus.CANCELLED])
@pytest.mark.parametrize('target', [None, LIGHT])
def test_all_commands_or_those_of_one_target_can_be_ended_for_good(
        status: CommandStatus, target: Address | None) -> None:
    rig = Rig()
    runs = [rig.start(), rig.start(406), rig.start(target=OTHER)]
    rig.ack(IN_PROGRESS, 406, progress=30)
    rig.now += 0.1
    for one in (status, CommandStatus.OUT_OF_TIME):
        rig.sender.end_all(rig.now, one, target)
    rig.ack(ACCEPTED)
    assert str(runs[1].outcome) == (
        f'{status.value}, last answer MAV_RESULT_IN_PROGRESS at 30 % (1 try, 100 ms)')
    rig.ack(ACCEPTED, source=OTHER)
    assert [run.outcome.status for run in runs] == [
        status, status, status if target is None else CommandStatus.ANSWERED]
    assert (len(rig.sent), len(rig.sender)) == (3, 0)


def test_cancelled_command_ends_and_cancelling_it_again_leaves_the_next_one() -> None:
    rig = Rig()
    run = rig.start()
    rig.sender.cancel(run.sending, rig.now)
    assert len(rig.sender) == 0
    newer = rig.start()
    rig.sender.cancel(run.sending, rig.now)
    assert run.outcome.status is CommandStatus.CANCELLED
    assert (newer.outcomes, len(rig.sender)) == ([], 1)


def test_closed_sender_ends_all_commands_and_sends_no_others_than_those_of_the_end() -> None:
    rig = Rig()
    on, request, off = rig.start(param1=1.0), rig.start(REQUEST, param1=440.0), rig.start(406)

    def may_send(sent: Command | Message) -> bool:
        return isinstance(sent, Command) and sent.params[0] == 0.0

    assert rig.sender.refusal == ''
    rig.sender.close(rig.now, may_send, 'the bridge is ending')
    rig.sender.send(heartbeat(mavlink.MAV_TYPE_GCS))
    refused = rig.start(407, param1=1.0)
    assert [run.outcome.status for run in (on, refused)] == [CommandStatus.CLOSED] * 2
    assert (rig.sender.refusal, len(rig.sent)) == ('the bridge is ending', 3)
    last = rig.start()
    rig.run(2.05)
    # It is repeated for as long as the process lasts.
    assert [at - 1000.0 for at, _ in last.frames] == pytest.approx(
        [CLOSING.first * number for number in range(21)])
    assert [run.outcomes for run in (request, off, last)] == [[]] * 3


@pytest.mark.parametrize('by', ['acknowledgement', 'silence', 'lost link'])
def test_callback_may_start_the_same_command_again_and_end_all_others(by: str) -> None:
    rig = Rig()
    outcomes: list[CommandResult] = []

    def again(outcome: CommandResult, now: float) -> None:
        outcomes.append(outcome)
        rig.sender.end_all(now, CommandStatus.CANCELLED)
        if len(outcomes) < 3:
            rig.sender.start(Command(LIGHT, 405), now, again)

    other = rig.start(target=OTHER)
    rig.sender.start(Command(LIGHT, 405), rig.now, again)
    for _ in range(3):
        if by == 'acknowledgement':
            rig.ack(ACCEPTED)
        elif by == 'silence':
            rig.run(2.75)
        else:
            rig.sender.end_all(rig.now, CommandStatus.LINK_LOST)
    assert (len(outcomes), len(other.outcomes), len(rig.sender)) == (3, 1, 0)


# Fields, arguments, texts and counters

@pytest.mark.parametrize(('command', 'as_int', 'message'), [
    (Command(LIGHT, 1, (1.0,)), False, CommandLong(*LIGHT, 1, 2, 1.0, *[0.0] * 6)),
    (Command(LIGHT, 1, (1.0,), math.nan), False, CommandLong(*LIGHT, 1, 2, 1.0, *[math.nan] * 6)),
    (Command(LIGHT, 1, (1.0,), math.nan), True, CommandInt(
        *LIGHT, 0, 1, 0, 0, 1.0, math.nan, math.nan, math.nan, 0x7FFFFFFF, 0x7FFFFFFF, math.nan)),
    (Command(LIGHT, 195, (1.0,), 0.0, CommandPosition(0, 47.3977418, -8.5455938, 488.25)), False,
     CommandInt(*LIGHT, 0, 195, 0, 0, 1.0, 0.0, 0.0, 0.0, 473977418, -85455938, 488.25)),
    (Command(LIGHT, 195, (), 0.0, CommandPosition(1, 12.5, -0.0001, -3.5)), False,
     CommandInt(*LIGHT, 1, 195, 0, 0, 0.0, 0.0, 0.0, 0.0, 125000, -1, -3.5)),
    (Command(LIGHT, 195, (), 0.0, CommandPosition(5, math.nan, math.nan, math.nan)), False,
     CommandInt(
         *LIGHT, 5, 195, 0, 0, 0.0, 0.0, 0.0, 0.0, 0x7FFFFFFF, 0x7FFFFFFF, math.nan))])
def test_message_has_unset_params_and_position_as_the_command_says(
        command: Command, as_int: bool, message: CommandLong | CommandInt) -> None:
    # As text, because NaN differs from itself.
    assert str(command.message(2, as_int)) == str(message)


def test_position_timeout_and_retries_out_of_range_are_refused() -> None:
    for x, y in ((300.0, 0.0), (math.nan, -300.0), (math.inf, 0.0), (0.0, -math.inf)):
        with pytest.raises(ValueError, match=f'position of {x:g}, {y:g} does'):
            CommandPosition(0, x, y, 0.0)
    for timeout in (0.0, -0.5, math.nan, math.inf):
        with pytest.raises(ValueError, match='timeout'):
            CommandSender(OURS, timeout)
    with pytest.raises(ValueError, match='retries -1'):
        CommandSender(OURS, 0.5, -1)


def test_durations_are_in_ms_below_a_second() -> None:
    assert [format_seconds(seconds) for seconds in (0.0004, 0.9994, 0.9996, 12.345)] == [
        '0 ms', '999 ms', '1.00 s', '12.35 s']


def test_sender_counts_tries_and_keeps_the_last_round_trip_and_silence_of_some_targets() -> None:
    rig = Rig(retries=2)
    targets = [Address(system, 1) for system in range(1, MAX_TARGETS + 3)]
    for target in targets:
        rig.start(target=target)
    rig.run(LONG)
    counters = rig.sender.counters
    count = len(targets)
    assert (counters.sent, counters.resent, counters.unanswered) == (3 * count, 2 * count, count)
    assert list(rig.sender.unanswering) == targets[2:]
    for target in (*targets, targets[5]):
        rig.start(target=target)
        rig.now += DELAY
        rig.ack(DENIED, source=target)
    assert list(rig.sender.round_trips) == [
        *(one for one in targets[2:] if one != targets[5]), targets[5]]
    assert rig.sender.round_trips[targets[9]] == pytest.approx(DELAY)
    assert not rig.sender.unanswering
