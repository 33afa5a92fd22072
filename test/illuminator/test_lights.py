# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A light from its discovery to its loss: liveness, restarts, its stream and its identity."""

from __future__ import annotations

import functools
from typing import Any

from illuminator_ros.illuminator.light_queries import MESSAGE, SETTLING_TIME
from illuminator_ros.illuminator.messages import STATUS_ID
from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.mavlink import messages as mav
from illuminator_ros.mavlink.dialect import decode, encode, mavlink
from illuminator_ros.payload.identity import Identity, text
import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight
from support.wire import START

CONFIGURE, REQUEST = mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE, mavlink.MAV_CMD_REQUEST_MESSAGE


def requests_of(pair: Pair, message_id: int, since: float = 0.0) -> int:
    """Return how often a message was requested."""
    return [command.param1 for command in pair.commands(REQUEST, since=since)].count(message_id)


def without_clock(stream: float = 1.0) -> FakeLight:
    light = FakeLight(stream=stream)
    light.boot = None
    return light


# Liveness

@pytest.mark.parametrize('timeout', [1.1, 3.0, 7.3, 60.0])
def test_a_light_is_lost_after_the_heartbeat_timeout_and_found_again(
    fake: FakeLight, timeout: float,
) -> None:
    pair = Pair(fake, settings=LightSettings(heartbeat_timeout=timeout)).settle()
    light, heard_at = pair.light, pair.light.liveness.heard_at
    fake.silent = True
    pair.run_until(lambda: not light.connected, within=100.0)
    assert pair.now - heard_at == pytest.approx(timeout)
    pair.run(10.0)
    at = pair.now
    pair.run(20.0)
    assert pair.commands(since=at) == []
    fake.silent = False
    pair.run(1.0)
    assert requests_of(pair, STATUS_ID, since=at)
    assert pair.recorder.events == [
        'connected', f'lost: no heartbeat for {timeout:.2f} s', 'connected']


def test_a_lost_link_loses_the_light_at_once_and_a_new_one_finds_it(pair: Pair) -> None:
    pair.close()
    assert pair.recorder.events[-1] == 'lost: the link was lost'
    sent = len(pair.near.sent)
    pair.run(60.0)
    assert len(pair.near.sent) == sent
    pair.open()
    pair.run(0.1)
    assert pair.recorder.events[-1] == 'connected'


def test_a_line_that_is_lost_beside_another_one_takes_its_lights_and_their_requests_only() -> None:
    pair = Pair([IlluminatorProperties(address=mav.Address(1, number))
                 for number in (10, 11)]).settle()
    first, second = pair.controller.lights.values()
    results: dict[mav.Address, Any] = {}
    for light in (first, second):
        light.enable(True, pair.now, functools.partial(
            lambda address, result, now: results.update({address: result}), light.address))
    pair.controller.components_lost([first.address], pair.now, 'unplugged')
    assert (first.connected, second.connected) == (False, True)
    assert [(address, result.success) for address, result in results.items()] == [
        (first.address, False)]
    assert 'lost' in results[first.address].message
    pair.run(2.0)
    assert results[second.address].success
    assert first.connected


def test_a_link_that_is_open_again_is_not_filled_with_requests() -> None:
    pair = Pair([IlluminatorProperties(address=mav.Address(1, 1 + i))
                 for i in range(24)]).settle()
    pair.close()
    pair.open()
    assert len(pair.commands(REQUEST, since=pair.now)) == 8


# Restarts

@pytest.mark.parametrize(('light', 'silence', 'restart', 'events'), [
    (FakeLight(), 0.0, True, ['restarted']),
    (FakeLight(), 5.0, True, ['lost', 'connected', 'restarted']),
    (FakeLight(), 50.0, False, ['lost', 'connected']),
    (without_clock(), 10.0, True, ['lost', 'connected', 'restarted']),
    (without_clock(), 0.0, False, []),
    (without_clock(0.0), 0.0, False, []),
])
def test_a_restart_is_one_event_after_the_light_is_heard_again(
    light: FakeLight, silence: float, restart: bool, events: list[str],
) -> None:
    pair = Pair(light).settle()
    light.silent = True
    pair.run(silence)
    light.silent = False
    if restart:
        light.restart(pair.now)
    pair.run(60.0)
    assert [event.partition(':')[0] for event in pair.recorder.events[1:]] == events
    assert pair.light.twin.order.restarts == events.count('restarted')


# The stream of statuses

@pytest.mark.parametrize(('stream', 'results', 'least', 'most'), [
    (1.0, {}, 1, 1),
    (0.0, {}, 22, 27),
    # Each request is tried four times.
    (0.0, {REQUEST: None}, 45, 108),
], ids=['it streams', 'it does not', 'it has no requests'])
def test_a_light_that_sends_no_status_is_asked_for_one_at_a_limited_rate(
    stream: float, results: dict[int, Any], least: int, most: int,
) -> None:
    pair = Pair(FakeLight(stream=stream, results=results)).settle(63.5)
    assert least <= requests_of(pair, STATUS_ID) <= most
    if not stream and not results:
        assert len(pair.recorder.statuses) == requests_of(pair, STATUS_ID)


