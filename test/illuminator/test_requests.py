# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Requests to a light: each has one answer, in time, and succeeds only if the light shows it."""

from __future__ import annotations

from collections.abc import Callable
import random
import re
from typing import Any

from illuminator_ros.illuminator.client import enable_all
from illuminator_ros.illuminator.messages import STATUS_ID
from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.illuminator.user_requests import INSISTENT_LIMIT
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.payload.identity import Identity
from illuminator_ros.payload.requests import Result
import pytest
from support.back_to_back import BRIDGE, Pair
from support.fake_light import FakeLight
from support.records import Answer
from support.wire import Faults

ON_OFF, CONFIGURE = mavlink.MAV_CMD_ILLUMINATOR_ON_OFF, mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE
REQUEST = mavlink.MAV_CMD_REQUEST_MESSAGE
ACCEPTED, DENIED, IN_PROGRESS, REJECTED = (
    mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED, mavlink.MAV_RESULT_IN_PROGRESS,
    mavlink.MAV_RESULT_TEMPORARILY_REJECTED)
# The end of a message: tries and time.
TIMING = re.compile(r' \((\d+) (?:try|tries), (?:(\d+) ms|(\d+\.\d\d) s)\)$')
NO_STATUS: dict[str, Any] = {'stream': 0.0, 'answers': set()}


def timing(message: str) -> tuple[int, float]:
    """Return the tries and the time, s, that a message ends with."""
    match = TIMING.search(message)
    assert match, message
    tries, ms, seconds = match.groups()
    return int(tries), float(seconds) if ms is None else int(ms) / 1000


def change(fake: FakeLight, **attributes: Any) -> None:
    """Set attributes of a light; ``fields`` and ``results`` are merged into the present ones."""
    for name, value in attributes.items():
        setattr(fake, name, {**getattr(fake, name), **value} if isinstance(value, dict) else value)


# On and off

@pytest.mark.parametrize(('on', 'light', 'success', 'text'), [
    (True, {}, True, 'on, confirmed by ILLUMINATOR_STATUS: MAV_RESULT_ACCEPTED'),
    (True, {'fields': {'error_status': 1}}, True,
     'on, confirmed by ILLUMINATOR_STATUS, but thermal throttling: MAV_RESULT_ACCEPTED'),
    (True, {'fields': {'error_status': 3}}, True,
     'on, confirmed by ILLUMINATOR_STATUS, but thermal throttling and over temperature shutdown: '
     'MAV_RESULT_ACCEPTED'),
    (True, {'fields': {'error_status': 4}}, True,
     'on, confirmed by ILLUMINATOR_STATUS: MAV_RESULT_ACCEPTED'),
    (False, {'fields': {'error_status': 2, 'enable': 1}}, True,
     'off, accepted (ILLUMINATOR_STATUS shows off, over temperature shutdown): '
     'MAV_RESULT_ACCEPTED'),
    (False, {'fields': {'error_status': 2}, 'results': {ON_OFF: DENIED}}, False,
     'refused: MAV_RESULT_DENIED'),
    (True, {'applies': False, 'fields': {'error_status': 2}}, False,
     'on not confirmed: MAV_RESULT_ACCEPTED, but ILLUMINATOR_STATUS shows off, over temperature '
     'shutdown'),
    (True, {'applies': False, 'fields': {'enable': 2}}, False,
     'on not confirmed: MAV_RESULT_ACCEPTED, but ILLUMINATOR_STATUS shows neither on nor off'),
    (True, NO_STATUS, False,
     'on not confirmed: MAV_RESULT_ACCEPTED, but no ILLUMINATOR_STATUS came within 1.00 s'),
    (True, {'results': {ON_OFF: None}}, False,
     'no acknowledgement, and ILLUMINATOR_STATUS shows off'),
    *((True, {'results': {ON_OFF: result}}, False, f'refused: {mav.result_name(result)}')
      for result in (DENIED, mavlink.MAV_RESULT_UNSUPPORTED, mavlink.MAV_RESULT_FAILED, 11, 200)),
])
def test_the_answer_to_a_switch_says_what_the_light_did(
    fake: FakeLight, faked: Pair, on: bool, light: dict[str, Any], success: bool, text: str,
) -> None:
    change(fake, **light)
    answer = faked.ask_enable(on)
    result = faked.wait_for(answer)
    assert (result.success, TIMING.sub('', result.message)) == (success, text)
    tries, seconds = timing(result.message)
    assert tries == len(faked.commands(ON_OFF))
    assert seconds == pytest.approx(answer.seconds, abs=0.01)
    assert answer.seconds <= 2.8


