# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Commands without a request: off after silence, and lights for which brightness is the switch."""

from collections.abc import Callable
from typing import Any

from illuminator_ros.illuminator.events import (
    AutomaticSwitch,
    LATE_EFFECT,
    LightSwitched,
    StatesChanging,
)
from illuminator_ros.illuminator.model import SafetyLimits
from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.payload.command_sources import SourceSettings
import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight
from support.shared_address import SharedAddress
from support.wire import Faults

ON_OFF, CONFIGURE = mavlink.MAV_CMD_ILLUMINATOR_ON_OFF, mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE
SILENCE = 5.0


def silenced(light: FakeLight | None = None, **faults: float) -> Pair:
    return Pair(light or FakeLight(), settings=LightSettings(off_after_silence=SILENCE),
                there=Faults(**faults)).settle()


@pytest.mark.parametrize(('act', 'on'), [
    (lambda pair: pair.ask_enable(True), True),
    (lambda pair: pair.ask_configure(brightness=20.0), True),
    (lambda pair: pair.light.set_brightness(20.0, pair.now), True),
    (lambda pair: pair.ask_refresh(), False),
], ids=['enable', 'configure', 'stream', 'refresh'])
def test_a_light_stays_on_as_long_as_it_is_commanded(
        act: Callable[[Pair], object], on: bool) -> None:
    pair = silenced()
    pair.enable(True)
    for _ in range(4):
        act(pair)
        pair.run(SILENCE - 1.0)

    assert pair.light.twin.status
    assert pair.light.twin.status.enabled is on


@pytest.mark.parametrize('way', ['request', 'another sender', 'already on'])
def test_a_light_goes_off_after_silence_however_it_was_switched_on(way: str) -> None:
    light = FakeLight(enable=int(way == 'already on'))
    pair = silenced(light)
    if way == 'request':
        pair.enable(True)
    light.fields['enable'] = 1
    pair.run(SILENCE + 2.0)

    assert light.fields['enable'] == 0
    assert [one.on for one in pair.recorder.others if isinstance(one, AutomaticSwitch)] == [False]


def test_off_after_silence_is_repeated_until_the_light_shows_it() -> None:
    light = FakeLight()
    pair = silenced(light, drop=0.3)
    pair.run_until(lambda: pair.enable(True).success)
    light.results[ON_OFF] = [mavlink.MAV_RESULT_FAILED] * 3 + [None] * 9 + [
        mavlink.MAV_RESULT_ACCEPTED]
    pair.run(40.0)

    assert light.fields['enable'] == 0
    assert any(one.failure for one in pair.recorder.others if isinstance(one, AutomaticSwitch))


def test_a_light_without_status_that_may_have_executed_an_on_goes_off_after_silence() -> None:
    light = FakeLight(stream=0.0)
    light.answers.clear()
    pair = silenced(light)
    light.results[ON_OFF] = None
    assert not pair.enable(True).success
    silent_at = pair.now
    pair.run(SILENCE + 2.0)

    assert {command.param1 for command in pair.commands(ON_OFF, since=silent_at)} == {0.0}


@pytest.mark.parametrize('results', [
    [None], [mavlink.MAV_RESULT_TEMPORARILY_REJECTED],
    [mavlink.MAV_RESULT_IN_PROGRESS, mavlink.MAV_RESULT_ACCEPTED]],
    ids=['lost', 'rejected', 'in progress'])
# A lost ON is due to be sent again after 0.5 s.
@pytest.mark.parametrize('silence', [0.3, 0.5])
def test_an_on_under_way_ends_at_the_silence_with_an_off(
        results: list[int | None], silence: float) -> None:
    light = FakeLight()
    pair = Pair(light, settings=LightSettings(off_after_silence=silence)).settle()
    light.results[ON_OFF] = [*results]
    answer = pair.ask_enable(True)
    silent_at = pair.now + silence
    pair.run(5.0)

    assert answer.result.message == (
        f'off_after_silence ({silence * 1000:.0f} ms)')
    sent = [command.param1 for command in pair.commands(ON_OFF, since=silent_at)]
    assert set(sent) == {0.0}


@pytest.mark.parametrize('before', [0.0, SILENCE + 0.5])
def test_a_light_that_is_lost_before_or_during_its_off_goes_off_when_it_is_heard_again(
        before: float) -> None:
    light = FakeLight()
    pair = silenced(light)
    pair.enable(True)
    light.results[ON_OFF] = mavlink.MAV_RESULT_FAILED
    pair.run(before)
    pair.close()
    reported = len(pair.recorder.others)
    pair.run(SILENCE + 1.0)
    assert len(pair.recorder.others) == reported
    light.results.clear()
    pair.open()
    pair.run(2.0)

    assert light.fields['enable'] == 0


