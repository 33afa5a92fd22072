# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A command is a success if a status that was sent after it shows the change, else a failure."""

from __future__ import annotations

import math
from typing import Any

from illuminator_ros.mavlink.command_sender import CommandStatus
from illuminator_ros.mavlink.durations import timing
from illuminator_ros.payload.attempt import (
    Attempt,
    Change,
    FENCE,
    Fence,
    Proof,
    Sending,
    Served,
)
from illuminator_ros.payload.requests import Goal, Request, Result, Why
import pytest
from support.level_device import (
    ACCEPTED,
    DENIED,
    FAILED,
    IN_PROGRESS,
    level_change,
    LevelBench,
    REJECTED,
    SET_LEVEL,
)

LEVEL_5 = level_change(5)


class CommandBench(LevelBench):
    """One command for level 5 at the time 0."""

    def begin(self, change: Change[int | None] = LEVEL_5, *, gap: float | None = 0.5,
              target: dict[str, Any] | None = None, **arguments: Any) -> CommandBench:
        """Send the command; return this bench."""
        self.result: Result | None = None
        self.ended_at = math.nan
        fence = Fence(arguments.pop('fence', -math.inf),
                      proof=arguments.pop('proof', Proof.NOTHING))
        request = Request({'level': 5}, Why.REQUEST, self.now, is_call=True)
        goal = Goal(5, (request,), self.now + arguments.pop('limit', math.inf), is_awaited=True,
                    **arguments)
        self.command: Attempt[int | None] = Attempt(
            self.target(**target or {}), change, goal, {request: change}, self.now, fence=fence,
            gap=gap)
        self.gap = gap
        return self

    def _take(self, ended: list[Served[int | None]]) -> None:
        if ended and self.result is None:
            self.result, self.ended_at = ended[0].result, round(self.now, 3)
            self.command.withdraw(self.now)

    def reported(self, level: int | None) -> None:
        if self.result is None:
            self._take(self.command.reported(level, self.gap or 0.0, self.now))

    def act(self) -> None:
        if self.now >= self.act_due:
            self._take(self.command.poll(self.now))

    @property
    def act_due(self) -> float:
        return math.inf if self.result else self.command.due

    @property
    def ended(self) -> Result:
        """Return the result of a command that has ended."""
        assert self.result is not None
        return self.result


ONCE, SILENT, FENCED = [0.0], [0.0, 0.25, 0.75, 1.75], [0.0, 0.25, 0.5, 0.6]
REFUSED, PERMANENT, CONTRADICTED = ('refused',), ('refused', 'permanent'), ('contradicted',)
SHOWN, LEVEL_0 = 'level 5, confirmed by STATUS: MAV_RESULT_ACCEPTED', 'STATUS shows level 0'
NOT_ACKNOWLEDGED = 'level 5, confirmed by STATUS, without an acknowledgement'
INSTEAD = f'level 5 not confirmed: MAV_RESULT_ACCEPTED, but {LEVEL_0}'
NO_STATUS = 'level 5 not confirmed: MAV_RESULT_ACCEPTED, but no STATUS came within 1.00 s'
SENDS_NONE = ('level 5, accepted, not confirmed (the device sends no STATUS): '
              'MAV_RESULT_ACCEPTED')
ACCEPTS = 'level 5, accepted: MAV_RESULT_ACCEPTED'
NO_ANSWER, DENIES = 'no acknowledgement', 'refused: MAV_RESULT_DENIED'
IN_PROGRESS_STOPPED = ('no final acknowledgement, last answer MAV_RESULT_IN_PROGRESS at 0 %, and '
                       'STATUS shows level 0')
HIDES: dict[str, Any] = {'level': None, 'executes': []}
OBEYS: dict[str, Any] = {'results': [None], 'executes': [None]}
MUTE: dict[str, Any] = {'sends_status': False}
SINGLE, REPEATED = ({'change': level_change(5, sending=Sending.ONCE)},
                    {'change': level_change(5, sending=Sending.UNTIL_OBEYED)})


