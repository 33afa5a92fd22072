# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""The configuration of a light: set, followed, streamed, overridden and restored."""

from __future__ import annotations

from dataclasses import astuple, replace
from typing import Any

from illuminator_ros.illuminator.events import ChangeCause
from illuminator_ros.illuminator.model import Configuration, float32, Mode, SafetyLimits
from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import CommandAck, result_name
from illuminator_ros.payload.requests import Result
import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight
from support.wire import Faults, START

CONFIGURE, ON_OFF = mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE, mavlink.MAV_CMD_ILLUMINATOR_ON_OFF
ACCEPTED, DENIED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED
ALL = {'mode': 'internal_control', 'brightness': 70, 'strobe_period': 1, 'strobe_duty_cycle': 10}


def sent(pair: Pair, since: float = 0.0) -> list[tuple[float, ...]]:
    """Return param1 to param4 of the configurations that were sent, tries included."""
    return [(m.param1, m.param2, m.param3, m.param4)
            for m in pair.commands(CONFIGURE, since=since)]


def confirmed(pair: Pair) -> Configuration:
    configuration = pair.snapshot.configuration
    assert configuration is not None
    return configuration


def mute() -> FakeLight:
    """Return a light that sends no status."""
    light = FakeLight(stream=0.0)
    light.answers.clear()
    return light


# Sets

def test_a_set_is_one_command_with_the_other_fields_as_confirmed(pair: Pair) -> None:
    assert pair.configure(brightness=50).success
    assert pair.configure(strobe_period=0.5).success
    assert pair.configure(mode='external_sync', brightness=10, strobe_period=2,
                          strobe_duty_cycle=30).success
    assert sent(pair) == [(1, 50, 0, 0), (1, 50, 0.5, 50), (2, 10, 2, 30)]
    assert astuple(confirmed(pair)) == (Mode.EXTERNAL_SYNC, 10.0, 2.0, 30.0)


def test_a_confirmed_set_is_one_event_before_its_answer(pair: Pair) -> None:
    answers: list[tuple[str, Any]] = []

    def done(result: Result, now: float) -> None:
        answers.append((result.message, pair.recorder.changes[-1]))

    pair.light.configure({'brightness': 50, 'strobe_duty_cycle': 5}, pair.now, done)
    pair.turn()
    pair.run(5.0)
    (message, event), = answers
    assert message.startswith('brightness 50 %, strobe_duty_cycle 5 %, confirmed by '
                              'ILLUMINATOR_STATUS: MAV_RESULT_ACCEPTED (1 try, ')
    assert event == (ChangeCause.REQUEST, {'brightness': 50.0, 'strobe_duty_cycle': 5.0})
    assert len(pair.recorder.changes) == 2


@pytest.mark.parametrize('changes', [
    {'brightness': 101}, {'brightness': float('nan')}, {'strobe_period': 11},
    {'strobe_period': 0.01}, {'mode': 'unknown'}, {'strobe_duty_cycle': True},
    {'brightness': 50, 'strobe_duty_cycle': -1}])
def test_a_set_with_a_wrong_value_fails_at_once_and_sends_nothing(
    pair: Pair, changes: dict[str, Any],
) -> None:
    answer = pair.ask_configure(**changes)
    assert answer.seconds == 0.0
    assert answer.result.permanent
    assert not answer.result.success
    assert sent(pair) == []