HOT: dict[str, Any] = {'enable': 0, 'error_status': 2}
COOL: dict[str, Any] = {'enable': 0, 'error_status': 0}
LIT: dict[str, Any] = {'enable': 1, 'error_status': 0}


@pytest.mark.parametrize('cooling', [(), (COOL,)], ids=['', 'cool before it lights up'])
def test_a_light_that_overheats_and_cools_down_goes_off_after_silence(
    cooling: tuple[dict[str, Any], ...],
) -> None:
    light = FakeLight()
    pair = silenced(light)
    assert pair.enable(True).success
    pair.run(SILENCE - 2.0)
    for fields in (HOT, *cooling, LIT):
        light.fields |= fields
        pair.run(1.1)
    pair.run(1.0)

    assert light.fields['enable'] == 0


def _is_silent(pair: Pair) -> None:
    pair.run(SILENCE)


def _release(pair: Pair) -> None:
    pair.light.release('default', pair.now)


def _end(pair: Pair) -> None:
    pair.controller.close(pair.now, 'the process ends')
    pair.controller.client.switch_off_finally(pair.now, lambda light, result, now: None)


@pytest.mark.parametrize('cause', [_is_silent, _release, _end])
@pytest.mark.parametrize('is_accepted', [True, False])
@pytest.mark.parametrize('on_while_hot', [False, True])
def test_an_off_while_heat_keeps_a_light_off_is_repeated_until_it_is_accepted(
    cause: Callable[[Pair], None], is_accepted: bool, on_while_hot: bool,
) -> None:
    light = FakeLight()
    pair = Pair(light, settings=LightSettings(
        off_after_silence=SILENCE if cause is _is_silent else 0.0, off_on_release=True,
        sources=SourceSettings(('default',), 60.0))).settle()
    if on_while_hot:
        light.fields |= HOT
        light.applies = False
    pair.ask_enable(True, is_stream=True)
    pair.run(2.0)
    light.fields |= HOT
    pair.run(1.1)
    if not is_accepted:
        light.results[ON_OFF] = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    cause(pair)
    pair.turn()
    pair.run(5.0)
    on, *offs = [command.param1 for command in pair.commands(ON_OFF)]
    assert (on, set(offs), len(offs) == 1) == (1.0, {0.0}, is_accepted)

    light.applies = True
    light.results.clear()
    if not is_accepted:
        light.fields |= LIT
    pair.run(4.0)
    assert light.fields['enable'] == 0


def test_an_on_that_takes_effect_after_it_has_failed_does_not_count_as_a_request() -> None:
    light = FakeLight()
    pair = silenced(light)
    assert pair.enable(False).success
    silent_at = pair.now + SILENCE
    light.results[ON_OFF] = None
    assert not pair.enable(True).success
    light.results.clear()
    light.fields['enable'] = 1
    pair.run(silent_at - pair.now - 0.1)
    assert light.fields['enable'] == 1
    assert [(one.on, one.origin) for one in pair.recorder.others
            if isinstance(one, LightSwitched)] == [(True, LATE_EFFECT)]
    pair.run(0.2)

    assert light.fields['enable'] == 0


def test_an_off_under_way_when_the_silence_ends_is_answered_as_it_ends() -> None:
    light = FakeLight(enable=1)
    pair = Pair(light, settings=LightSettings(off_after_silence=1.0)).settle()
    assert pair.enable(True).success
    light.results[ON_OFF] = None
    answer = pair.ask_enable(False)
    pair.run(1.5)
    light.results.clear()

    assert pair.wait_for(answer).success


@pytest.mark.parametrize('latency', [0.002, 0.15])
@pytest.mark.parametrize('period', [1.0, 0.25])
def test_calls_that_are_refused_do_not_postpone_the_off_after_silence(
    period: float, latency: float,
) -> None:
    light = FakeLight()
    pair = silenced(light, latency=latency)
    assert pair.enable(True).success
    light.results[CONFIGURE] = mavlink.MAV_RESULT_DENIED
    answers = []
    for number in range(round((SILENCE + 1.0) / period)):
        # Where the round trip is longer than the period, the calls overlap.
        answers.append(pair.ask_configure(brightness=20.0 + number % 2))
        pair.run(period)

    assert not any(one.success for answer in answers for one in answer.results)
    assert light.fields['enable'] == 0


def test_a_light_that_shows_on_again_after_each_off_gets_four_offs_a_second() -> None:
    on, off = FakeLight(enable=1), FakeLight()
    on.applies = False
    pair = Pair(SharedAddress(off, on), settings=LightSettings(off_after_silence=SILENCE)).settle()
    pair.run(SILENCE + 10.0)

    # The silence has lasted for 10 to 15 s.
    assert 10 < len(pair.commands(ON_OFF)) <= 65


