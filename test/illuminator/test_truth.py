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
from illuminator_ros.illuminator.light import Settings
from illuminator_ros.illuminator.model import Mode
from illuminator_ros.mavlink.command_sender import MAX_SAMPLES
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import CommandAck
from illuminator_ros.payload.command_sources import SourceSettings
import pytest
from support.back_to_back import BRIDGE, Pair
from support.fake_light import FakeLight, LIGHT, status_message
from support.faulty_wire import Faults
from support.records import Answer

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
    assert faked.light.restarts == 0


class Delayed(FakeLight):
    """A light without a clock whose statuses are late."""

    delay = 0.9

    def __init__(self) -> None:
        super().__init__(stream=0.1)
        self.boot = None
        self._late: list[tuple[float, Any]] = []

    def status(self, now: float) -> Any:
        self._late.append((now, super().status(now)))
        return next(one for at, one in reversed(self._late)
                    if at <= now - self.delay or at == self._late[0][0])


def test_a_late_status_without_a_time_does_not_confirm() -> None:
    light = Delayed()
    pair = Pair(light).settle()
    for _ in range(2):
        pair.enable(True)
        pair.enable(False)
    for _ in range(6):
        light.applies = True
        pair.enable(True)
        pair.run(2.0)
        light.fields['enable'] = 0
        light.applies = False
        pair.run(0.1)
        assert not pair.enable(True).success
        pair.run(2.0)


def test_off_is_sent_until_an_acknowledgement_cannot_be_that_of_on(
    fake: FakeLight, faked: Pair,
) -> None:
    # The light acknowledges before it switches, its acknowledgement of ON is late, and OFF is
    # lost.
    fake.results[ON_OFF] = None
    assert not faked.enable(True).success
    fake.applies = False
    faked.near.wire.faults = Faults(drop=1.0)
    answer = faked.ask_enable(False)
    fake.send(CommandAck(ON_OFF, mavlink.MAV_RESULT_ACCEPTED, 0, 0, *BRIDGE))
    faked.run(0.01)
    assert not answer.results
    faked.run(4.0)
    assert not answer.result.success


def test_a_status_from_before_the_last_repeat_does_not_confirm(
    fake: FakeLight, faked: Pair,
) -> None:
    # The light executes OFF and then a late ON: its status between the two arrives after the
    # repeat.
    fake.results[ON_OFF] = None
    assert not faked.enable(True).success
    fake.stream, fake.applies = 0.0, False
    fake.answers.clear()
    answer = faked.ask_enable(False)
    faked.run(0.3)
    shows_off = fake.status(faked.now)
    fake.fields['enable'] = 1
    for _ in range(10):
        fake.send(CommandAck(ON_OFF, mavlink.MAV_RESULT_ACCEPTED, 0, 0, *BRIDGE))
        faked.run(0.05)
    fake.send(shows_off)
    assert not faked.wait_for(answer).success


@pytest.mark.parametrize('retries', [0, 2])
def test_a_command_is_acknowledged_once_more_than_the_tries_of_a_lost_one_before_it(
    fake: FakeLight, retries: int,
) -> None:
    # Each acknowledgement may belong to a late ON, which undoes the OFF before it.
    pair = Pair(fake, command_retries=retries).settle()
    fake.results[ON_OFF] = None
    assert not pair.enable(True).success
    fake.results[ON_OFF] = mavlink.MAV_RESULT_ACCEPTED
    begun = pair.now
    assert pair.enable(False).success
    assert [one.param1 for one in pair.commands(ON_OFF, since=begun)] == [0.0] * (retries + 2)


def test_a_status_that_comes_sooner_than_any_answer_does_not_confirm(fake: FakeLight) -> None:
    # A copy of an earlier ON arrives late, and is undone before the present ON arrives. The light
    # acknowledges and shows the copy after the present ON was sent and before it can arrive.
    pair = Pair(fake, there=Faults(latency=0.2)).settle()
    for on in (True, False, True, False):
        assert pair.enable(on).success
        pair.run(6.0)
    fake.applies, fake.stream = False, 0.0
    acknowledgement = CommandAck(ON_OFF, mavlink.MAV_RESULT_ACCEPTED, 0, 0, *BRIDGE)
    fake.send(acknowledgement)
    pair.run(0.5)
    fake.send(acknowledgement)
    fake.send(status_message(fake.uptime_ms(pair.now), **{**fake.fields, 'enable': 1}))
    pair.run(0.1)
    assert not pair.enable(True).success