@pytest.mark.parametrize(('changes', 'fields', 'success', 'text', 'brightness'), [
    ({'brightness': 50}, {}, False, 'but ILLUMINATOR_STATUS shows brightness 100 % (', 100.0),
    ({'brightness': 50, 'strobe_duty_cycle': 5}, {}, False,
     'STATUS shows brightness 100 %, strobe_duty_cycle 0 % (', 100.0),
    # The light rounds to its own steps.
    ({'brightness': 50}, {'brightness': 50.4}, True, 'brightness 50 %, confirmed by', 50.4),
    ({'brightness': 80}, {'brightness': 30.0, 'error_status': 1}, True,
     'brightness 80 %, confirmed by ILLUMINATOR_STATUS, but thermal throttling: ', 80.0),
    ({'mode': 'external_sync', 'brightness': 80},
     {'mode': 2, 'brightness': 3.0, 'strobe_period': 0.2}, True,
     'accepted (ILLUMINATOR_STATUS shows brightness 3 %)', 80.0),
    # An implausible field neither shows a change nor contradicts it.
    ({'brightness': 40}, {'strobe_duty_cycle': float('nan')}, False,
     'STATUS shows brightness 100 % (', 100.0),
    ({'brightness': 40}, {'strobe_duty_cycle': float('nan'), 'brightness': 40.0}, True,
     'brightness 40 %, confirmed by', 40.0),
    # A light that does not report its mode is asked for internal control.
    ({'brightness': 40}, {'mode': 0, 'brightness': 40.0}, True, 'brightness 40 %, conf', 40.0),
], ids=['not done', 'two not done', 'rounded', 'hot', 'external sync', 'nan and not done',
        'nan and done', 'mode not reported'])
def test_the_answer_to_a_set_says_how_the_light_shows_it(
    fake: FakeLight, faked: Pair, changes: dict[str, Any], fields: dict[str, Any], success: bool,
    text: str, brightness: float,
) -> None:
    fake.applies = False
    answer = faked.ask_configure(**changes)
    fake.fields |= fields
    result = faked.wait_for(answer)
    assert (result.success, result.contradicted) == (success, not success)
    assert text in result.message
    assert faked.snapshot.discrepancy == ('' if success else result.message)
    assert confirmed(faked).brightness == brightness
    assert sent(faked)[0][0] == (2 if 'mode' in changes else 1)


def test_a_value_beyond_the_range_of_a_restarted_light_prevents_no_other_change(
    fake: FakeLight, faked: Pair,
) -> None:
    assert faked.configure(strobe_period=5.0, strobe_duty_cycle=20.0).success
    fake.restart(faked.now, max_strobe_period=2.0)
    faked.run(5.0)
    assert faked.configure(brightness=40.0).success
    assert sent(faked)[-1][:3] == (1, 40, 0)


@pytest.mark.parametrize(('reported', 'sent_period'), [(0.01, 0.05), (25.0, 2.0), (0.0, 0.0)])
def test_a_light_that_reports_the_period_of_its_sync_signal_gets_one_within_its_own_range(
    fake: FakeLight, reported: float, sent_period: float,
) -> None:
    fake.fields |= {'mode': 2, 'strobe_period': reported, 'min_strobe_period': 0.05,
                    'max_strobe_period': 2.0}
    pair = Pair(fake).settle()
    assert pair.configure(brightness=40.0).success
    assert sent(pair)[-1][:3] == pytest.approx((2, 40, sent_period))


def test_before_the_first_status_only_a_complete_set_is_sent() -> None:
    pair = Pair(mute()).settle()
    assert pair.snapshot.configuration is None
    assert pair.configure(brightness=50).message == (
        'the light has not reported its configuration yet, so mode, strobe_period, '
        'strobe_duty_cycle must be set in the same call')
    assert sent(pair) == []
    result = pair.configure(**ALL)
    assert result.success
    assert 'accepted, not confirmed' in result.message
    assert astuple(confirmed(pair)) == (Mode.INTERNAL_CONTROL, 70.0, 1.0, 10.0)


# Changes by other senders

@pytest.fixture
def strobe(fake: FakeLight) -> Pair:
    """Return a client and a light that strobes."""
    fake.fields |= {'brightness': 80.0, 'strobe_period': 1.0, 'strobe_duty_cycle': 50.0}
    return Pair(fake).settle()