@pytest.mark.parametrize('before', ['a failed request', 'throttling'])
def test_a_light_that_another_sender_switches_on_stays_on_until_silence(before: str) -> None:
    light = FakeLight()
    pair = silenced(light)
    assert pair.enable(False).success
    if before == 'throttling':
        light.fields['error_status'] = 1
    else:
        light.results[ON_OFF] = mavlink.MAV_RESULT_DENIED
        assert not pair.enable(True).success
        light.results.clear()
    pair.run(SILENCE + 2.0)
    light.fields['enable'] = 1
    pair.run(SILENCE - 1.0)

    assert light.fields['enable'] == 1


# Lights for which brightness is the switch

def test_a_light_whose_states_change_goes_off_after_silence_each_time_it_shows_that_it_is_on(
) -> None:
    light = FakeLight()
    pair = silenced(light)
    for number in range(60):
        light.fields['enable'] = number % 2
        pair.run(1.0)

    assert any(isinstance(one, StatesChanging) for one in pair.recorder.others)
    assert len(pair.commands(ON_OFF)) > 10


@pytest.mark.parametrize('setpoints', [[30.0], [30.0, 35.0]], ids=['sent again', 'waiting'])
def test_a_brightness_from_before_an_off_is_not_sent_after_it_where_that_is_the_switch(
    setpoints: list[float],
) -> None:
    light = FakeLight(brightness=50.0)
    light.brightness_is_switch = True
    pair = Pair(light).settle()
    # The bridge learns from the first OFF that brightness is the switch.
    for on in (True, False, True):
        assert pair.enable(on).success
        pair.run(5.0)
    light.results[CONFIGURE] = [None, None, mavlink.MAV_RESULT_ACCEPTED]
    for brightness in setpoints:
        pair.light.set_brightness(brightness, pair.now)
        pair.turn()
    pair.run(0.05)

    assert pair.enable(False).success
    pair.run(10.0)
    assert light.fields['enable'] == 0


def learned(light: FakeLight, settings: LightSettings | None = None) -> Pair:
    """Return a client that has learned that brightness is the switch of a light, which is on."""
    light.brightness_is_switch = True
    pair = Pair(light, settings=settings).settle()
    for on in (True, False, True):
        assert pair.enable(on).success
        pair.run(5.0)
    return pair


def test_a_configuration_that_is_restored_is_not_sent_after_an_off_where_brightness_is_the_switch(
) -> None:
    light = FakeLight(brightness=50.0)
    pair = learned(light)
    light.results[CONFIGURE] = [None, mavlink.MAV_RESULT_ACCEPTED]
    light.restart(pair.now, enable=1)
    pair.run_until(lambda: pair.light.twin.order.restarts)

    assert pair.enable(False).success
    pair.run(10.0)
    assert light.fields['enable'] == 0


def test_a_setpoint_that_an_off_replaces_is_not_reported_where_brightness_is_the_switch() -> None:
    light = FakeLight(brightness=50.0)
    pair = learned(light)
    light.results[CONFIGURE] = [None, mavlink.MAV_RESULT_ACCEPTED]
    pair.light.set_brightness(30.0, pair.now)
    pair.turn()

    assert pair.enable(False).success
    assert pair.recorder.failed_setpoints == []


def test_a_setpoint_waits_for_an_off_of_a_light_that_has_not_been_off_yet() -> None:
    light = FakeLight(brightness=50.0, enable=1, results={ON_OFF: [None, None, 0]})
    pair = Pair(light).settle()
    off = pair.ask_enable(False)
    pair.light.set_brightness(30.0, pair.now)
    pair.run(0.5)
    assert (off.results, pair.commands(CONFIGURE)) == ([], [])
    # It reports a brightness while it is off, so that a brightness does not switch it on.
    pair.run(2.0)
    assert off.result.success
    assert [command.param2 for command in pair.commands(CONFIGURE)] == [30.0]


def test_a_set_beside_an_off_succeeds_once_a_light_has_shown_a_brightness_while_off() -> None:
    light = FakeLight(brightness=50.0)
    pair = Pair(light).settle()
    assert pair.enable(True).success
    pair.run(40.0)
    # Another sender changes both.
    light.fields |= {'enable': 0, 'brightness': 0.0}
    pair.run(5.0)
    assert pair.configure(brightness=40.0).success
    pair.run(5.0)
    answer = pair.ask_configure(strobe_period=1.0)

    assert pair.enable(False).success
    assert pair.wait_for(answer).success


