# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0
"""``max_brightness`` and ``min_strobe_period`` hold for each frame that is sent."""

from dataclasses import replace
from typing import Any

from hypothesis import given, settings, strategies
from illuminator_ros.illuminator.events import LimitExceeded, SetpointClipped
from illuminator_ros.illuminator.limit_watch import LIMIT_INTERVAL
from illuminator_ros.illuminator.model import float32, SafetyLimits
from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.mavlink.dialect import mavlink
import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight
from support.wire import Faults

CONFIGURE = mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE
LIMITS = SafetyLimits(max_brightness=60.0, min_strobe_period=0.34)
LIMITED = LightSettings(limits=LIMITS)
percent = strategies.floats(0, 100)
period = strategies.one_of(strategies.just(0.0), strategies.floats(0.01, 2))
EXCEEDED = ('brightness 80 % is above max_brightness 60 %',
            'strobe_period 0.1 s is below min_strobe_period 0.34 s')


def limited(**fields: Any) -> tuple[FakeLight, Pair]:
    """Return a light and a client with limits, which have discovered each other."""
    light = FakeLight(**{'min_strobe_period': 0.01, 'max_strobe_period': 5.0, **fields})
    return light, Pair(light, settings=LIMITED).settle()


def assert_within_limits(pair: Pair) -> None:
    for command in pair.commands(CONFIGURE):
        assert float32(command.param2) <= float32(60.0)
        assert command.param3 == 0 or float32(command.param3) >= float32(0.34)


@settings(max_examples=25)
@given(strategies.lists(strategies.tuples(
    strategies.sampled_from(['configure', 'stream', 'override', 'restart', 'other sender']),
    percent, period, strategies.floats(0, 3)), max_size=12), strategies.integers(0, 99))
def test_limits_hold_for_each_frame_on_the_wire(
        steps: list[tuple[str, float, float, float]], seed: int) -> None:
    pair = Pair(there=Faults(drop=0.3, duplicate=0.2, delay=0.2), settings=LIMITED, seed=seed)
    pair.run_until(lambda: pair.controller.lights)
    for way, brightness, strobe_period, pause in steps:
        if way == 'configure':
            pair.ask_configure(strobe_period=strobe_period)
            pair.ask_configure(brightness=brightness, strobe_duty_cycle=10.0)
        elif way == 'stream':
            pair.light.set_brightness(brightness, pair.now)
        elif way == 'override':
            pair.light.require(
                {'brightness': brightness, 'strobe_period': strobe_period}, pair.now)
        elif way == 'restart':
            pair.device.restart(pair.now)
        else:
            pair.lamp.configuration = replace(
                pair.lamp.configuration, brightness=brightness, strobe_period=strobe_period)
        pair.run(pause)
    pair.run(5.0)

    assert_within_limits(pair)


@pytest.mark.parametrize(('change', 'reason'), [
    ({'brightness': 60.1}, 'brightness 60.1 % is above max_brightness 60 %'),
    ({'strobe_period': 0.33}, 'strobe_period 0.33 s is below min_strobe_period 0.34 s'),
    ({'brightness': 60.0, 'strobe_period': 0.34}, '')])
def test_a_value_beyond_a_limit_is_refused_with_the_limits_name(
        change: dict[str, float], reason: str) -> None:
    _, pair = limited(brightness=50.0)

    result = pair.configure(**change)

    assert (result.success, result.message) == (False, reason) if reason else result.success


def test_a_stream_beyond_a_limit_is_clipped_and_reported() -> None:
    _, pair = limited(brightness=50.0)

    for _ in range(20):
        pair.light.set_brightness(90.0, pair.now)
        pair.run(0.1)

    assert {command.param2 for command in pair.commands(CONFIGURE)} == {60.0}
    assert {one.message for one in pair.recorder.others if isinstance(one, SetpointClipped)} == {
        'brightness 90 % is above max_brightness 60 %'}


