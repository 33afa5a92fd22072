# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""A message of a topic that repeats the one before sends nothing while the light shows it."""

from __future__ import annotations

from collections.abc import Callable

from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.payload.command_sources import SourceSettings
import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight
from support.records import Answer

ON_OFF, CONFIGURE = mavlink.MAV_CMD_ILLUMINATOR_ON_OFF, mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE


def enable(on: bool) -> Callable[[Pair], None]:
    return lambda pair: pair.light.enable(on, pair.now, Answer(pair.now), is_call=False)


def dim(pair: Pair) -> None:
    pair.light.set_brightness(30.0, pair.now)


def hold(pair: Pair, ask: Callable[[Pair], None], seconds: float = 4.0) -> int:
    """Repeat a message at 50 Hz; return how many commands are sent meanwhile."""
    before = len(pair.commands(ON_OFF, CONFIGURE))
    for _ in range(round(seconds * 50)):
        ask(pair)
        pair.turn()
        pair.run(0.02)
    return len(pair.commands(ON_OFF, CONFIGURE)) - before


@pytest.fixture
def held(fake: FakeLight) -> Pair:
    """Return a client and a light that is on at 30 %, as a topic has asked for repeatedly."""
    pair = Pair(fake, settings=LightSettings(off_after_silence=9.0)).settle()
    assert hold(pair, enable(True), 1.0) == 1
    assert hold(pair, dim, 1.0) == 1
    return pair


@pytest.mark.parametrize(('ask', 'fewest', 'most'), [
    (enable(True), 0, 0), (dim, 0, 0), (enable(False), 4, 5)], ids=['on', 'brightness', 'off'])
def test_a_message_that_is_repeated_while_the_light_shows_it_sends_nothing_but_an_off_each_second(
    held: Pair, ask: Callable[[Pair], None], fewest: int, most: int,
) -> None:
    assert fewest <= hold(held, ask) <= most


def test_a_repeated_message_counts_for_the_silence(held: Pair, fake: FakeLight) -> None:
    hold(held, enable(True), 12.0)
    assert fake.fields['enable'] == 1
    held.run(10.0)
    assert fake.fields['enable'] == 0


def test_a_repeated_message_that_the_light_does_not_show_is_sent_each_second(
    held: Pair, fake: FakeLight,
) -> None:
    fake.results[ON_OFF] = mavlink.MAV_RESULT_DENIED
    fake.fields['enable'] = 0
    held.run(1.0)

    assert 4 <= hold(held, enable(True)) <= 5


def test_a_message_is_sent_again_after_another_sender_has_undone_it(
    held: Pair, fake: FakeLight,
) -> None:
    fake.fields['enable'] = 0
    held.run(1.0)

    assert hold(held, enable(True)) == 1
    assert fake.fields['enable'] == 1


def _other_value(pair: Pair, fake: FakeLight) -> None:
    pair.light.enable(False, pair.now, Answer(pair.now))
    pair.turn()


def _loss(pair: Pair, fake: FakeLight) -> None:
    fake.silent = True
    pair.run_until(lambda: not pair.light.connected)
    fake.silent = False
    pair.run(2.0)


def _restart(pair: Pair, fake: FakeLight) -> None:
    fake.restart(pair.now, enable=1, brightness=30.0)
    pair.run(2.0)


@pytest.mark.parametrize('happens', [_other_value, _loss, _restart])
def test_the_first_message_after_another_value_a_loss_or_a_restart_is_sent(
    held: Pair, fake: FakeLight, happens: Callable[[Pair, FakeLight], None],
) -> None:
    hold(held, enable(True), 1.0)
    happens(held, fake)

    assert hold(held, enable(True), 0.5) >= 1


def test_the_first_message_after_the_end_of_a_hold_is_sent(fake: FakeLight) -> None:
    pair = Pair(fake, settings=LightSettings(
        sources=SourceSettings(('default',), 60.0))).settle()
    hold(pair, enable(True), 1.0)
    pair.light.release('default', pair.now)

    assert hold(pair, enable(True), 0.5) == 1