@pytest.mark.parametrize(('fields', 'cause', 'change'), [
    ({'mode': 2}, ChangeCause.LIGHT, {'mode': Mode.EXTERNAL_SYNC}),
    ({'brightness': 30.0}, ChangeCause.LIGHT, {'brightness': 30.0}),
    ({'strobe_period': 0.0}, ChangeCause.LIGHT, {'strobe_period': 0.0}),
    ({'strobe_duty_cycle': 12.5}, ChangeCause.LIGHT, {'strobe_duty_cycle': 12.5}),
    ({'brightness': 81.0, 'strobe_period': 2.0}, ChangeCause.LIGHT,
     {'brightness': 81.0, 'strobe_period': 2.0}),
    ({'brightness': 80.3}, ChangeCause.ROUNDING, {'brightness': 80.3}),
    ({'strobe_period': float32(1.001)}, ChangeCause.ROUNDING, {'strobe_period': 1.001}),
    ({'error_status': 1, 'brightness': 40.0, 'strobe_period': 2.0}, ChangeCause.LIGHT,
     {'strobe_period': 2.0}),
    ({'error_status': 1, 'brightness': 40.0}, None, {}),
    ({'error_status': 2, 'brightness': 0.0}, None, {}),
    ({'mode': 0}, None, {}),
    ({'brightness': float('nan')}, None, {}),
    ({'strobe_period': -1.0}, None, {}),
])
def test_a_change_by_another_sender_is_followed_with_one_event_and_no_command(
    fake: FakeLight, strobe: Pair, fields: dict[str, Any], cause: ChangeCause | None,
    change: dict[str, Any],
) -> None:
    normal = dict(fake.fields)
    fake.fields |= fields
    strobe.run(10.0)
    if cause is None:
        # Neither the change nor its end is reported.
        fake.fields = normal
        strobe.run(10.0)
    assert strobe.recorder.changes[1:] == ([(cause, change)] if cause else [])
    assert sent(strobe) == []
    assert confirmed(strobe) == replace(confirmed(strobe), **change)


def test_under_external_sync_only_the_mode_is_followed(fake: FakeLight, strobe: Pair) -> None:
    before = confirmed(strobe)
    fake.fields |= {'mode': 2, 'brightness': 10.0, 'strobe_period': 0.0}
    strobe.run(2.0)
    fake.fields |= {'brightness': 90.0, 'strobe_duty_cycle': 0.0}
    strobe.run(2.0)
    assert strobe.recorder.changes[1:] == [(ChangeCause.LIGHT, {'mode': Mode.EXTERNAL_SYNC})]
    assert confirmed(strobe) == replace(before, mode=Mode.EXTERNAL_SYNC)

    fake.fields['mode'] = 1
    strobe.run(2.0)
    assert confirmed(strobe) == replace(
        before, brightness=90.0, strobe_period=0.0, strobe_duty_cycle=0.0)


@pytest.mark.parametrize(('during', 'change', 'cause'), [
    (False, {'brightness': 30.0}, ChangeCause.LATE_EFFECT),
    (True, {'strobe_period': 2.0}, ChangeCause.LIGHT)],
    ids=['ours that takes effect late', 'by another sender meanwhile'])
def test_a_change_by_a_failed_command_or_during_it_is_followed_after_it(
    fake: FakeLight, strobe: Pair, during: bool, change: dict[str, Any], cause: ChangeCause,
) -> None:
    fake.results[CONFIGURE] = None
    answer = strobe.ask_configure(brightness=30)
    if during:
        fake.fields |= change
    assert not strobe.wait_for(answer).success
    fake.fields |= change
    strobe.run(2.0)
    assert strobe.recorder.changes[1:] == [(cause, change)]


def test_a_discrepancy_ends_when_another_sender_changes_the_light(
    fake: FakeLight, strobe: Pair,
) -> None:
    fake.applies = False
    assert strobe.configure(brightness=30).contradicted
    strobe.run(10.0)
    assert 'shows brightness 80 %' in strobe.snapshot.discrepancy
    # Heat is not another sender.
    fake.fields |= {'brightness': 60.0, 'error_status': 1}
    strobe.run(2.0)
    assert strobe.snapshot.discrepancy
    fake.fields |= {'brightness': 40.0, 'error_status': 0}
    strobe.run(2.0)
    assert strobe.snapshot.discrepancy == ''


# Streams of setpoints

