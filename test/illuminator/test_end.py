# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""From the moment the end begins only an OFF changes a light, and it is the last change."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import random

from illuminator_ros.illuminator.events import (
    AutomaticSwitch,
    DesiredStateFailed,
    LightEvent,
    LightSwitched,
    SetpointFailed,
)
from illuminator_ros.illuminator.light import Light
from illuminator_ros.illuminator.model import SafetyLimits
from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.illuminator.simulated_properties import (
    IlluminatorBehaviour,
    IlluminatorProperties,
)
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.mavlink.messages import Address
from illuminator_ros.payload.command_sources import SourceSettings
from illuminator_ros.payload.device_events import DeviceHeld
from illuminator_ros.payload.requests import Result
import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight
from support.random_users import RandomUsers
from support.wire import Faults

ON_OFF, CONFIGURE = mavlink.MAV_CMD_ILLUMINATOR_ON_OFF, mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE
ENDING = 'the bridge is ending'
# s that the bridge waits for the lights.
LIMIT = 0.6
# Events of changes that the bridge makes, or fails to make.
ACTIONS = (AutomaticSwitch, DesiredStateFailed, DeviceHeld, LightSwitched, SetpointFailed)
SOURCES = ('safety', 'default', 'autonomy')
LATE = Address(1, 250)


class Ending:
    """
    Lights and their users, and the end.

    :ivar reports: the last result that was reported for each light, by address.
    :ivar reported_at_once: the lights that were reported in the turn in which the end begins.
    """

    def __init__(self, pair: Pair) -> None:
        self.pair = pair
        self.reports: dict[Address, Result] = {}
        self.reported_at_once: set[Address] = set()
        self.before, self.ended_at = 0, 0.0
        self.events: list[LightEvent] = []

    def begin(self, *, off: bool = True) -> None:
        """Do what the bridge does at its end, in one turn."""
        self.before = len(self.pair.near.sent)
        self.ended_at = self.pair.now
        self.pair.controller.events.subscribe(self.events.append)
        self.pair.controller.close(self.pair.now, ENDING)
        if off:
            self.pair.controller.client.switch_off_finally(self.pair.now, self._report)
        self.reported_at_once = set(self.reports)
        self.pair.turn()

    def _report(self, light: Light, result: Result, now: float) -> None:
        self.reports[light.address] = result

    def changes(self, address: Address | None = None) -> list[tuple[int, float]]:
        """Return the commands that were sent since the end began and change a light."""
        return [(message.command, message.param1) for _, message in
                self.pair.near.sent[self.before:]
                if getattr(message, 'command', 0) in (ON_OFF, CONFIGURE)
                and (address is None or address.component == message.target_component)]


def lights(draw: random.Random) -> list[IlluminatorProperties]:
    """Return three lights, one of which is heard only later."""
    return [
        IlluminatorProperties(address=address, behaviour=IlluminatorBehaviour(
            brightness_is_switch=draw.random() < 0.3,
            silence=5.0 if address == LATE else 0.0))
        for address in (Address(1, 243), Address(1, 244), LATE)]


@pytest.mark.parametrize('seed', range(15))
def test_whatever_is_under_way_and_comes_an_off_is_the_last_change_and_reports_are_true(
    seed: int,
) -> None:
    draw = random.Random(seed)
    faults = Faults(drop=draw.choice((0.0, 0.3)))
    pair = Pair(lights(draw), seed=seed, there=faults, uptime=0.0, settings=LightSettings(
        off_after_silence=draw.choice((0.0, 0.5)),
        limits=SafetyLimits(max_brightness=80.0), off_on_release=draw.random() < 0.5,
        sources=draw.choice((None, SourceSettings(SOURCES, draw.choice((0.3, 60.0)))))))
    users, ending = RandomUsers(pair, draw, *SOURCES, others_switch_on=False), Ending(pair)
    pair.run(draw.choice((0.1, 4.0, 5.0)))
    for _ in range(40):
        users.act()
        pair.run(draw.choice((0.0, 0.001, 0.01, 0.1)))
    begun = len(users.answers)
    ending.begin()
    assert all(answer.results for answer in users.answers[:begun])

    while pair.now < ending.ended_at + LIMIT:
        users.act()
        pair.run(draw.choice((0.0, 0.001, 0.01, 0.1)))

    assert set(ending.changes()) <= {(ON_OFF, 0.0)}
    assert {len(answer.results) for answer in users.answers} <= {1}
    assert [event for event in ending.events if isinstance(event, ACTIONS)] == []
    assert all(not answer.result.success and ENDING in answer.result.message
               for answer in users.answers[begun:])
    for address in pair.controller.lights:
        sent = ending.changes(address)
        assert sent or 'lost' in ending.reports[address].message, address
    for device in pair.devices:
        if device.address in pair.controller.lights:
            report = ending.reports[device.address]
            assert not (report.success and device.device.enabled), (device.address, report)


@pytest.fixture
def light() -> FakeLight:
    """Return a light that is on."""
    return FakeLight(enable=1)


@pytest.fixture
def ending(light: FakeLight) -> Ending:
    """Return the end of a bridge with that light."""
    return Ending(Pair(light).settle())