@pytest.mark.parametrize(('is_closed', 'reason'), [
    (False, 'no heartbeat for 10.00 s'), (True, 'the link is not open: closed')])
def test_requests_to_a_lost_light_fail_at_once_with_the_reason(
    fake: FakeLight, faked: Pair, is_closed: bool, reason: str,
) -> None:
    fake.silent = True
    if is_closed:
        faked.close()
    faked.run(10.0 - (faked.now - faked.light.liveness.heard_at))
    sent = len(faked.commands())
    answers = [faked.ask_enable(True), faked.ask_configure(brightness=50), faked.ask_refresh()]
    faked.light.set_brightness(50.0, faked.now)
    assert {(answer.seconds, answer.result.message) for answer in answers} == {
        (0.0, f'light 1/243 is lost: {reason}')}
    assert faked.recorder.failed_setpoints == [f'light 1/243 is lost: {reason}']
    assert len(faked.commands()) == sent
    # It may hear an OFF though it is not heard.
    answer = faked.ask_enable(False)
    assert answer.result.message == f'light 1/243 is lost: {reason}' + (
        '' if is_closed else '; an OFF was sent once, and the light may still be on')
    assert [one.param1 for one in faked.commands()[sent:]] == [0.0] * (not is_closed)


def test_after_a_stop_of_the_process_a_request_that_may_be_old_is_refused_but_not_an_off(
    fake: FakeLight, faked: Pair,
) -> None:
    faked.controller.sender.stalled(7.0, faked.now)
    sent = len(faked.commands(ON_OFF, CONFIGURE))
    for answer in (faked.ask_enable(True), faked.ask_enable(True, is_call=False),
                   faked.ask_configure(brightness=50)):
        assert answer.result.message == (
            'the request may be 7.00 s old, since this process was stopped as long; repeat it')
    assert len(faked.commands(ON_OFF, CONFIGURE)) == sent
    assert faked.enable(False).success
    faked.run(1.0)
    assert faked.enable(True).success


# Several requests

def test_a_set_succeeds_by_its_own_value_though_the_light_keeps_another_field(
    fake: FakeLight, faked: Pair,
) -> None:
    fake.applies = False
    faked.light.require({'strobe_duty_cycle': 20.0}, faked.now)
    faked.run(1.5)
    answer = faked.ask_configure(brightness=40)
    fake.fields['brightness'] = 40.0
    assert faked.wait_for(answer).success
    assert faked.commands(CONFIGURE)[-1].param4 == 20.0
    assert faked.snapshot.discrepancy


def test_many_lights_are_served_at_once_and_a_dead_one_delays_no_other() -> None:
    addresses = [mav.Address(1, component) for component in range(100, 130)]
    pair = Pair([IlluminatorProperties(address=address) for address in addresses],
                there=Faults(latency=0.05)).settle()
    pair.device.receive = lambda *message: None  # type: ignore[method-assign]
    dead, *alive = [pair.ask_enable(True, light) for light in pair.controller.lights.values()]
    pair.run(0.25)
    assert [answer.result.success for answer in alive] == [True] * 29
    assert not pair.wait_for(dead).success


def test_an_answer_that_raises_does_not_hold_up_other_requests(pair: Pair) -> None:
    def done(result: Result, now: float) -> None:
        raise RuntimeError('as the test says')

    pair.light.enable(True, pair.now, done)
    answer = pair.ask_enable(True)
    with pytest.raises(RuntimeError):
        pair.run(5.0)
    assert pair.wait_for(answer).success
    assert pair.enable(True).success


# The time of a set

SET_LIMIT = 0.9
PROGRESS = mav.CommandAck(CONFIGURE, IN_PROGRESS, 1, 0, *BRIDGE)
LIGHTS: dict[str, dict[str, Any]] = {
    'silent': {'silent': True},
    'no acknowledgement': {'results': {CONFIGURE: None}},
    'no progress': {'results': {CONFIGURE: IN_PROGRESS}},
    'endless progress': {
        'results': {CONFIGURE: None}, 'stream': 0.1, 'status': lambda now: PROGRESS},
    'always rejected': {'results': {CONFIGURE: REJECTED}},
    'accepted at the fourth try': {'results': {CONFIGURE: [REJECTED] * 3 + [ACCEPTED]}},
    'COMMAND_INT only': {'results': {CONFIGURE: mavlink.MAV_RESULT_COMMAND_INT_ONLY}},
    'not done': {'applies': False},
    'done late': {'apply_after': 0.7},
    'no status any more': {'stream': 0.0, 'answers': {mav.INFORMATION_ID}},
    'no answer to requests': {'stream': 0.0, 'results': {REQUEST: None}},
    'denied': {'results': {CONFIGURE: DENIED}},
}
LINES = {
    'good': Faults(), 'slow': Faults(latency=0.4), 'lossy': Faults(drop=0.5),
    'late': Faults(delay=0.5), 'torn': Faults(corrupt=0.5),
    'bad': Faults(drop=0.3, duplicate=0.3, reorder=0.3, delay=0.3, corrupt=0.3)}