def publish(pair: Pair, *values: float, rate: float = 0.0) -> None:
    for value in values:
        pair.light.set_brightness(value, pair.now)
        pair.turn()
        if rate:
            pair.run(1 / rate)


def most_in_flight(pair: Pair) -> int:
    """Return how many configurations were unanswered at most."""
    events = [(at, 1) for at, _ in pair.commands_at(CONFIGURE)]
    events += [(at, -1) for at, _, message in pair.near.received
               if isinstance(message, CommandAck) and message.command == CONFIGURE]
    most = level = 0
    # At equal times an acknowledgement sorts before the next command, which waits for it.
    for _, step in sorted(events):
        level += step
        most = max(most, level)
    return most


@pytest.mark.parametrize('rate', [1, 10, 100, 1000, 10_000])
@pytest.mark.parametrize('latency', [0.0005, 0.01, 0.1])
def test_one_command_is_in_flight_at_any_rate_and_the_newest_setpoint_wins(
    rate: float, latency: float,
) -> None:
    values = [float(1 + i % 97) for i in range(200)]
    pair = Pair(there=Faults(latency=latency)).settle()
    at = pair.now
    publish(pair, *values, rate=rate)
    # The stream is as fast as the line.
    assert len(sent(pair)) >= min(200, 0.9 * (pair.now - at) / (2 * latency) - 1)
    pair.run(1.0)
    assert most_in_flight(pair) == 1
    assert pair.lamp.configuration.brightness == values[-1]
    assert pair.recorder.failed_setpoints == []


@pytest.mark.parametrize(('values', 'light', 'then', 'last'), [
    # The light takes 30 and cannot report it: it may be at 30 or at 100.
    ([30.0], {'results': {CONFIGURE: None}, 'stream': 0.0, 'answers': set(),
              'fields': {'brightness': 30.0}}, ACCEPTED, 100.0),
    # The light has accepted 40 and shows 100.
    ([40.0], {'applies': False}, ACCEPTED, 40.0),
], ids=['not acknowledged', 'not done'])
def test_a_setpoint_is_sent_again_where_the_light_may_have_another_value(
    fake: FakeLight, faked: Pair, values: list[float], light: dict[str, Any], then: Any,
    last: float,
) -> None:
    fake.results |= light.get('results', {})
    fake.applies = light.get('applies', True)
    publish(faked, *values)
    fake.fields |= light.get('fields', {})
    fake.stream, fake.answers = light.get('stream', 1.0), light.get('answers', fake.answers)
    faked.run(1.5)
    fake.applies = True
    fake.results[CONFIGURE] = then
    publish(faked, last)
    faked.run(1.0)
    assert fake.fields['brightness'] == last


# Overrides

def overriding(fake: FakeLight, settings: LightSettings | None = None, **values: Any) -> Pair:
    """Return a pair whose light must be configured as soon as it is found."""
    return Pair(fake, settings=settings,
                on_light=lambda light: light.require(values, START))


def successes(pair: Pair) -> list[bool]:
    return [success for success, _ in pair.recorder.restorations]


@pytest.mark.parametrize(('values', 'commands', 'success', 'text'), [
    ({'brightness': 30.0, 'strobe_period': 2.0}, [(1, 30, 2, 7)], [True], ''),
    ({'brightness': 30.0, 'strobe_period': 20.0}, [(1, 30, 0, 7)], [False, True],
     'strobe_period 20 s is outside the range that the light reports'),
    ({'strobe_period': 20.0}, [], [False], 'strobe_period 20 s is outside'),
])
def test_overrides_within_the_limits_are_sent_as_one_command(
    fake: FakeLight, values: dict[str, Any], commands: list[Any], success: list[bool], text: str,
) -> None:
    fake.fields['strobe_duty_cycle'] = 7.0
    pair = overriding(fake, **values).settle(30.0)
    assert sent(pair) == commands
    assert successes(pair) == success
    assert text in pair.recorder.restorations[0][1]
    fake.fields['brightness'] = 5.0
    pair.run(2.0)
    assert confirmed(pair).brightness == 5.0


