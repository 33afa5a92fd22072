# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Lights and lines that people have reported: odd clocks, second paths, slow radios, restarts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from illuminator_ros.illuminator.events import ChangeCause, LightSwitched, StatesChanging
from illuminator_ros.illuminator.messages import STATUS_ID
from illuminator_ros.illuminator.serial_numbers import INTERVAL, LIFETIME
from illuminator_ros.illuminator.status_order import CALM_TIME
from illuminator_ros.mavlink.dialect import mavlink, replaced
from illuminator_ros.payload.identity import Identity
import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight
from support.shared_address import SharedAddress
from support.wire import Faults, FaultyWire

ON_OFF, CONFIGURE = mavlink.MAV_CMD_ILLUMINATOR_ON_OFF, mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE


class Acknowledging(FakeLight):
    """A light that executes commands; whether it acknowledges them is a choice."""

    acknowledges = True

    def send(self, message: Any) -> None:
        if self.acknowledges or message.get_type() != 'COMMAND_ACK':
            super().send(message)


def clocked(uptime: Callable[[float], float] | None) -> FakeLight:
    """Return a light whose uptime, s, is a function of the true one; None for always 0."""
    light = FakeLight()
    if uptime is None:
        light.boot = None
    else:
        light.uptime_ms = lambda now: int(uptime(now) * 1000)  # type: ignore[method-assign]
    return light


def passing(wire: FaultyWire, *times: Callable[[float], float]) -> None:
    """Let a line send each frame at other times."""
    send = wire.send

    def sent(frame: bytes, now: float) -> None:
        for time in times:
            send(frame, time(now))

    wire.send = sent  # type: ignore[method-assign]


def switches(pair: Pair) -> list[tuple[bool, str]]:
    return [(one.on, one.origin) for one in pair.recorder.others if isinstance(one, LightSwitched)]


def changing(pair: Pair) -> list[bool]:
    return [one.is_changing for one in pair.recorder.others if isinstance(one, StatesChanging)]


