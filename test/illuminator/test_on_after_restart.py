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

"""The bridge delays an ON until a light that may have restarted has its configuration."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from illuminator_ros.illuminator.light import Light, Settings
from illuminator_ros.illuminator.messages import STATUS_ID
from illuminator_ros.illuminator.model import SafetyLimits
from illuminator_ros.illuminator.status_tracker import RESTART_CHECK_TIME
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.payload.command_sources import SourceSettings
import pytest
from support.back_to_back import Pair, START
from support.fake_light import FakeLight, status_message
from support.faulty_wire import Faults
from support.records import Answer
from support.shared_address import SharedAddress

CONFIGURE, ON_OFF = mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE, mavlink.MAV_CMD_ILLUMINATOR_ON_OFF
LIMITED = Settings(limits=SafetyLimits(max_brightness=60.0))
COMPLETE = {'mode': 'internal_control', 'brightness': 30, 'strobe_period': 0,
            'strobe_duty_cycle': 0}


def agreed(light: FakeLight, settings: Settings | None = None, **how: Any) -> Pair:
    """Return a client and a light that have agreed on 30 %."""
    pair = Pair(light, settings=settings, **how).settle()
    assert pair.configure(brightness=30).success
    return pair


def lose(pair: Pair, light: FakeLight) -> None:
    light.silent = True
    pair.run_until(lambda: not pair.light.connected)
    light.silent = False


def lost(light: FakeLight, settings: Settings | None = None, **how: Any) -> Pair:
    """Return a client and a light that have agreed on 30 % and lost each other."""
    pair = agreed(light, settings, **how)
    lose(pair, light)
    return pair


def on_at_connection(pair: Pair) -> Answer:
    """Request an ON as soon as the light is connected."""
    pair.run_until(lambda: pair.controller.lights and pair.light.connected)
    return pair.ask_enable(True)


def switch_on_at_connection(pair: Pair) -> Answer:
    """Switch the light on as soon as it is connected, and return the answer."""
    answer = on_at_connection(pair)
    assert pair.wait_for(answer).success
    return answer


def hide_status(light: FakeLight) -> None:
    light.stream = 0.0
    light.answers.clear()


def status_first(light: FakeLight, now: float) -> None:
    light.heartbeat.due = now + 0.7


def heartbeat_first(light: FakeLight, now: float) -> None:
    light.delay_status(0.7)


@pytest.mark.parametrize('first', [status_first, heartbeat_first])
@pytest.mark.parametrize('seconds_lost', [0.0, 10.0, 100.0])
@pytest.mark.parametrize('has_clock', [True, False])
@pytest.mark.parametrize(('settings', 'brightness'), [
    (Settings(), 30.0), (LIMITED, 30.0),
    (replace(LIMITED, restore_configuration=False), 60.0),
], ids=['restored', 'limited', 'limited only'])
def test_a_restarted_light_is_switched_on_after_it_has_its_configuration(
    settings: Settings, brightness: float, has_clock: bool, seconds_lost: float,
    first: Callable[[FakeLight, float], None],
) -> None:
    light = FakeLight()
    if not has_clock:
        light.boot = None
    pair = lost(light, settings)
    light.silent = True
    pair.run(seconds_lost)
    light.silent = False
    light.restart(pair.now)
    first(light, pair.now)

    answer = switch_on_at_connection(pair)

    assert light.shone == [brightness]
    assert answer.seconds < 0.5


@pytest.mark.parametrize('seconds_to_status', [0.0, 0.6, 1.19])
def test_a_restarted_light_without_statuses_on_request_is_switched_on_after_its_configuration(
    seconds_to_status: float,
) -> None:
    light = FakeLight(stream=1.2)
    light.boot = START
    light.answers.clear()
    pair = lost(light)
    light.restart(pair.now)
    light.delay_status(seconds_to_status)

    switch_on_at_connection(pair)

    assert light.shone == [30.0]


def test_a_light_that_restarts_without_a_loss_is_switched_on_when_its_status_is_proved() -> None:
    light = FakeLight()
    light.boot = START
    pair = agreed(light)
    light.restart(pair.now)
    pair.run(0.01)
    assert pair.light.restarts == 0

    assert pair.enable(True).success
    assert light.shone == [30.0]


@pytest.mark.parametrize(('settings', 'overrides', 'sends_status', 'seconds', 'brightness'), [
    (Settings(), {'brightness': 30}, True, 0.0, 30.0),
    (Settings(), COMPLETE, True, 0.0, 30.0),
    (LIMITED, {}, True, 0.0, 60.0),
    # An incomplete configuration cannot be sent to a light that does not report it.
    (Settings(), {'brightness': 30}, False, 3.0, 100.0),
    (Settings(), COMPLETE, False, 3.78, 30.0),
    (LIMITED, {}, False, RESTART_CHECK_TIME, 100.0)])
def test_a_found_light_is_switched_on_after_it_has_its_overrides_and_limits(
    settings: Settings, overrides: dict[str, Any], sends_status: bool, seconds: float,
    brightness: float,
) -> None:
    light = FakeLight()
    if not sends_status:
        hide_status(light)

    def override(found: Light) -> None:
        if overrides:
            found.set_desired(overrides, START)

    pair = Pair(light, settings=settings, on_light=override)

    switch_on_at_connection(pair)

    assert light.shone == [brightness]
    (at, _), = pair.commands_at(ON_OFF)
    assert at == pytest.approx(START + seconds, abs=0.02)


def test_a_light_that_runs_on_is_switched_on_with_its_first_status() -> None:
    light = FakeLight()
    pair = lost(light)

    answer = switch_on_at_connection(pair)

    assert answer.seconds < 0.1


def test_a_light_without_anything_agreed_is_switched_on_at_once() -> None:
    light = FakeLight()
    pair = Pair(light, settings=Settings(restore_configuration=False)).settle()
    lose(pair, light)
    hide_status(light)

    on_at_connection(pair)

    assert pair.commands(ON_OFF, since=pair.now)


def test_an_on_does_not_wait_until_a_change_by_another_sender_is_undone() -> None:
    light = FakeLight()
    pair = agreed(light, Settings(reassert=True))
    for _ in range(2):
        light.fields['brightness'] = 80.0
        pair.run(1.1)
    assert light.fields['brightness'] == 80.0

    pair.ask_enable(True)

    assert pair.commands(ON_OFF, since=pair.now)


def test_an_off_is_sent_at_once_and_cancels_the_on_that_waits() -> None:
    light = FakeLight()
    pair = lost(light)
    light.restart(pair.now)
    on = on_at_connection(pair)

    off = pair.ask_enable(False)

    assert [one.param1 for one in pair.commands(ON_OFF, since=pair.now)] == [0.0]
    assert pair.wait_for(off).success
    pair.run(10.0)
    assert on.result.message == 'superseded by off'
    assert light.shone == []


def test_an_on_that_waits_fails_at_once_when_the_light_is_lost() -> None:
    light = FakeLight()
    pair = lost(light)
    hide_status(light)
    on = on_at_connection(pair)
    assert not on.results
    pair.close()

    assert 'is lost' in on.result.message
    pair.open()
    pair.run(10.0)
    assert light.shone == []


@pytest.mark.parametrize('result', [mavlink.MAV_RESULT_DENIED, None])
def test_a_light_that_cannot_be_configured_is_switched_on_after_one_attempt(
    result: int | None,
) -> None:
    light = FakeLight()
    pair = lost(light)
    light.results[CONFIGURE] = result
    light.restart(pair.now)

    answer = switch_on_at_connection(pair)

    assert light.shone == [100.0]
    assert answer.seconds < 1.1


def test_an_on_is_sent_after_the_restart_check_time_if_no_status_comes() -> None:
    light = FakeLight()
    pair = lost(light)
    hide_status(light)
    answer = on_at_connection(pair)

    pair.run_until(lambda: pair.commands(ON_OFF, since=answer.asked_at))

    assert pair.now == pytest.approx(answer.asked_at + RESTART_CHECK_TIME)


def test_late_statuses_hold_an_on_no_longer_than_the_restart_check_time() -> None:
    light = FakeLight()
    light.boot = START
    pair = agreed(light)
    hide_status(light)

    def send_late() -> None:
        light.send(status_message(uptime_ms=1, **light.fields))
        pair.turn()
        pair.run(0.3)

    send_late()
    answer = pair.ask_enable(True)
    assert not pair.commands(ON_OFF)
    while pair.now < answer.asked_at + RESTART_CHECK_TIME:
        assert pair.light.restarts == 0
        send_late()

    assert pair.commands(ON_OFF)


def test_a_light_that_is_lost_before_it_has_its_configuration_is_configured_before_an_on() -> None:
    light = FakeLight()
    pair = lost(light)
    light.results[CONFIGURE] = None
    light.restart(pair.now)
    pair.run(1.2)
    pair.close()
    light.results[CONFIGURE] = [None, mavlink.MAV_RESULT_ACCEPTED]
    pair.open()

    answer = switch_on_at_connection(pair)

    assert light.shone == [30.0]
    assert answer.seconds < 0.8


def test_overrides_that_cannot_be_sent_are_reported_once_though_the_light_is_lost_again() -> None:
    light = FakeLight()
    hide_status(light)
    pair = Pair(
        light, on_light=lambda light: light.set_desired({'brightness': 30}, START)).settle()

    lose(pair, light)
    pair.run(5.0)

    assert len(pair.recorder.restorations) == 1


@pytest.mark.parametrize('seed', range(20))
def test_a_restarted_light_is_switched_on_once_configured_over_a_lossy_line(seed: int) -> None:
    light = FakeLight()
    pair = lost(light, seed=seed)
    light.restart(pair.now)
    for end in (pair.near, pair.far):
        end.wire.faults = Faults(drop=0.1, duplicate=0.2, delay=0.05)

    switch_on_at_connection(pair)

    assert set(light.shone) == {30.0}


def test_an_on_of_the_next_holder_waits_for_an_interrupted_configuration() -> None:
    light = FakeLight()
    pair = lost(light, Settings(sources=SourceSettings(('safety', 'default'))))
    light.results[CONFIGURE] = [None, mavlink.MAV_RESULT_ACCEPTED]
    light.restart(pair.now)
    restarted_at = pair.now
    pair.run_until(lambda: pair.commands(CONFIGURE, since=restarted_at))
    answer = Answer(pair.now)

    pair.light.enable(True, pair.now, answer, source='safety')

    assert pair.wait_for(answer).success
    assert light.shone == [30.0]


def test_overrides_of_a_light_that_is_lost_before_its_first_status_are_sent_before_an_on() -> None:
    light = FakeLight()
    light.answers.clear()
    light.delay_status(START + 1.0)
    pair = Pair(light, on_light=lambda light: light.set_desired({'brightness': 30}, START))
    pair.run_until(lambda: pair.controller.lights)
    pair.close()
    light.answers.add(STATUS_ID)
    pair.open()

    switch_on_at_connection(pair)

    assert light.shone == [30.0]
    assert [success for success, _ in pair.recorder.restorations] == [True]


@pytest.mark.parametrize(('ask', 'restarts', 'text', 'fields'), [
    (lambda pair: pair.ask_enable(True), True, 'no acknowledgement (2 tries',
     {'enable': 0, 'brightness': 30.0}),
    (lambda pair: pair.ask_configure(brightness=50), False, 'no acknowledgement (',
     {'enable': 1, 'brightness': 30.0}),
    (lambda pair: pair.ask_enable(False), False, 'off, confirmed by ILLUMINATOR_STATUS',
     {'enable': 0, 'brightness': 30.0}),
], ids=['on', 'set', 'off'])
def test_only_an_off_is_resent_to_a_light_that_was_lost(
    ask: Callable[[Pair], Answer], restarts: bool, text: str, fields: dict[str, float],
) -> None:
    light = FakeLight()
    light.boot = START
    pair = agreed(light)
    assert pair.enable(True).success
    light.silent = True
    pair.run(2.6)
    answer = ask(pair)
    pair.run_until(lambda: not pair.light.connected)
    if restarts:
        light.restart(pair.now)
    light.silent = False
    pair.run(5.0)

    assert answer.result.message.startswith(text)
    assert light.fields == light.fields | fields


def test_a_light_that_restarts_without_a_loss_is_brought_within_the_limits_again() -> None:
    light = FakeLight()
    pair = agreed(light, replace(LIMITED, restore_configuration=False))
    light.restart(pair.now)
    pair.run(5.0)

    assert light.fields['brightness'] == 60.0


def test_an_on_after_a_second_restart_waits_for_another_attempt_at_the_limits() -> None:
    light = FakeLight()
    pair = agreed(light, replace(LIMITED, restore_configuration=False))
    light.results[CONFIGURE] = None
    light.restart(pair.now)
    pair.run(1.5)
    light.results.clear()
    light.restart(pair.now)
    pair.run_until(lambda: pair.light.restarts == 2)

    assert pair.enable(True).success
    assert light.shone == [60.0]


def test_a_copy_of_the_last_status_after_a_short_loss_shows_no_restart() -> None:
    light = FakeLight()
    pair = agreed(light)
    last = light.status(pair.now)
    light.send(last)
    pair.turn()
    pair.run(0.01)
    pair.close()
    pair.open()
    light.send(last)
    pair.turn()
    pair.run(5.0)

    assert pair.light.restarts == 0


def test_a_restoration_from_before_a_loss_does_not_end_the_one_after_it() -> None:
    light = FakeLight()
    pair = lost(light, replace(LIMITED, restore_configuration=False))
    light.restart(pair.now)
    light.applies = False
    pair.run_until(lambda: pair.light.restarts)
    pair.run(0.05)
    pair.close()
    light.applies = True
    pair.run(0.1)
    light.restart(pair.now)
    pair.open()

    switch_on_at_connection(pair)

    assert light.shone == [60.0]


@pytest.mark.parametrize('first', [mavlink.MAV_RESULT_TEMPORARILY_REJECTED, None])
def test_an_on_waits_for_the_limits_though_a_parameter_is_being_set(first: int | None) -> None:
    light = FakeLight()
    pair = lost(light, replace(LIMITED, restore_configuration=False))
    light.results[CONFIGURE] = [first, first, mavlink.MAV_RESULT_ACCEPTED]
    light.restart(pair.now)
    heartbeat_first(light, pair.now)
    pair.run_until(lambda: pair.light.connected)
    pair.ask_configure(brightness=20)

    assert pair.wait_for(pair.ask_enable(True)).success
    assert light.shone == [20.0]


def test_an_on_waits_for_the_limits_though_a_change_was_to_be_undone() -> None:
    light = FakeLight()
    pair = agreed(light, replace(LIMITED, restore_configuration=False, reassert=True))
    for _ in range(2):
        light.fields['brightness'] = 50.0
        pair.run(1.1)
    light.results[CONFIGURE] = [mavlink.MAV_RESULT_TEMPORARILY_REJECTED,
                                mavlink.MAV_RESULT_ACCEPTED]
    pair.close()
    light.restart(pair.now)
    pair.open()

    switch_on_at_connection(pair)

    assert light.shone == [30.0]


@pytest.mark.parametrize('seconds_lost', [0.3, 1.5])
def test_a_light_without_a_clock_may_have_restarted_in_a_short_loss(seconds_lost: float) -> None:
    light = FakeLight()
    light.boot = None
    pair = agreed(light)
    pair.close()
    pair.run(seconds_lost)
    light.restart(pair.now)
    pair.open()

    switch_on_at_connection(pair)

    assert light.shone == [30.0]


def test_a_light_may_have_restarted_soon_after_its_start_and_a_long_loss_began() -> None:
    light = FakeLight()
    light.boot = START - 55.0
    pair = lost(light)
    light.silent = True
    pair.run(20.0)
    light.restart(pair.now)
    pair.run(1800.0)
    light.silent = False
    light.heartbeat.due = pair.now

    switch_on_at_connection(pair)

    assert light.shone == [30.0]


def test_an_on_waits_for_overrides_that_could_not_be_sent_before_the_first_status() -> None:
    light = FakeLight()
    answers, light.answers = light.answers, set()
    light.stream = 0.0
    pair = Pair(
        light, on_light=lambda light: light.set_desired({'brightness': 30}, START)).settle(5.0)
    lose(pair, light)
    light.answers, light.stream = answers, 1.0
    light.restart(pair.now)
    heartbeat_first(light, pair.now)

    switch_on_at_connection(pair)

    assert light.shone == [30.0]


def test_a_first_status_that_comes_late_after_a_loss_holds_an_on_until_it_is_proved() -> None:
    light = FakeLight(stream=2.0)
    light.boot = START
    light.answers.clear()
    pair = lost(light)
    light.restart(pair.now)
    light.delay_status(3.0)
    pair.run_until(lambda: pair.light.connected)
    pair.run(3.01)

    pair.wait_for(pair.ask_enable(True))

    assert light.shone == [30.0]


def test_a_status_that_a_stalled_line_held_back_does_not_release_an_on() -> None:
    light = FakeLight()
    pair = agreed(light)
    held_back = light.status(pair.now + 1.0)
    light.silent = True
    pair.run(10.0)
    light.silent = False
    light.restart(pair.now)
    light.delay_status(0.7)
    light.send(held_back)

    switch_on_at_connection(pair)

    assert light.shone == [30.0]


def test_an_on_does_not_wait_for_ever_where_parameters_are_set_without_a_pause() -> None:
    light = FakeLight()
    pair = lost(light)
    light.restart(pair.now)
    heartbeat_first(light, pair.now)
    light.answers.clear()
    answer = on_at_connection(pair)
    sets: list[Answer] = []
    while not answer.results:
        if not sets or sets[-1].results:
            sets.append(pair.ask_configure(brightness=10 + len(sets) % 20))
            light.answers = {STATUS_ID} if pair.now > answer.asked_at + 0.5 else set()
        pair.run(0.001)

    assert answer.result.success
    assert answer.seconds < 3.0
    assert max(light.shone) < 30.0


def test_an_on_waits_until_lights_that_share_an_address_are_within_the_limits() -> None:
    lights = FakeLight(), FakeLight()
    pair = Pair(SharedAddress(*lights, offset=0.3),
                settings=replace(LIMITED, restore_configuration=False)).settle()
    lights[1].fields['enable'] = 1
    pair.run(8.0)
    assert pair.snapshot.shared_address
    pair.close()
    for light in lights:
        light.restart(pair.now)
    pair.open()

    on_at_connection(pair)
    pair.run(5.0)

    assert [light.shone for light in lights] == [[60.0], [60.0]]