@pytest.mark.parametrize('interval', [0.0, 0.1, 0.5, 5.0])
def test_the_interval_of_the_settings_is_requested_at_first_and_after_a_restart(
    fake: FakeLight, interval: float,
) -> None:
    pair = Pair(fake, settings=LightSettings(status_interval=interval)).settle(30.0)
    expected = [(STATUS_ID, pytest.approx(interval * 1e6))] if interval else []
    assert [(command.param1, command.param2) for command in pair.commands(
        mavlink.MAV_CMD_SET_MESSAGE_INTERVAL)] == expected
    assert fake.stream == pytest.approx(interval or 1.0)
    assert requests_of(pair, STATUS_ID, since=START + 3.0) == 0
    fake.restart(pair.now)
    fake.stream = 1.0
    pair.run(10.0)
    assert fake.stream == pytest.approx(interval or 1.0)


@pytest.mark.parametrize('timeout', [10.0, 3.0, 2.0, 1.1])
def test_a_light_without_heartbeat_and_with_rare_statuses_is_not_lost(timeout: float) -> None:
    light = FakeLight(heartbeat_type=None)
    pair = Pair(light, settings=LightSettings(timeout, status_interval=60.0)).settle(300.0)
    assert light.stream == 60.0
    assert pair.recorder.events == ['connected']


# The temperature

def test_a_temperature_is_measured_from_the_first_that_is_not_0_unless_the_sensor_fails(
    fake: FakeLight,
) -> None:
    fake.fields['temp_c'] = 0.0
    pair = Pair(fake).settle()
    seen = [pair.snapshot.temperature]
    for fields in ({'temp_c': -3.0}, {'temp_c': 0.0}, {'error_status': 4},
                   {'error_status': 0, 'temp_c': float('nan')}):
        fake.fields |= fields
        pair.run(1.5)
        seen.append(pair.snapshot.temperature)
    assert seen == [None, -3.0, 0.0, None, None]


# The identity

class Selective(FakeLight):
    """A light that answers a request for its identity with one result, or not at all."""

    def __init__(self, result: int | None, **options: Any) -> None:
        super().__init__(**options)
        self.result = result

    def receive(self, source: Any, message: Any, now: float) -> None:
        usual = self.results
        if getattr(message, 'param1', None) == mav.INFORMATION_ID:
            self.results = {REQUEST: self.result}
        super().receive(source, message, now)
        self.results = usual


@pytest.mark.parametrize(('field', 'expected'), [
    (b'torch', 'torch'), (b'torch\0rubbish', 'torch'), (b'', ''), (b'x' * 32, 'x' * 32),
    (b' padded ', 'padded'), ('Lämp'.encode(), 'Lämp'), (b'a\x1b[31mb', 'a?[31mb'),
    (b'\xff\xfe', '\N{REPLACEMENT CHARACTER}' * 2), (b'a\nb', 'a?b'),
])
def test_a_char_field_is_read_as_printable_text_up_to_its_terminator(
    field: bytes, expected: str,
) -> None:
    assert text(field) == expected
    sent = mav.ComponentInformationBasic(0, 0, 0, b'm' * 32, field, b'1', b'2', b'n-1')
    message = decode(mav.ComponentInformationBasic, encode(sent))
    assert Identity.from_message(message) == Identity('m' * 32, expected, '1', '2', 'n-1')


def test_the_identity_is_requested_once_and_again_after_a_loss(
    fake: FakeLight, faked: Pair,
) -> None:
    first = fake.identity
    faked.run(60.0)
    assert requests_of(faked, mav.INFORMATION_ID) == 1
    fake.silent = True
    faked.run(10.0)
    fake.identity = Identity(serial_number='T-2')
    fake.silent = False
    faked.run(3.0)
    assert faked.recorder.identities == [first, fake.identity]
    assert faked.snapshot.identity == fake.identity


@pytest.mark.parametrize(('light', 'count', 'failure'), [
    (Selective(mavlink.MAV_RESULT_DENIED), MESSAGE.tries, 'refused: MAV_RESULT_DENIED'),
    (Selective(mavlink.MAV_RESULT_UNSUPPORTED), MESSAGE.tries,
     'refused: MAV_RESULT_UNSUPPORTED'),
    (Selective(None), 4, 'no acknowledgement'),
    (FakeLight(), MESSAGE.tries, 'acknowledged, but not sent'),
])
def test_an_identity_that_does_not_come_is_requested_so_often_and_the_reason_named(
    light: FakeLight, count: int, failure: str,
) -> None:
    light.answers.discard(mav.INFORMATION_ID)
    pair = Pair(light, command_retries=3).settle(30.0)
    assert requests_of(pair, mav.INFORMATION_ID) == count
    assert pair.snapshot.identity_is_settled
    result = pair.wait_for(pair.ask_refresh())
    assert f'COMPONENT_INFORMATION_BASIC: {failure}' in result.message
    light.send(light.information())
    pair.run(10.0)
    assert pair.snapshot.identity == light.identity


def test_a_light_that_ignores_the_request_for_its_identity_confirms_changes_as_fast() -> None:
    pair = Pair(Selective(None, stream=0.0), command_timeout=5.0)
    pair.run_until(lambda: pair.controller.lights and pair.light.twin.status)
    assert not pair.snapshot.identity_is_settled
    answer = pair.ask_enable(True)
    assert pair.wait_for(answer).success
    assert answer.seconds < 0.1
    pair.run(SETTLING_TIME)
    assert pair.snapshot.identity_is_settled


# Lights in the field

def test_a_light_that_supports_its_own_two_commands_only_is_served() -> None:
    pair = Pair(FakeLight(stream=0.5, results={
        REQUEST: mavlink.MAV_RESULT_UNSUPPORTED,
        mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: mavlink.MAV_RESULT_UNSUPPORTED}),
        settings=LightSettings(status_interval=0.1)).settle()
    assert pair.enable(True).success
    assert pair.configure(brightness=50).success