def test_a_light_beyond_the_limits_is_reported_and_brought_back_each_time() -> None:
    light, pair = limited(brightness=80.0, strobe_period=0.1, strobe_duty_cycle=10.0)
    for _ in range(3):
        pair.run(LIMIT_INTERVAL)
        assert not pair.snapshot.limit_exceeded.excess
        light.fields |= {'brightness': 80.0, 'strobe_period': 0.1}
        pair.run(2.0)

    assert [(one.param2, one.param3) for one in pair.commands(CONFIGURE)] == [(60.0, 0.34)] * 4
    assert [(one.excess, one.is_again) for one in pair.recorder.others
            if isinstance(one, LimitExceeded)] == [(EXCEEDED, False), ((), False)] * 4


def test_a_light_that_goes_beyond_a_limit_again_at_once_is_brought_back_once_in_10_s() -> None:
    light, pair = limited(brightness=80.0)
    light.fields['brightness'] = 80.0
    for _ in range(600):
        pair.run(0.1)
        if pair.snapshot.configuration and pair.snapshot.configuration.brightness == 60.0:
            light.fields['brightness'] = 80.0
    times = [at for at, _ in pair.commands_at(CONFIGURE)]

    assert len(times) in (6, 7)
    assert min(after - before for before, after in zip(times, times[1:], strict=False)
               ) >= LIMIT_INTERVAL
    assert pair.snapshot.limit_exceeded.is_again


def test_a_light_that_restarts_beyond_a_limit_is_brought_back_at_once() -> None:
    light = FakeLight()
    pair = Pair(light, settings=replace(LIMITED, restore_configuration=False)).settle()
    assert light.fields['brightness'] == 60.0
    light.restart(pair.now)
    pair.run(0.1)
    assert (pair.light.twin.order.restarts, light.fields['brightness']) == (1, 60.0)


def test_a_light_whose_on_resets_its_brightness_is_brought_back_and_the_answer_says_so() -> None:
    light, pair = limited(brightness=50.0)
    apply = light._apply

    def reset(message: Any, now: float) -> None:
        apply(message, now)
        if message.command != CONFIGURE and message.param1:
            light.fields['brightness'] = 100.0

    light._apply = reset  # type: ignore[method-assign]
    for _ in range(2):
        result = pair.enable(True)
        assert result.success
        assert 'brightness 100 % is above max_brightness 60 %, and is brought back' in (
            result.message)
        pair.run(LIMIT_INTERVAL + 1.0)
        assert light.fields['brightness'] == 60.0
        assert pair.enable(False).success


def test_a_light_that_restarts_within_the_limits_is_not_sent_what_it_had_beyond_them() -> None:
    light, pair = limited(brightness=80.0, strobe_period=0.1, strobe_duty_cycle=10.0)
    within = dict(light.fields)
    light.fields |= {'brightness': 80.0, 'strobe_period': 0.1}
    pair.run(10.0)
    restarted_at = pair.now
    light.restart(pair.now, **within)
    pair.run(10.0)

    assert pair.light.twin.order.restarts == 1
    assert pair.commands(CONFIGURE, since=restarted_at) == []
    assert pair.snapshot.configuration
    assert pair.snapshot.configuration.brightness == 60.0


def test_a_limit_above_what_the_light_can_do_is_reported_and_the_light_does_not_strobe() -> None:
    _, pair = limited(strobe_period=0.1, max_strobe_period=0.2, strobe_duty_cycle=10.0)

    assert pair.snapshot.limit_exceeded.impossible == (
        'min_strobe_period 0.34 s is above the longest period of the light, 0.2 s')
    assert [command.param3 for command in pair.commands(CONFIGURE)] == [0.0]


def test_a_limit_that_is_removed_ends_the_warning_and_changes_no_light() -> None:
    light, pair = limited(brightness=50.0)
    light.applies, light.fields['brightness'] = False, 80.0
    pair.run(10.0)
    assert pair.snapshot.limit_exceeded.excess

    changed_at = pair.now
    pair.controller.change_settings(LightSettings(), pair.now)
    pair.run(10.0)

    assert not pair.snapshot.limit_exceeded.excess
    assert pair.commands(CONFIGURE, since=changed_at) == []
    assert light.fields['brightness'] == 80.0