@pytest.mark.parametrize('is_switch', [False, True])
def test_an_on_that_the_off_overtakes_on_the_way_is_followed_by_another_off(
    ending: Ending, light: FakeLight, is_switch: bool,
) -> None:
    pair, wire = ending.pair, ending.pair.near.wire
    light.brightness_is_switch = is_switch
    assert pair.enable(False).success
    pair.settle()
    wire.faults, prompt = replace(wire.faults, latency=0.15), wire.faults
    if is_switch:
        pair.ask_configure(brightness=60.0)
    else:
        pair.ask_enable(True)
    wire.faults = prompt
    ending.begin()
    pair.run(0.1)
    assert (light.fields['enable'], ending.reports[light.source].success) == (0, False)
    assert is_switch or ending.reports[light.source].message == 'sent, not confirmed'
    pair.run(0.05)
    assert light.fields['enable'] == 1
    pair.run_until(lambda: ending.reports[light.source].success, within=LIMIT)

    assert light.fields['enable'] == 0


def test_an_end_without_an_on_under_way_is_as_short_as_the_round_trip(
    ending: Ending, light: FakeLight,
) -> None:
    assert ending.pair.enable(True).success
    ending.begin()
    # The bridge ends if it has no light to wait for.
    assert ending.reported_at_once == {light.source}
    ending.pair.run_until(lambda: ending.reports[light.source].success, within=0.02)

    assert ending.changes() == [(ON_OFF, 0.0)]


def _restart(pair: Pair, light: FakeLight) -> None:
    light.restart(pair.now, enable=1)


def _reconnect(pair: Pair, light: FakeLight) -> None:
    light.fields['enable'] = 1
    pair.close()
    pair.run(0.1)
    pair.open()


def _switch_by_another(pair: Pair, light: FakeLight) -> None:
    light.fields['enable'] = 1
    light.send(light.status(pair.now))
    pair.turn()


@pytest.mark.parametrize('happens', [_restart, _reconnect, _switch_by_another])
@pytest.mark.parametrize('confirmed', [True, False])
def test_a_light_that_goes_on_again_during_the_end_is_switched_off_again(
    ending: Ending, light: FakeLight, happens: Callable[[Pair, FakeLight], None], confirmed: bool,
) -> None:
    ending.begin()
    if confirmed:
        ending.pair.run_until(lambda: ending.reports[light.source].success)
    happens(ending.pair, light)
    ending.pair.run(LIMIT)

    assert light.fields['enable'] == 0
    assert ending.reports[light.source].success


def test_a_light_that_is_found_or_heard_again_during_the_end_is_switched_off() -> None:
    pair = Pair([IlluminatorProperties(
        address=Address(1, number), behaviour=IlluminatorBehaviour(silence=silence))
        for number, silence in ((243, 8.0), (244, 0.0))], uptime=0.0)
    found, heard = pair.devices
    pair.settle(3.5)
    heard.behave(replace(heard.behaviour, silence=4.2), pair.now)
    pair.run(4.0)
    found.device.enabled = heard.device.enabled = True
    ending = Ending(pair)
    ending.begin()
    assert [report.message.partition(':')[0] for report in ending.reports.values()] == [
        'light 1/244 is lost']
    pair.run(LIMIT)

    assert not (found.device.enabled or heard.device.enabled)
    assert all(ending.reports[one.address].success for one in (found, heard))


@pytest.mark.parametrize(('enabled', 'ask', 'may_be_left_on'), [
    (1, None, True), (0, None, False), (0, True, True), (0, False, False)])
def test_a_light_that_is_on_or_gets_an_on_may_be_left_on_without_an_off(
    ending: Ending, light: FakeLight, enabled: int, ask: bool | None, may_be_left_on: bool,
) -> None:
    light.fields['enable'] = enabled
    ending.pair.run(1.5)
    if ask is not None:
        ending.pair.ask_enable(ask)
    ending.begin(off=False)

    assert ending.pair.light.may_be_on(ending.pair.now) is may_be_left_on


@pytest.mark.parametrize(('results', 'sends_status', 'reason'), [
    (mavlink.MAV_RESULT_DENIED, True, 'refused: MAV_RESULT_DENIED'),
    (mavlink.MAV_RESULT_FAILED, True, 'refused: MAV_RESULT_FAILED'),
    (None, True, ''),
    (mavlink.MAV_RESULT_ACCEPTED, False, 'off not confirmed: MAV_RESULT_ACCEPTED')])
def test_a_light_that_does_not_show_off_gets_it_until_the_end_and_is_reported_with_the_reason(
    ending: Ending, light: FakeLight, results: int | None, sends_status: bool, reason: str,
) -> None:
    light.results[ON_OFF] = results
    light.applies = False
    if not sends_status:
        light.answers, light.stream = set(), 0.0
    ending.begin()
    ending.pair.run(LIMIT)

    assert ending.reports[light.source] == Result(False, reason)
    assert len(ending.changes()) >= 3


def test_a_status_that_may_be_older_than_the_off_is_followed_by_a_request_for_another(
    ending: Ending, light: FakeLight,
) -> None:
    pair = ending.pair
    light.results[ON_OFF], light.fields['enable'] = None, 0
    older = light.status(pair.now)
    light.stream, light.fields['enable'] = 0.0, 1
    pair.run(0.01)
    ending.begin()
    light.send(older)
    pair.run(0.01)

    assert not ending.reports[light.source].success
    assert pair.commands(mavlink.MAV_CMD_REQUEST_MESSAGE, since=ending.ended_at)
