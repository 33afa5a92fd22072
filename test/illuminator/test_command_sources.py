# Copyright 2026 The illuminator_ros developers
# SPDX-License-Identifier: Apache-2.0

"""Sources share a light: the highest that claims it holds it, and only its requests are sent."""

from __future__ import annotations

import random

from illuminator_ros.illuminator.model import SafetyLimits
from illuminator_ros.illuminator.settings import LightSettings
from illuminator_ros.mavlink.dialect import mavlink
from illuminator_ros.payload.command_sources import SourceSettings
import pytest
from support.back_to_back import Pair
from support.fake_light import FakeLight
from support.records import Answer
from support.wire import Faults

ON_OFF, CONFIGURE = mavlink.MAV_CMD_ILLUMINATOR_ON_OFF, mavlink.MAV_CMD_DO_ILLUMINATOR_CONFIGURE
NAMES = ('safety', 'operator', 'default', 'autonomy')
TIMEOUT, SILENCE = 2.3, 6.0


class Shared:
    """A light that sources share, and their requests."""

    def __init__(self, *, seed: int, **faults: float) -> None:
        self.light = FakeLight(brightness=50.0)
        self.pair = Pair(self.light, seed=seed, there=Faults(**faults), settings=LightSettings(
            sources=SourceSettings(NAMES, TIMEOUT),
            limits=SafetyLimits(max_brightness=80.0), off_after_silence=SILENCE))
        self.pair.run_until(lambda: self.pair.controller.lights)

    def enable(self, source: str, on: bool) -> None:
        self.pair.light.enable(
            on, self.pair.now, Answer(self.pair.now), source=source, is_call=False)
        self.pair.turn()

    def dim(self, source: str, brightness: float) -> None:
        self.pair.light.set_brightness(brightness, self.pair.now, source=source)
        self.pair.turn()

    def release(self, source: str) -> None:
        self.pair.light.release(source, self.pair.now)
        self.pair.turn()

    @property
    def holder(self) -> str | None:
        return self.pair.snapshot.holder


class Model:
    """An independent, simple implementation of the rules."""

    def __init__(self) -> None:
        self.heard: dict[str, float] = {}

    def expire(self, now: float) -> None:
        self.heard = {name: at for name, at in self.heard.items() if now < at + TIMEOUT}

    @property
    def holder(self) -> str:
        return min(self.heard, key=NAMES.index, default='')


@pytest.mark.parametrize('seed', range(20))
def test_the_highest_source_wins_within_one_turn_and_only_its_requests_are_sent(seed: int) -> None:
    draw = random.Random(seed)
    shared = Shared(seed=seed, drop=draw.choice((0.0, 0.3)), duplicate=draw.choice((0.0, 0.2)),
                    delay=draw.choice((0.0, 0.3)), reorder=0.1)
    pair, model = shared.pair, Model()
    pair.run_until(lambda: pair.snapshot.configuration)
    # Each source has brightnesses of its own, which identify its frames.
    of_source = {name: 10.0 * (index + 1) for index, name in enumerate(NAMES)}
    desired: dict[str, list[bool]] = {name: [] for name in NAMES}
    alive = dict.fromkeys(NAMES, True)
    allowed, checked, last_heard = '', len(pair.near.sent), pair.now

    for _ in range(120):
        source = draw.choice(NAMES)
        act = draw.choices(('enable', 'dim', 'release', 'die', 'revive', 'wait'),
                           (6, 6, 2, 1, 1, 4))[0]
        if act in ('die', 'revive'):
            alive[source] = act == 'revive'
        elif alive[source] and act != 'wait':
            model.expire(pair.now)
            if act == 'release':
                model.heard.pop(source, None)
            else:
                last_heard = model.heard[source] = pair.now
            if act == 'enable':
                desired[source].append(on := draw.random() < 0.5)
                shared.enable(source, on)
            elif act == 'dim':
                shared.dim(source, of_source[source] + draw.randrange(9))
            else:
                shared.release(source)
        until = pair.now + draw.choice((0.0, 0.05, 1.0, 3.0)) * draw.random()
        while True:
            model.expire(pair.now)
            assert shared.holder == model.holder
            # A light that no source holds keeps the state requested by the last one.
            allowed = model.holder or allowed
            for at, message in pair.near.sent[checked:]:
                command = getattr(message, 'command', None)
                if command == CONFIGURE:
                    assert message.param2 // 10 == of_source[allowed] // 10, (at, allowed)
                elif command == ON_OFF:
                    silent = at >= last_heard + SILENCE and not message.param1
                    assert silent or bool(message.param1) in desired[allowed], (at, allowed)
            checked = len(pair.near.sent)
            if not pair.step(until):
                break

    pair.mend()
    pair.run(SILENCE + 5.0)
    assert shared.light.fields['enable'] == 0