# The device and the command -> success, message, when it was sent and ended, flags of the result.
@pytest.mark.parametrize(('device', 'command', 'success', 'text', 'tries', 'ended_at', 'flags'), [
    # A status shows the change.
    ({}, {}, True, SHOWN, ONCE, 0.02, ()),
    ({'level': 5, 'results': [DENIED]}, {}, True,
     'level 5, confirmed by STATUS: MAV_RESULT_DENIED', ONCE, 0.02, ()),
    ({'results': [None, ACCEPTED]}, {}, True, SHOWN, SILENT[:2], 0.27, ()),
    ({'results': [REJECTED, ACCEPTED]}, {}, True, SHOWN, [0.0, 0.12], 0.14, ()),
    ({'results': [IN_PROGRESS], 'executes': [IN_PROGRESS]}, {}, True,
     'level 5, confirmed by STATUS: MAV_RESULT_IN_PROGRESS', ONCE, 0.02, ()),
    # Without an acknowledgement a status counts after the last try.
    (OBEYS, {}, True, NOT_ACKNOWLEDGED, SILENT, 1.77, ()),
    (OBEYS, {'limit': 0.9}, True, NOT_ACKNOWLEDGED, SILENT[:3], 0.77, ()),
    # It shows something else.
    ({'executes': []}, {}, False, INSTEAD, ONCE, 1.02, CONTRADICTED),
    ({'executes': []}, {'limit': 0.9}, False, INSTEAD, ONCE, 0.9, CONTRADICTED),
    ({'executes': []}, REPEATED, False, INSTEAD, [0.0, 0.25, 0.5, 0.75, 1.0], 1.02, CONTRADICTED),
    ({'results': [None]}, REPEATED, False, f'{NO_ANSWER}, and {LEVEL_0}', SILENT, 2.75, ()),
    ({'results': [IN_PROGRESS]}, REPEATED, False, IN_PROGRESS_STOPPED, ONCE, 3.02, ()),
    ({'results': [DENIED]}, {}, False, DENIES, ONCE, 0.02, PERMANENT),
    ({'results': [FAILED]}, {}, False, 'refused: MAV_RESULT_FAILED', ONCE, 0.02, REFUSED),
    ({'results': [None]}, {}, False, f'{NO_ANSWER}, and {LEVEL_0}', SILENT, 2.75, ()),
    ({'results': [IN_PROGRESS]}, {}, False, IN_PROGRESS_STOPPED, ONCE, 3.02, ()),
    # It cannot show the change.
    (HIDES, {}, True, ACCEPTS, ONCE, 0.02, ()),
    ({**HIDES, 'results': [DENIED]}, {}, False, DENIES, ONCE, 0.02, PERMANENT),
    ({**HIDES, 'results': [None]}, {}, False, NO_ANSWER, SILENT, 2.75, ()),
    # No status comes.
    (MUTE, {}, False, NO_STATUS, ONCE, 1.02, ()),
    (MUTE, {'gap': 9.3}, False, 'level 5 not confirmed: MAV_RESULT_ACCEPTED; its next status is '
     'due within 10 s', ONCE, 1.02, ()),
    ({**MUTE, 'results': [FAILED]}, {}, False, 'refused: MAV_RESULT_FAILED', ONCE, 1.02, REFUSED),
    ({**MUTE, 'results': [None]}, {}, False, NO_ANSWER, SILENT, 2.75, ()),
    # None has ever come.
    (MUTE, {'gap': None}, True, SENDS_NONE, ONCE, 1.02, ()),
    (MUTE, {'gap': None, 'target': {'needs_status': True}}, False, NO_STATUS, ONCE, 1.02, ()),
    ({**MUTE, 'results': [DENIED]}, {'gap': None}, False, DENIES, ONCE, 0.02, PERMANENT),
    # The device has none.
    ({}, {'target': {'status_id': None}}, True, 'MAV_RESULT_ACCEPTED', ONCE, 0.02, ()),
    ({'results': [DENIED]}, {'target': {'status_id': None}}, False, DENIES, ONCE, 0.02, PERMANENT),
    # A command that is not idempotent is sent once.
    ({'results': [None]}, SINGLE, False, f'{NO_ANSWER}, and {LEVEL_0}', ONCE, 1.0, ()),
    (OBEYS, SINGLE, True, NOT_ACKNOWLEDGED, ONCE, 0.02, ()),
    ({}, {'fence': FENCE, **SINGLE}, True, SHOWN, ONCE, 1.52, ()),
    ({'executes': []}, {'fence': FENCE, **SINGLE}, False, 'not finished in time, last answer '
     f'MAV_RESULT_ACCEPTED, and {LEVEL_0}', ONCE, 2.5, ()),
    # Within the fence nothing counts; the command is repeated, and once more after it.
    ({}, {'fence': FENCE}, True, SHOWN, [0.25 * number for number in range(7)], 1.52, ()),
    ({'results': [*[DENIED] * 3, ACCEPTED]}, {'fence': 0.6}, True, SHOWN, FENCED, 0.62, ()),
    ({'results': [*[ACCEPTED] * 3, DENIED], 'executes': []}, {'fence': 0.6}, False, DENIES,
     FENCED, 0.62, PERMANENT),
    ({'results': [None]}, {'fence': 0.6}, False, f'{NO_ANSWER}, and {LEVEL_0}',
     [*FENCED, 0.85, 1.35, 2.35], 3.35, ()),
    (MUTE, {'fence': 0.6, 'gap': None}, True, SENDS_NONE, FENCED, 1.62, ()),
    ({}, {'fence': FENCE, 'limit': 0.9}, False,
     'level 5 not confirmed: an earlier command may still be under way', [0.0, 0.25, 0.5, 0.75],
     0.9, ()),
    # But a status that only this command can have caused counts.
    ({}, {'fence': FENCE, 'proof': Proof.STATUS}, True, SHOWN, ONCE, 0.02, ()),
    ({'results': [DENIED]}, {'fence': 0.6, 'proof': Proof.STATUS}, False, DENIES, FENCED, 0.62,
     PERMANENT),
    (HIDES, {'fence': 0.6, 'proof': Proof.STATUS}, True, ACCEPTS, FENCED, 0.62, ()),
    (OBEYS, {'proof': Proof.STATUS}, True, NOT_ACKNOWLEDGED, SILENT, 1.77, ()),
    # At the end of the process a status counts after three tries, also within the fence.
    ({}, {'fence': FENCE, 'is_final': True, 'insists': True}, True, SHOWN, [0.0, 0.1, 0.2], 0.22,
     ()),
    ({}, {'is_final': True, 'insists': True}, True, SHOWN, ONCE, 0.02, ()),
    # A command that insists does without an acknowledgement after three tries, and is also sent
    # again while the device reports progress.
    ({'results': [IN_PROGRESS, ACCEPTED]}, {'insists': True}, True, SHOWN, [0.0, 0.25], 0.27, ()),
    (OBEYS, {'insists': True}, True, NOT_ACKNOWLEDGED, [0.0, 0.25, 0.5], 0.52, ()),
    ({**HIDES, 'results': [DENIED, DENIED, ACCEPTED]}, {'insists': True}, True, ACCEPTS,
     [0.0, 0.25, 0.5], 0.52, ())])