@pytest.mark.parametrize('result',
                         [DENIED, mavlink.MAV_RESULT_UNSUPPORTED,
                          mavlink.MAV_RESULT_COMMAND_LONG_ONLY])
def test_overrides_that_are_refused_are_reported_once_and_not_sent_again(
    fake: FakeLight, result: int,
) -> None:
    fake.results[CONFIGURE] = result
    pair = overriding(fake, brightness=30.0).settle(60.0)
    assert len(sent(pair)) == 1
    (success, message), = pair.recorder.restorations
    assert not success
    assert result_name(result) in message
    assert result_name(result) in pair.snapshot.discrepancy
    fake.results.clear()
    assert pair.configure(brightness=40).success
    assert pair.snapshot.discrepancy == ''


@pytest.mark.parametrize('result', [
    None, mavlink.MAV_RESULT_TEMPORARILY_REJECTED, mavlink.MAV_RESULT_IN_PROGRESS,
    mavlink.MAV_RESULT_FAILED])
def test_overrides_that_fail_otherwise_are_sent_until_they_succeed(
    fake: FakeLight, result: int | None,
) -> None:
    fake.results[CONFIGURE] = result
    pair = overriding(fake, brightness=30.0).settle(20.0)
    # A warning, once.
    assert successes(pair) == [False]
    assert pair.recorder.restorations[0][1].endswith('; it will be sent again')
    assert pair.snapshot.discrepancy
    fake.results[CONFIGURE] = ACCEPTED
    pair.run(20.0)
    assert successes(pair) == [False, True]
    assert pair.snapshot.discrepancy == ''


@pytest.mark.parametrize('latency', [0.3, 0.4, 1.0, 1.5])
def test_overrides_and_a_restored_configuration_reach_a_light_that_answers_too_late(
    fake: FakeLight, latency: float,
) -> None:
    pair = Pair(fake, there=Faults(latency=latency),
                on_light=lambda light: light.require({'brightness': 30.0}, START))
    for _ in range(2):
        at = pair.now
        fake.restart(at)
        pair.run(20.0)
        assert fake.fields['brightness'] == 30.0
        assert successes(pair)[-1] is True
        assert pair.snapshot.discrepancy == ''
        count = len(sent(pair, since=at))
        pair.run(20.0)
        assert len(sent(pair, since=at)) == count
    # Another sender is followed, and not undone.
    fake.fields['brightness'] = 5.0
    pair.run(10.0)
    assert (confirmed(pair).brightness, fake.fields['brightness']) == (5.0, 5.0)


def test_overrides_that_a_light_accepts_and_does_not_show_are_sent_at_growing_intervals(
    fake: FakeLight,
) -> None:
    # A light that clamps: it takes 100 % and shows 80 %.
    fake.applies = False
    fake.fields['brightness'] = 80.0
    pair = overriding(fake, brightness=100.0).settle(600.0)
    times = [at for at, message in pair.commands_at(CONFIGURE) if not message.confirmation]
    waits = [after - before for before, after in zip(times, times[1:], strict=False)]
    # Each try ends 1 s after its acknowledgement.
    assert [round(wait) for wait in waits[:6]] == [3, 5, 9, 17, 33, 61]
    assert max(waits) < 62.0
    (success, message), = pair.recorder.restorations
    assert not success
    assert 'shows brightness 80 %' in message
    assert 'shows brightness 80 %' in pair.snapshot.discrepancy
    assert confirmed(pair).brightness == 80.0


def test_overrides_that_wait_for_a_status_are_reported_once(fake: FakeLight) -> None:
    fake.fields['strobe_duty_cycle'] = float('nan')
    pair = overriding(fake, brightness=60.0).settle(30.0)
    (success, message), = pair.recorder.restorations
    assert not success
    assert message.startswith('brightness not sent: the light has not reported its configuration')
    assert message.startswith(pair.snapshot.discrepancy)
    fake.fields['strobe_duty_cycle'] = 0.0
    pair.run(3.0)
    assert fake.fields['brightness'] == 60.0