def limited_off(case: str) -> tuple[FakeLight, Pair, float]:
    """
    Send a slow light, for which brightness is the switch, an OFF before a status needs an answer.

    :return: the light, its client, and the time of the OFF.
    """
    light = FakeLight(brightness=50.0)
    pair = learned(light, LightSettings(limits=SafetyLimits(max_brightness=60.0)))
    light.apply_after = 0.5
    if case == 'restarted':
        light.restart(pair.now, enable=1, brightness=40.0)
        light.delay_status(0.01)
    else:
        light.fields['brightness'] = 90.0
    off = pair.ask_enable(False)
    pair.light.request_status(pair.now)
    off_at = pair.now
    assert pair.wait_for(off).success
    return light, pair, off_at


@pytest.mark.parametrize('case', ['beyond a limit', 'restarted'])
def test_no_configuration_is_sent_during_or_after_an_off_where_brightness_is_the_switch(
        case: str) -> None:
    light, pair, off_at = limited_off(case)
    pair.run(10.0)

    assert pair.commands(CONFIGURE, since=off_at) == []
    assert light.fields['enable'] == 0


def test_a_light_that_is_switched_on_beyond_a_limit_after_an_off_is_brought_back_within_it(
) -> None:
    light, pair, _ = limited_off('beyond a limit')
    # The light executes the last of the repeated OFFs.
    pair.run(1.0)
    light.fields |= {'enable': 1, 'brightness': 90.0}
    pair.run(5.0)

    assert light.fields['brightness'] == 60.0


@pytest.mark.parametrize('case', ['beyond a limit', 'restarted'])
def test_a_light_with_a_brightness_while_off_is_configured_while_offs_are_repeated(
        case: str) -> None:
    light = FakeLight(brightness=50.0)
    # It sends a status each second, and none on request.
    light.answers.clear()
    pair = Pair(light, settings=LightSettings(limits=SafetyLimits(max_brightness=60.0))).settle()
    assert pair.enable(False).success
    if case == 'restarted':
        light.restart(pair.now, brightness=40.0)
    else:
        light.fields['brightness'] = 90.0
    for _ in range(50):
        pair.ask_enable(False, is_stream=True)
        pair.run(0.1)

    assert light.fields['brightness'] == (50.0 if case == 'restarted' else 60.0)


def dark(**fields: float) -> tuple[FakeLight, Pair]:
    """Return a light whose brightness is its switch, which has been seen off."""
    light = FakeLight(enable=0, brightness=0.0)
    light.brightness_is_switch = True
    pair = Pair(light).settle()
    assert pair.configure(brightness=60.0, **fields).success
    return light, pair


def test_what_is_restored_does_not_switch_a_light_on_where_brightness_is_the_switch() -> None:
    light, pair = dark(strobe_period=1.0, strobe_duty_cycle=50.0)
    pair.run(3.0)
    light.restart(pair.now, enable=0, brightness=0.0)
    pair.run(5.0)

    assert (light.fields['enable'], light.fields['strobe_period']) == (0, 1.0)


def test_a_brightness_that_is_restored_waits_for_the_on_where_it_is_the_switch() -> None:
    light = FakeLight(enable=1, brightness=80.0, strobe_period=1.0, strobe_duty_cycle=50.0)
    light.brightness_is_switch = True
    pair = Pair(light).settle()
    light.restart(pair.now, enable=0, brightness=0.0)
    pair.run(5.0)
    assert (light.fields['enable'], light.fields['strobe_period']) == (0, 1.0)
    light.fields |= {'enable': 1, 'brightness': 50.0}
    pair.run(5.0)

    assert light.fields['brightness'] == 80.0


def test_a_set_of_another_field_does_not_undo_an_off_where_brightness_is_the_switch() -> None:
    light, pair = dark()
    off, configured = pair.ask_enable(False), pair.ask_configure(strobe_period=1.0)

    assert pair.wait_for(off).success
    assert pair.wait_for(configured).success
    assert (light.fields['enable'], light.fields['strobe_period']) == (0, 1.0)


def test_while_a_light_that_was_never_seen_off_goes_off_nothing_sets_its_brightness() -> None:
    light = FakeLight(enable=1, brightness=60.0)
    light.brightness_is_switch = True
    pair = Pair(light).settle()
    light.results[CONFIGURE] = None
    brightness = pair.ask_configure(brightness=50.0)
    pair.run(0.1)
    light.results.clear()
    off, other = pair.ask_enable(False), pair.ask_configure(strobe_period=1.0)
    pair.run(3.0)

    assert brightness.result.message == 'superseded by off'
    assert other.result.message.startswith('an OFF is under way')
    assert off.result.success
    assert light.fields['enable'] == 0
