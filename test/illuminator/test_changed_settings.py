# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Settings that change while a light is served act at once."""

from dataclasses import replace
from typing import Any

from illuminator_ros.illuminator.events import SetpointFailed
from illuminator_ros.illuminator.model import SafetyLimits
from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.payload.command_sources import SourceSettings
import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight
from support.records import Answer

ON_OFF, CONFIGURE = mavlink.MAV_CMD_ILLUMINATOR_ON_OFF, mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE
LOWER = SafetyLimits(max_brightness=50.0)


def served(settings: LightSettings | None = None, **fields: Any) -> tuple[FakeLight, Pair]:
    how: dict[str, Any] = {'brightness': 80.0, **fields}
    light = FakeLight(**how)
    return light, Pair(light, settings=settings).settle()


def change(pair: Pair, **settings: Any) -> float:
    """Change some settings of a light; return the time of the change."""
    before = pair.controller.settings
    pair.controller.change_settings(replace(before, **settings), pair.now)
    pair.turn()
    return pair.now


def request(pair: Pair, source: str, on: bool) -> None:
    pair.light.enable(on, pair.now, Answer(pair.now), source=source, is_stream=True)
    pair.turn()


@pytest.mark.parametrize('on', [0, 1])
def test_a_light_that_exceeds_a_lower_limit_is_brought_within_it_before_its_next_status(
        on: int) -> None:
    light, pair = served(enable=on)

    changed_at = change(pair, limits=LOWER)

    assert [at for at, message in pair.near.sent
            if getattr(message, 'command', 0) == CONFIGURE] == [changed_at]
    pair.run(1.0)
    assert (light.fields['brightness'], light.fields['enable']) == (50.0, on)
    assert pair.snapshot.configuration and pair.snapshot.configuration.brightness == 50.0
    assert not pair.snapshot.limit_exceeded.excess

    change(pair, limits=SafetyLimits(max_brightness=30.0))
    pair.run(1.0)
    assert light.fields['brightness'] == 30.0


def test_a_limit_that_is_removed_before_the_light_has_answered_is_not_sent_again() -> None:
    light, pair = served()
    light.results[CONFIGURE] = None
    change(pair, limits=LOWER)
    pair.run(1.2)

    changed_at = change(pair, limits=SafetyLimits())
    light.results.clear()
    pair.run(10.0)

    assert pair.commands(CONFIGURE, since=changed_at) == []
    assert light.fields['brightness'] == 80.0


def test_a_limit_that_is_removed_ends_the_warning_and_changes_no_light() -> None:
    light, pair = served(LightSettings(limits=LOWER))
    light.applies, light.fields['brightness'] = False, 80.0
    pair.run(10.0)
    assert pair.snapshot.limit_exceeded.excess

    changed_at = change(pair, limits=SafetyLimits())
    pair.run(10.0)

    assert not pair.snapshot.limit_exceeded.excess
    assert pair.commands(CONFIGURE, since=changed_at) == []
    assert light.fields['brightness'] == 80.0


def test_a_request_beyond_a_limit_that_is_set_meanwhile_fails_and_is_not_resent() -> None:
    light, pair = served()
    light.results[CONFIGURE] = None
    answer = pair.ask_configure(brightness=90.0)
    pair.run(0.2)

    changed_at = change(pair, limits=LOWER)

    assert answer.result is not None
    assert not answer.result.success
    assert answer.result.message == 'brightness 90 % is above max_brightness 50 %'
    light.results.clear()
    pair.run(5.0)
    assert {one.param2 for one in pair.commands(CONFIGURE, since=changed_at)} == {50.0}
    assert light.fields['brightness'] == 50.0


def test_a_setpoint_beyond_a_limit_that_is_set_meanwhile_is_sent_as_the_limit() -> None:
    light, pair = served(brightness=20.0)
    light.results[CONFIGURE] = None
    pair.light.set_brightness(90.0, pair.now)
    pair.turn()
    pair.run(0.2)

    changed_at = change(pair, limits=LOWER)
    light.results.clear()
    pair.run(5.0)

    assert light.fields['brightness'] == 50.0
    assert {one.param2 for one in pair.commands(CONFIGURE, since=changed_at)} == {50.0}
    assert not [one for one in pair.recorder.others if isinstance(one, SetpointFailed)]


def test_off_after_silence_that_is_set_later_counts_from_then_on() -> None:
    light, pair = served()
    pair.enable(True)
    pair.run(60.0)

    changed_at = change(pair, off_after_silence=5.0)
    pair.run(4.5)
    assert light.fields['enable'] == 1
    pair.run(1.0)

    assert light.fields['enable'] == 0
    assert len(pair.commands(ON_OFF, since=changed_at)) == 1
    pair.enable(True)
    change(pair, off_after_silence=0.0)
    pair.run(60.0)
    assert light.fields['enable'] == 1


def test_nothing_that_was_requested_before_a_silence_follows_its_change() -> None:
    sources = SourceSettings(('safety', 'operator', 'default'))
    light, pair = served(LightSettings(sources=sources, off_after_silence=5.0))
    request(pair, 'operator', True)
    request(pair, 'safety', False)
    # The silence ends before the next status.
    pair.run(5.1)

    change(pair, off_after_silence=60.0)
    pair.light.release('safety', pair.now)
    pair.run(5.0)

    assert light.fields['enable'] == 0


def test_a_source_that_is_silent_for_longer_than_a_shorter_timeout_loses_the_light_at_once(
) -> None:
    _, pair = served(LightSettings(sources=SourceSettings(('safety', 'default'))))
    request(pair, 'safety', False)
    pair.run(10.0)
    assert pair.snapshot.holder == 'safety'

    change(pair, sources=SourceSettings(('safety', 'default'), 5.0))

    assert pair.snapshot.holder == ''