def test_a_status_that_shows_a_cancelled_command_does_not_confirm_the_next_one(
    fake: FakeLight,
) -> None:
    pair = Pair(fake, there=Faults(latency=0.2), settings=Settings(
        sources=SourceSettings(('safety', 'default')))).settle()
    for on in (False, True) * 3:
        assert pair.enable(on).success
        pair.run(6.0)
    fake.pushes = True
    pair.ask_enable(False)
    pair.run(0.3)
    # The light has executed it, and a button switches the light on before the status arrives.
    fake.fields['enable'] = 1
    fake.pushes, fake.stream = False, 0.0
    pair.near.wire.faults = Faults(drop=1.0)
    answer = Answer(pair.now)
    pair.light.enable(False, pair.now, answer, source='safety')
    pair.turn()
    assert not pair.wait_for(answer).success


@pytest.mark.parametrize(('before', 'latency'), [(None, 0.2), (0.01, 0.2), (0.24, 0.05)])
def test_a_line_that_stays_ambiguous_confirms_changes_and_nothing_else(
    fake: FakeLight, before: float | None, latency: float,
) -> None:
    # Acknowledgements that no command waits for keep arriving. Earlier there were none, and the
    # line had another latency.
    pair = Pair(fake, there=Faults(latency=before or latency)).settle()
    fake.stream = 0.0
    if before:
        for on in (True, False) * 4:
            assert pair.enable(on).success
            pair.run(6.0)
    pair.near.wire.faults = pair.far.wire.faults = Faults(latency=latency)
    for on in (True, False) * MAX_SAMPLES:
        fake.send(CommandAck(1, mavlink.MAV_RESULT_ACCEPTED, 0, 0, *BRIDGE))
        pair.run(0.1)
        begun = pair.now
        assert pair.enable(on).success
        taken = pair.now - begun
    assert taken < 4 * latency + 0.1

    fake.applies = False
    fake.send(CommandAck(ON_OFF, mavlink.MAV_RESULT_ACCEPTED, 0, 0, *BRIDGE))
    fake.send(status_message(fake.uptime_ms(pair.now), **{**fake.fields, 'enable': 1}))
    pair.run(latency / 2)
    assert not pair.enable(True).success


def test_a_late_copy_of_a_refusal_does_not_refuse_the_next_command(
    fake: FakeLight, faked: Pair,
) -> None:
    fake.results[ON_OFF] = mavlink.MAV_RESULT_DENIED
    assert faked.enable(True).message.startswith('refused: MAV_RESULT_DENIED')
    # The first statuses contradict.
    fake.results[ON_OFF], fake.apply_after = mavlink.MAV_RESULT_ACCEPTED, 0.1
    answer = faked.ask_enable(True)
    faked.controller.receive(
        LIGHT, CommandAck(ON_OFF, mavlink.MAV_RESULT_DENIED, 0, 0, *BRIDGE), faked.now)
    result = faked.wait_for(answer)
    assert result.success
    assert result.message.startswith(
        'on, confirmed by ILLUMINATOR_STATUS: the status decides, since MAV_RESULT_DENIED may '
        'belong to an earlier command (1 try, ')


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


@pytest.mark.parametrize(('before', 'text'), [
    (False, 'on not confirmed: MAV_RESULT_DENIED, which may belong to an earlier command'),
    # Each try of the same request may be refused.
    (True, 'refused: MAV_RESULT_DENIED')])
def test_a_refusal_that_may_answer_another_request_is_reported_as_doubtful(
    fake: FakeLight, faked: Pair, before: bool, text: str,
) -> None:
    fake.results[ON_OFF] = None
    assert not faked.enable(before).success
    answer = faked.ask_enable(True)
    fake.send(CommandAck(ON_OFF, mavlink.MAV_RESULT_DENIED, 0, 0, *BRIDGE))
    result = faked.wait_for(answer)
    assert not result.success
    assert result.message.startswith(text)


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
    assert switches(events) == [(True, 'a request')]


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
