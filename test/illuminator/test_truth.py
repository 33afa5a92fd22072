# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Answers and events are true: late frames, lost commands, double restarts."""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import Any

from illuminator_ros.illuminator.events import (
    ChangeCause,
    LightEvent,
    LightSwitched,
    StatusReceived,
)
from illuminator_ros.illuminator.model import Mode
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.payload.attempt import FENCE
import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight

ON_OFF, CONFIGURE = mavlink.MAV_CMD_ILLUMINATOR_ON_OFF, mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE


def events_of(pair: Pair) -> list[LightEvent]:
    """Return the list that further events are added to."""
    events: list[LightEvent] = []
    pair.controller.events.subscribe(events.append)
    return events


def switches(events: list[LightEvent]) -> list[tuple[bool, str]]:
    return [(one.on, one.origin) for one in events if isinstance(one, LightSwitched)]


# Late frames

@pytest.mark.parametrize('late', [2.0, 6.0, 20.0])
def test_a_status_that_comes_late_neither_confirms_nor_restarts(
    fake: FakeLight, faked: Pair, late: float,
) -> None:
    assert faked.enable(True).success
    old = fake.status(faked.now)
    assert faked.enable(False).success
    faked.run(late)
    fake.applies = False
    fake.stream = 0.0
    fake.answers.clear()
    answer = faked.ask_enable(True)
    faked.run(0.1)
    fake.send(old)
    assert not faked.wait_for(answer).success
    assert faked.light.twin.order.restarts == 0


@pytest.mark.parametrize('fields', [
    {'mode': Mode.EXTERNAL_SYNC},
    {'error_status': mavlink.ILLUMINATOR_ERROR_FLAGS_THERMAL_THROTTLING},
    {'brightness': math.nan}], ids=['follows another signal', 'is hot', 'reports no brightness'])
def test_each_refusal_counts_where_the_status_cannot_show_the_change(
    fake: FakeLight, faked: Pair, fields: dict[str, float],
) -> None:
    fake.fields |= {'brightness': 30.0, **fields}
    faked.run(2.0)
    fake.results[CONFIGURE] = mavlink.MAV_RESULT_DENIED
    for _ in range(2):
        result = faked.configure(brightness=50.0)
        assert not result.success
        assert result.message.startswith('refused: MAV_RESULT_DENIED')
        faked.run(FENCE)
    fake.results[CONFIGURE] = mavlink.MAV_RESULT_ACCEPTED
    faked.run(10.0)
    fake.applies = False
    assert faked.configure(brightness=50.0).success


def test_a_value_that_the_status_lacks_is_not_called_confirmed(
    fake: FakeLight, faked: Pair,
) -> None:
    fake.applies = False
    fake.fields['brightness'] = math.nan
    assert faked.configure(brightness=50.0).message.startswith(
        'brightness 50 %, accepted (ILLUMINATOR_STATUS shows no valid brightness): '
        'MAV_RESULT_ACCEPTED')


# Events

def test_each_switch_is_one_event_with_its_origin(fake: FakeLight, faked: Pair) -> None:
    events = events_of(faked)
    faked.light.enable(True, faked.now, lambda result, now: None, detail='service')
    faked.run(40.0)
    fake.fields['enable'] = 0
    faked.run(3.0)
    assert switches(events) == [
        (True, 'service'), (False, 'another sender')]


@pytest.mark.parametrize('before', [
    lambda pair: pair.configure(brightness=30.0),
    lambda pair: (pair.enable(True), pair.enable(False))],
    ids=['dimmed', 'switched on and off'])
def test_a_button_pressed_soon_after_a_command_of_ours_is_another_sender(
    fake: FakeLight, faked: Pair, before: Callable[[Pair], Any],
) -> None:
    before(faked)
    events = events_of(faked)
    fake.fields['enable'] = 1
    faked.run(1.5)
    assert switches(events) == [(True, 'another sender')]


def test_a_switch_that_takes_effect_late_is_ours(fake: FakeLight, faked: Pair) -> None:
    fake.apply_after = 4.0
    events = events_of(faked)
    assert not faked.enable(True).success
    faked.run(6.0)
    assert switches(events) == [(True, 'a late effect of our request')]


def test_a_switch_that_was_shown_before_its_request_failed_is_ours(
    fake: FakeLight, faked: Pair,
) -> None:
    fake.results[ON_OFF] = None
    events = events_of(faked)
    answer = faked.ask_enable(True)
    fake.fields['enable'] = 1
    faked.run(1.1)
    faked.close()
    assert not answer.result.success
    assert switches(events) == [(True, 'a late effect of our request')]


@pytest.mark.parametrize('change', [
    lambda pair: pair.configure(mode='external_sync'), lambda pair: pair.enable(True)],
    ids=['configure', 'enable'])
def test_a_field_that_a_command_of_ours_implies_is_ours(
    fake: FakeLight, faked: Pair, change: Callable[[Pair], Any],
) -> None:
    assert change(faked).success
    fake.fields['brightness'] = 70.0
    faked.run(1.5)
    assert ChangeCause.LIGHT not in [cause for cause, _ in faked.recorder.changes]


def test_a_strobe_period_alone_also_sets_a_duty_cycle_that_is_0(
    fake: FakeLight, faked: Pair,
) -> None:
    result = faked.configure(strobe_period=1.0)
    assert result.success
    assert (fake.fields['strobe_period'], fake.fields['strobe_duty_cycle']) == (1.0, 50.0)
    assert 'strobe_duty_cycle 50 %' in result.message
    assert result.note.startswith('strobe_duty_cycle was 0 %')
    assert faked.configure(strobe_duty_cycle=20.0).success
    assert not faked.configure(strobe_period=2.0).note
    assert fake.fields['strobe_duty_cycle'] == 20.0


def test_a_listener_that_raises_does_not_stop_the_others(
    faked: Pair, caplog: pytest.LogCaptureFixture,
) -> None:
    def fail(event: LightEvent) -> None:
        raise RuntimeError('as the test says')

    faked.controller.events.subscribe(fail)
    events = events_of(faked)
    assert faked.enable(True).success
    assert switches(events) == [(True, 'a request')]
    assert 'A listener failed on LightSwitched' in caplog.text
    assert 'as the test says' in caplog.text


def test_a_request_is_answered_before_its_status_is_published(faked: Pair) -> None:
    order: list[str] = []

    def note(event: LightEvent) -> None:
        if isinstance(event, StatusReceived) and event.status.enabled:
            order.append('status')

    faked.controller.events.subscribe(note)
    faked.light.enable(True, faked.now, lambda result, now: order.append('answer'))
    faked.run(1.0)
    assert order[:2] == ['answer', 'status']