@pytest.mark.parametrize('period', [0.9, 1.0, 1.2, 1.4])
@pytest.mark.parametrize('values', [(80.0, 80.0), (80.0, 40.0)], ids=['equal', 'in turns'])
def test_lost_answers_to_one_set_fail_no_later_one(
    fake: FakeLight, values: tuple[float, float], period: float,
) -> None:
    fake.stream = 0.2
    pair = Pair(fake).settle()
    pair.far.wire.switch(is_open=False)
    lost = pair.ask_configure(brightness=80.0)
    pair.run(0.86)
    pair.far.wire.switch(is_open=True)
    pair.run(period - 0.86)

    answers = []
    for value in reversed(values * 5):
        answers.append(pair.ask_configure(brightness=value))
        pair.run(period)

    assert lost.result is not None
    assert not lost.result.success
    assert [one.result.success for one in answers if one.result is not None] == [True] * 10


# Restarts

@pytest.fixture
def agreed(fake: FakeLight) -> Pair:
    """Return a client and a light that has accepted overrides and a set since."""
    pair = overriding(fake, brightness=30.0).settle()
    assert pair.configure(strobe_period=2, strobe_duty_cycle=40).success
    pair.enable(True)
    return pair


def test_after_a_restart_the_configuration_is_sent_and_the_light_stays_off(
    fake: FakeLight, agreed: Pair,
) -> None:
    at = agreed.now
    fake.restart(at)
    agreed.run(60.0)
    assert sent(agreed, since=at) == [(1, 30, 2, 40)]
    assert successes(agreed) == [True, True]
    assert agreed.commands(ON_OFF, since=at) == []
    assert fake.fields['enable'] == 0
    fake.fields['brightness'] = 66.0
    agreed.run(2.0)
    assert agreed.recorder.changes[-1] == (ChangeCause.LIGHT, {'brightness': 66.0})


@pytest.mark.parametrize('restores', [True, False])
def test_a_set_under_way_at_a_restart_brings_other_fields_back_only_with_a_restored_configuration(
    fake: FakeLight, restores: bool,
) -> None:
    pair = Pair(fake, settings=LightSettings(restore_configuration=restores)).settle()
    assert pair.configure(strobe_period=2, strobe_duty_cycle=40).success
    fake.results[CONFIGURE] = [None, ACCEPTED]
    at = pair.now
    answer = pair.ask_configure(brightness=60.0)
    pair.run(0.1)

    fake.restart(pair.now, brightness=20.0)
    pair.run(5.0)

    # The first was sent before the restart.
    assert {one[2:] for one in sent(pair, since=at)[1:]} == {(2, 40) if restores else (0, 0)}
    assert len(answer.results) == 1
    assert fake.fields['brightness'] == 60.0


def test_after_a_restart_a_light_that_kept_its_configuration_is_sent_nothing(
    fake: FakeLight, agreed: Pair,
) -> None:
    at, kept = agreed.now, dict(fake.fields)
    fake.restart(agreed.now, **kept)
    agreed.run(10.0)
    assert sent(agreed, since=at) == []


@pytest.mark.parametrize('brightness', [20.0, 30.0], ids=['less', 'equal by chance'])
def test_after_a_restart_a_light_that_is_dimmed_by_heat_is_sent_its_configuration(
    fake: FakeLight, agreed: Pair, brightness: float,
) -> None:
    at, kept = agreed.now, dict(fake.fields)
    fake.restart(at, **{**kept, 'brightness': brightness, 'error_status': 1})
    agreed.run(10.0)
    assert sent(agreed, since=at) == [(1, 30, 2, 40)]


def test_values_within_the_limits_that_a_restart_makes_obsolete_leave_no_discrepancy(
    fake: FakeLight,
) -> None:
    pair = Pair(fake, settings=LightSettings(
        restore_configuration=False, limits=SafetyLimits(max_brightness=50.0)))
    fake.results[CONFIGURE] = None
    pair.run(5.0)
    assert 'no acknowledgement' in pair.snapshot.discrepancy
    fake.restart(pair.now, brightness=20.0)
    pair.run(2.0)
    assert pair.snapshot.discrepancy == ''