@pytest.mark.parametrize('line', LINES)
@pytest.mark.parametrize('light', LIGHTS)
@pytest.mark.parametrize('command_timeout', [0.05, 0.5, 10.0])
def test_each_set_is_answered_once_and_in_time(
    light: str, line: str, command_timeout: float,
) -> None:
    fake = FakeLight()
    pair = Pair(fake, there=LINES[line], command_timeout=command_timeout, seed=light)
    pair.run_until(lambda: pair.controller.lights and pair.snapshot.configuration)
    draw = random.Random(light)
    change(fake, **LIGHTS[light])
    answers = []
    for _ in range(12):
        answers.append(pair.ask_configure(brightness=draw.uniform(0, 100)))
        pair.run(draw.choice([0.0, 0.01, 0.1, 0.5, 0.779, 0.78, 0.781, 1.0]))
    pair.run(SET_LIMIT)
    assert [len(answer.results) for answer in answers] == [1] * len(answers)
    assert max(answer.seconds for answer in answers) <= SET_LIMIT


# Refresh

# s; the tries of two commands, and the messages that they request.
REFRESH_LIMIT = 5.0


def test_a_refresh_requests_status_and_identity_and_takes_both(
    fake: FakeLight, faked: Pair,
) -> None:
    change(fake, identity=Identity(serial_number='T-2'), fields={'brightness': 12.0})
    at = faked.now
    result = faked.wait_for(faked.ask_refresh())
    assert result.success
    assert result.message == ('ILLUMINATOR_STATUS: received, '
                              'COMPONENT_INFORMATION_BASIC: received (4 ms)')
    assert {message.param1 for message in faked.commands(REQUEST, since=at)} == {
        STATUS_ID, mav.INFORMATION_ID}
    assert faked.light.twin.status is not None
    assert faked.light.twin.status.brightness == 12.0
    assert faked.snapshot.identity == Identity(serial_number='T-2')


@pytest.mark.parametrize(('light', 'success', 'status', 'identity'), [
    ({'answers': {STATUS_ID}}, True, 'received', 'acknowledged, but not sent'),
    ({'stream': 0.0, 'results': {REQUEST: mavlink.MAV_RESULT_UNSUPPORTED}}, False,
     'refused: MAV_RESULT_UNSUPPORTED', 'refused: MAV_RESULT_UNSUPPORTED'),
    ({'stream': 0.0, 'answers': {mav.INFORMATION_ID}}, False, 'acknowledged, but not sent',
     'received'),
    (NO_STATUS, False, 'acknowledged, but not sent', 'acknowledged, but not sent'),
    *(({**NO_STATUS, 'results': {REQUEST: result}}, False, '', '')
      for result in (None, IN_PROGRESS, REJECTED)),
])
def test_a_refresh_ends_once_and_in_time_with_the_reason(
    fake: FakeLight, faked: Pair, light: dict[str, Any], success: bool, status: str,
    identity: str,
) -> None:
    change(fake, **light)
    answers = [faked.ask_refresh() for _ in range(300)]
    faked.run(0.3)
    answers.append(faked.ask_refresh())
    faked.run(REFRESH_LIMIT + 0.1)
    assert {answer.result.success for answer in answers} == {success}
    assert f'ILLUMINATOR_STATUS: {status}' in answers[0].result.message
    assert f'COMPONENT_INFORMATION_BASIC: {identity}' in answers[0].result.message
    assert max(answer.seconds for answer in answers) <= REFRESH_LIMIT


class Requested(FakeLight):
    """A light that loses requests for some messages once, and refuses those for others."""

    def __init__(self) -> None:
        super().__init__(stream=0.1)
        self.loses: list[int] = []
        self.refuses = 0

    def receive(self, source: mav.Address, message: Any, now: float) -> None:
        if isinstance(message, mav.CommandLong) and message.command == REQUEST:
            if message.param1 in self.loses:
                self.loses.remove(int(message.param1))
                return
            self.results[REQUEST] = (mavlink.MAV_RESULT_UNSUPPORTED
                                     if message.param1 == self.refuses else ACCEPTED)
        super().receive(source, message, now)