def test_the_result_says_what_the_statuses_show_and_the_acknowledgement_explains_it(
    device: dict[str, Any], command: dict[str, Any], success: bool, text: str,
    tries: list[float], ended_at: float, flags: tuple[str, ...],
) -> None:
    bench = CommandBench(**device).begin(**command)
    bench.run_until()
    assert (bench.ended.success, bench.tries, bench.ended_at) == (success, tries, ended_at)
    assert bench.ended.message == f'{text} ({timing(len(tries), ended_at)})'
    assert tuple(flag for flag in ('refused', 'permanent', 'contradicted')
                 if getattr(bench.ended, flag)) == flags


@pytest.mark.parametrize('fence', [-math.inf, FENCE])
def test_a_status_before_an_acknowledgement_the_last_try_or_the_fence_does_not_confirm(
    fence: float,
) -> None:
    bench = CommandBench(0, None, sends_status=False).begin(fence=fence)
    for at in (0.005, 0.3, 1.2):
        bench.later(at, lambda: bench.reported(5))
    bench.run_until()
    assert not bench.ended.success


def test_a_status_that_is_read_before_the_try_at_the_end_of_the_fence_does_not_confirm() -> None:
    bench = CommandBench(sends_status=False).begin(fence=FENCE)
    bench.run_until(FENCE - 0.05)
    bench.now = FENCE + 0.001
    bench.reported(5)

    assert bench.result is None