# The clock of the light, the faults of the line, and s by which all its frames come again.
@pytest.mark.parametrize(('uptime', 'faults', 'again'), [
    (lambda now: 0.8 * now, {}, None), (lambda now: 1.2 * now, {}, None),
    (lambda now: now // 1 / 1000, {}, None),
    (lambda now: now // 1 / 1000, {'reorder': 0.3, 'latency': 0.05}, None),
    (None, {}, None), (None, {}, 0.6), (lambda now: now, {}, 0.6), (lambda now: now, {}, 4.0),
    (lambda now: now, {'latency': 0.3}, None)],
    ids=['20 % slow', '20 % fast', 'counts seconds', 'counts seconds and reordered',
         'stands still', 'stands still, two paths', 'two paths', 'a slow second path',
         'a radio with a round trip of 0.6 s'])
def test_each_request_succeeds_at_once_and_only_they_change_the_light(
    uptime: Callable[[float], float] | None, faults: dict[str, float], again: float | None,
) -> None:
    pair = Pair(clocked(uptime), there=Faults(**faults))
    if again is not None:
        passing(pair.far.wire, lambda now: now, lambda now: now + again)
    pair.settle(10.0)
    for on in (True, False, True, False):
        answer = pair.ask_enable(on)
        assert pair.wait_for(answer).success
        assert answer.seconds < 0.7
        pair.run(2.0)
        assert pair.configure(brightness=70.0 if on else 30.0).success
        pair.run(7.0)
    assert switches(pair) == [(True, 'a request'), (False, 'a request')] * 2
    assert [cause for cause, _ in pair.recorder.changes] == [
        ChangeCause.FIRST_STATUS, *[ChangeCause.REQUEST] * 4]
    assert pair.recorder.events == ['connected']
    assert changing(pair) == []


def test_three_stalls_of_the_line_end_no_request_and_are_no_changing_state() -> None:
    pair = Pair(FakeLight(enable=1, stream=0.2)).settle()
    stalls_until = pair.now
    for end in (pair.near, pair.far):
        passing(end.wire, lambda now: max(now, stalls_until))
    for on in (False, True, False):
        stalls_until = pair.now + 2.5
        assert pair.enable(on).success
        assert pair.now >= stalls_until
        pair.run(1.0)
    assert pair.recorder.events == ['connected']
    assert [on for on, _ in switches(pair)] == [False, True, False]
    assert changing(pair) == []


@pytest.mark.parametrize('then_off', [False, True])
def test_a_light_that_never_acknowledges_is_switched_with_one_event_and_an_answer_that_says_so(
    then_off: bool,
) -> None:
    light = Acknowledging()
    pair = Pair(light).settle()
    light.acknowledges = False
    for on in (True, False) if then_off else (True,):
        result = pair.enable(on)
        assert result.success
        assert result.message.startswith(
            f'{"on" if on else "off"}, confirmed by ILLUMINATOR_STATUS, without an acknowledgement'
            ' (4 tries, 1.75')
        pair.run(5.0)
    assert switches(pair) == [(True, 'a request'), (False, 'a request')][:1 + then_off]


@pytest.mark.parametrize('first', [
    mavlink.MAV_RESULT_UNSUPPORTED, mavlink.MAV_RESULT_DENIED, mavlink.MAV_RESULT_IN_PROGRESS,
    mavlink.MAV_RESULT_ACCEPTED])
def test_a_light_of_which_two_programs_acknowledge_each_command_is_switched_with_one_event(
    first: int,
) -> None:
    light = Acknowledging()
    send = light.send

    def twice(message: Any) -> None:
        if message.get_type() == 'COMMAND_ACK':
            send(replaced(message, result=first))
        send(message)

    light.send = twice  # type: ignore[method-assign]
    pair = Pair(light).settle()
    for on in (True, False):
        assert pair.enable(on).success
        pair.run(2.0)
    assert switches(pair) == [(True, 'a request'), (False, 'a request')]


def test_a_light_that_sends_a_status_each_10_s_and_none_on_request_is_told_when_it_is_due(
) -> None:
    light = FakeLight(stream=10.0)
    light.answers.discard(STATUS_ID)
    pair = Pair(light).settle(25.0)
    result = pair.enable(True)
    assert (result.success, result.message.partition(' (')[0]) == (
        False, 'on not confirmed: MAV_RESULT_ACCEPTED; its next status is due within 10 s')
    pair.run(10.0)
    assert switches(pair) == [(True, 'a late effect of our request')]


def test_a_set_an_hour_after_one_that_failed_is_confirmed_at_once(
    fake: FakeLight, faked: Pair,
) -> None:
    fake.results[CONFIGURE] = None
    assert not faked.configure(brightness=60.0).success
    faked.run(3600.0)
    fake.results.clear()
    fake.fields['brightness'] = 40.0
    faked.run(2.0)
    for brightness in (60.0, 40.0):
        answer = faked.ask_configure(brightness=brightness)
        assert faked.wait_for(answer).success
        assert answer.seconds < 0.01


@pytest.mark.parametrize(('on', 'tries'), [(True, 1), (False, 5)])
def test_an_on_that_another_sender_undoes_at_once_is_not_sent_again_but_an_off_is(
    fake: FakeLight, faked: Pair, on: bool, tries: int,
) -> None:
    fake.fields['enable'] = int(not on)
    faked.run(2.0)
    fake.applies = False
    result = faked.enable(on)
    assert 'ILLUMINATOR_STATUS shows ' + ('off' if on else 'on') in result.message
    assert (result.success, len(faked.commands(ON_OFF))) == (False, tries)


def test_two_lights_at_one_address_are_reported_and_followed_only_after_10_s_of_calm() -> None:
    first, second = FakeLight(brightness=40.0), FakeLight(brightness=60.0)
    pair = Pair(SharedAddress(first, second, offset=0.5)).settle(8.0)
    assert changing(pair) == [True]
    first.fields['brightness'] = 20.0
    followed = len(pair.recorder.changes)
    pair.run(5.0)
    # Both obey, so that each status shows the change.
    assert pair.enable(True).success
    second.silent = True
    pair.run(CALM_TIME - 1.0)
    assert (changing(pair), len(pair.recorder.changes)) == ([True], followed)
    pair.run(3.0)
    assert changing(pair) == [True, False]
    assert pair.recorder.changes[followed:] == [(ChangeCause.LIGHT, {'brightness': 20.0})]


def test_two_serial_numbers_at_one_address_are_named_for_as_long_as_both_answer() -> None:
    first, second = FakeLight(stream=1.0), FakeLight(stream=1.0)
    first.identity, second.identity = (Identity(serial_number=one) for one in ('A-1', 'B-2'))
    second.boot = -400.0
    pair = Pair(SharedAddress(first, second, offset=0.5)).settle(3.0)
    restarts = pair.recorder.events.count('restarted')
    for _ in range(12):
        pair.run(20.0)
        assert pair.snapshot.shared_serials == ('A-1', 'B-2')
    assert pair.recorder.events.count('restarted') == restarts
    assert pair.recorder.identities == [first.identity]
    assert pair.enable(True).success

    second.silent = True
    pair.run(LIFETIME + INTERVAL)
    assert pair.snapshot.shared_serials == ()


def test_a_light_that_takes_the_place_of_a_lost_one_shares_no_address() -> None:
    fake = FakeLight()
    pair = Pair(fake).settle()
    fake.silent = True
    pair.run(5.0)
    fake.identity, fake.silent = Identity(serial_number='B-2'), False
    pair.run(3.0)
    assert pair.snapshot.shared_serials == ()


def test_a_light_that_flickers_after_each_switch_is_no_changing_state() -> None:
    light = FakeLight(stream=0.2)
    pair = Pair(light).settle()
    for on in (True, False) * 4:
        assert pair.enable(on).success
        for brightness in (30.0, 100.0):
            light.fields['brightness'] = brightness
            pair.run(0.5)
    assert changing(pair) == []


# Restarts

def test_ten_minutes_of_loss_with_a_reboot_in_them_are_one_restart_and_the_light_works(
    fake: FakeLight, faked: Pair,
) -> None:
    assert faked.enable(True).success
    assert faked.configure(brightness=40.0).success
    fake.silent = True
    faked.run(300.0)
    fake.restart(faked.now)
    faked.run(300.0)
    fake.silent = False
    faked.run(3.0)
    assert faked.light.twin.order.restarts == 1
    assert (fake.fields['brightness'], fake.fields['enable']) == (40.0, 0)
    assert faked.enable(True).success


@pytest.mark.parametrize(('after', 'starts_with', 'success'), [
    (0.0, {}, True), (0.1, {}, True),
    (0.1, {'brightness': 70.0, 'strobe_period': 1.0, 'strobe_duty_cycle': 50.0}, False),
    (1.5, {}, False)],
    ids=['at once', 'later', 'the light starts with these values', 'after the limit'])
def test_a_brightness_that_is_set_while_the_light_restarts_is_confirmed_or_leaves_nothing_behind(
    fake: FakeLight, faked: Pair, after: float, starts_with: dict[str, float], success: bool,
) -> None:
    assert faked.configure(brightness=40.0, strobe_period=1.0).success
    faked.run(3.0)
    fake.results[CONFIGURE] = None
    answer = faked.ask_configure(brightness=70.0)
    faked.run(after)
    fake.restart(faked.now, **starts_with)
    fake.results.clear()
    result = faked.wait_for(answer)
    assert result.success is success
    assert after > 1.0 or 'the light restarted meanwhile' in result.message
    faked.run(10.0)
    brightness = 70.0 if success else 40.0
    assert (fake.fields['brightness'], fake.fields['strobe_period']) == (brightness, 1.0)
    assert faked.snapshot.configuration is not None
    assert faked.snapshot.configuration.brightness == brightness


def test_an_on_after_a_restart_is_not_confirmed_by_what_came_from_before_it(
    fake: FakeLight, faked: Pair,
) -> None:
    fake.results[ON_OFF] = None
    first = faked.ask_enable(True)
    faked.run(0.1)
    shows_on = fake.status(faked.now)
    shows_on.enable = 1
    fake.restart(faked.now)
    faked.run_until(lambda: faked.light.twin.order.restarts)
    second = faked.ask_enable(True)
    for _ in range(20):
        fake.send(mavlink.MAVLink_command_ack_message(ON_OFF, 0))
        fake.send(shows_on)
        faked.run(0.05)
    faked.run(20.0)
    assert not first.result.success
    assert not second.result.success