def test_the_refusal_of_an_identity_does_not_end_the_request_for_a_status() -> None:
    light = Requested()
    pair = Pair(light).settle()
    change(light, stream=0.0, loses=[STATUS_ID], refuses=mav.INFORMATION_ID)
    result = pair.wait_for(pair.ask_refresh())
    assert (result.success, TIMING.sub('', result.message).partition(' (')[0]) == (
        True, 'ILLUMINATOR_STATUS: received, '
        'COMPONENT_INFORMATION_BASIC: refused: MAV_RESULT_UNSUPPORTED')


# All lights at once

@pytest.fixture
def three() -> Pair:
    """Return a client and three lights that know each other."""
    return Pair([IlluminatorProperties(mav.Address(1, one)) for one in (243, 244, 245)]).settle()


def ask_all(pair: Pair, on: bool = True, *, is_call: bool = True) -> Answer:
    answer = Answer(pair.now)
    enable_all(list(pair.controller.lights.values()), on, pair.now, answer,
               name=lambda light: f'lamp {light.address}', is_call=is_call)
    pair.turn()
    return answer


def deafen(pair: Pair) -> None:
    pair.device.receive = lambda *message: None  # type: ignore[method-assign]


@pytest.mark.parametrize(('prepare', 'success', 'texts'), [
    (lambda pair: None, True, ['3 of 3 on', 'lamp 1/243: on, confirmed by', 'lamp 1/244: on, ',
                               'lamp 1/245: on, ']),
    (deafen, False, ['2 of 3 on', 'lamp 1/243: no acknowledgement, and ILLUM', 'lamp 1/244: on, ',
                     'lamp 1/245: on, ']),
    (lambda pair: pair.controller.lights[mav.Address(1, 244)].lose('gone', pair.now), True,
     ['2 of 2 on', 'lamp 1/243: on, ', 'lamp 1/244: light 1/244 is lost', 'lamp 1/245: on, ']),
    (Pair.close, False, [f'lamp 1/{one}: light 1/{one} is lost: ' for one in (243, 244, 245)]),
], ids=['all', 'one fails', 'one is lost', 'all are lost'])
def test_the_answer_of_all_lights_names_the_outcome_of_each(
    three: Pair, prepare: Callable[[Pair], None], success: bool, texts: list[str],
) -> None:
    prepare(three)
    at = three.now
    result = three.wait_for(ask_all(three))
    assert result.success is success
    parts = result.message.split('; ')
    assert [part[:len(text)] for part, text in zip(parts, texts, strict=True)] == texts
    # The lights are switched in parallel, in the time of the slowest.
    assert three.now - at < 2.8
    assert len({m.target_component for m in three.commands(ON_OFF, since=at)
                }) == int(texts[0][5] if texts[0][0].isdigit() else 0)


def test_an_off_of_all_lights_reaches_each_at_once_though_one_has_not_answered_the_last(
    three: Pair,
) -> None:
    deafen(three)
    first = ask_all(three, on=False)
    three.run(0.1)
    pressed_at = three.now
    ask_all(three, on=False)
    three.run(0.1)
    assert not first.results
    assert {one.target_component for one in three.commands(ON_OFF, since=pressed_at)} >= {244, 245}


@pytest.mark.parametrize(('result', 'applies', 'answer'), [
    (mavlink.MAV_RESULT_FAILED, True, 'refused: MAV_RESULT_FAILED'),
    (mavlink.MAV_RESULT_ACCEPTED, False, 'off not confirmed: MAV_RESULT_ACCEPTED, but '
     'ILLUMINATOR_STATUS shows on'),
    (None, True, 'off not confirmed: no answer to an earlier OFF, which is sent again')])
def test_an_off_call_beside_an_automatic_off_that_never_succeeds_is_answered(
        result: int | None, applies: bool, answer: str) -> None:
    fake = FakeLight(enable=0)
    pair = Pair(fake, settings=LightSettings(off_after_silence=2.0)).settle()
    assert pair.enable(True).success
    fake.results, fake.applies = {mavlink.MAV_CMD_ILLUMINATOR_ON_OFF: result}, applies
    pair.run(5.0)

    failed = pair.ask_enable(False)
    pair.run(INSISTENT_LIMIT)
    assert [one.message for one in failed.results] == [answer]

    fake.results, fake.applies = {}, True
    assert pair.enable(False).success