def test_a_device_that_sends_its_first_status_during_a_command_is_judged_by_it() -> None:
    bench = CommandBench(executes=[], sends_status=False).begin(gap=None)
    bench.gap = 0.0
    bench.later(0.5, lambda: bench.reported(0))
    bench.run_until()
    assert (bench.ended.success, bench.ended.contradicted) == (False, True)


def test_each_try_carries_a_request_for_the_status_which_is_repeated_until_it_shows_the_change(
) -> None:
    bench = CommandBench(0, None, ACCEPTED, executes=[]).begin(
        level_change(5, note='the fan runs too'))
    bench.later(1.0, lambda: setattr(bench, 'level', 5))
    bench.run_until()
    assert bench.requests == [0.0, 0.25, 0.32, 0.42, 0.62, 0.87, 1.12]
    assert [message.confirmation for _, message in bench.sent
            if message.command == SET_LEVEL] == [0, 1]
    assert (bench.ended.success, bench.ended_at) == (True, 1.14)
    assert bench.ended.note == 'the fan runs too'


# Insistence

@pytest.mark.parametrize(('result', 'failure', 'ended_at'), [
    (DENIED, DENIES, 20.14), (ACCEPTED, INSTEAD, 20.14), (None, '', 20.52)])
def test_a_command_that_insists_is_sent_until_a_status_shows_the_change(
    result: int | None, failure: str, ended_at: float,
) -> None:
    bench = CommandBench(0, result, executes=[]).begin(insists=True)
    bench.run_until(20.0)
    assert bench.result is None
    assert bench.tries == [*(0.25 * number for number in range(11)),
                           *(2.5 + 2.0 * number for number in range(1, 9))]
    assert bench.command.failure() == failure
    bench.level = 5
    bench.run_until()
    # Each acknowledgement is followed by requests for the status.
    assert (bench.ended.success, bench.ended_at) == (True, ended_at)


@pytest.mark.parametrize('insists', [False, True])
@pytest.mark.parametrize(('status', 'text'), [
    (CommandStatus.LINK_LOST, 'the link was lost (1 try, 100 ms)'),
    (CommandStatus.CLOSED, 'closed')])
def test_a_lost_link_and_the_end_of_the_process_end_every_command(
    insists: bool, status: CommandStatus, text: str,
) -> None:
    bench = CommandBench(0, None).begin(insists=insists)
    bench.run_until(0.1)
    bench.commands.end_all(bench.now, status)
    bench.run_until()
    assert (bench.ended.success, bench.ended.message) == (False, text)
    assert bench.ended.superseded is (status is CommandStatus.CLOSED)


# Restarts

@pytest.mark.parametrize(('device', 'change', 'text', 'tries', 'ended_at'), [
    ({}, level_change(5), SHOWN, 8, 1.62),
    ({'results': [ACCEPTED, None], 'executes': []}, level_change(5),
     f'{NO_ANSWER}, and {LEVEL_0}', 11, 4.35),
    ({'executes': []}, SINGLE['change'], INSTEAD, 1, 1.02)])
def test_a_restart_confirms_nothing_and_a_command_that_may_be_repeated_is_sent_again(
    device: dict[str, Any], change: Change[int | None], text: str, tries: int, ended_at: float,
) -> None:
    bench = CommandBench(**device, sends_status=False).begin(change, proof=Proof.STATUS)
    bench.run_until(0.1)
    bench.level, bench.sends_status = 0, True
    bench.command.restarted(0, bench.now)
    if change.sending is not Sending.ONCE:
        bench.later(0.0, lambda: bench.reported(5))
    bench.run_until()
    assert bench.ended.message == (
        f'{text}; the device restarted meanwhile ({timing(tries, ended_at)})')
    assert bench.tries[1:3] == [0.1, 0.35][:tries - 1]


def test_each_request_ends_at_its_own_time_though_another_waits_longer() -> None:
    bench = CommandBench()
    first, second = (Request({'level': 5}, Why.REQUEST, 0.0, is_call=True, deadline=until)
                     for until in (2.0, 3.0))
    attempt: Attempt[int | None] = Attempt(
        bench.target(), LEVEL_5, Goal(5, (first, second), 3.0), {first: LEVEL_5, second: LEVEL_5},
        0.0, gap=0.5)
    assert attempt.due <= 2.0
    assert [one.request for one in attempt.poll(2.0)] == [first]
