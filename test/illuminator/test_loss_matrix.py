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

"""Thousands of commands over lines that lose, repeat, reorder, delay and corrupt frames."""

from __future__ import annotations

import itertools
import math
import random

from illuminator_ros.illuminator.light import Light
from illuminator_ros.illuminator.simulated_properties import IlluminatorProperties
from illuminator_ros.illuminator.thermal import ThermalProperties
from illuminator_ros.mavlink.messages import Address, MavCmd
import pytest
from support.back_to_back import Pair
from support.faulty_wire import Faults
from support.witness import CONFIGURE, Judge, ON_OFF, Request

KINDS = ('drop', 'duplicate', 'reorder', 'delay', 'corrupt')
COMMANDS = 400
# s; more than the longest delay of the line.
QUIET = 3.0
# Lights that stay as bright as they are told: what heat does is another test's subject.
LIGHTS = [IlluminatorProperties(address=Address(1, one), thermal=ThermalProperties(rise=0.0))
          for one in (243, 244)]

# Faults of the line by name, towards the lights and back.
LINES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    **{kind: ((kind,), (kind,)) for kind in KINDS},
    'all of these': (KINDS, KINDS),
    'drop, to the lights': (('drop',), ()),
    'delay, from the lights': ((), ('delay',)),
}


class User:
    """
    One user of one light: asks for something, waits for the answer, and asks again.

    :ivar due: when it does the next thing, or later if it is still waiting then.
    """

    def __init__(self, pair: Pair, light: Light, kind: MavCmd, draw: random.Random) -> None:
        self.pair, self.light, self.kind, self.draw = pair, light, kind, draw
        self.due = pair.now + draw.uniform(0, 1)
        self.requests: list[Request] = []
        self._waiting: list[Request] = []

    @property
    def idle(self) -> bool:
        """Whether all its requests are answered."""
        return all(request.answer.results for request in self._waiting)

    def act(self) -> None:
        """Ask, several things at once now and then."""
        self._waiting = [self._ask() for _ in range(self.draw.choice((1, 1, 1, 2, 3)))]
        self.requests += self._waiting
        self.due = self.pair.now + self.draw.choice((0.001, 0.1, 0.3))

    def _ask(self) -> Request:
        if self.kind == ON_OFF:
            on = self.draw.random() < 0.5
            return Request(self.light, ON_OFF, {'enabled': on},
                           self.pair.ask_enable(on, self.light))
        values = {'brightness': float(self.draw.randrange(101)),
                  'strobe_period': self.draw.choice((0.0, 0.5, 1.0, 2.0)),
                  'strobe_duty_cycle': float(self.draw.randrange(101))}
        wish = {name: values[name] for name in self.draw.sample(sorted(values), 2)}
        return Request(self.light, CONFIGURE, wish, self.pair.ask_configure(self.light, **wish))


def play(line: str, share: float) -> tuple[Pair, list[Request], Judge]:
    """Use lights over a line until there are enough requests, all answered."""
    there, back = (Faults(**dict.fromkeys(kinds, share)) for kinds in LINES[line])
    pair = Pair(LIGHTS, there=there, back=back, seed=f'{line} {share}')
    judge = Judge(pair)
    lights = pair.controller.lights
    pair.run_until(lambda: len(lights) == len(LIGHTS)
                   and all(light.snapshot(0.0).configuration for light in lights.values()))
    draw = random.Random(f'{line} {share}')
    users = [User(pair, light, ON_OFF, draw) for light in lights.values()]
    users += [User(pair, light, CONFIGURE, draw) for light in lights.values()]
    while sum(len(user.requests) for user in users) < COMMANDS:
        for user in users:
            if user.due <= pair.now and user.idle:
                user.act()
        pair.step(min((user.due for user in users if user.idle), default=math.inf))
    requests = [request for user in users for request in user.requests]
    pair.run_until(lambda: all(request.answer.results for request in requests))
    return pair, requests, judge


@pytest.mark.parametrize(('line', 'share'), [
    ('drop', 0.0), *itertools.product(LINES, (0.1, 0.3, 0.5))])
def test_every_command_has_one_outcome_and_it_is_true(line: str, share: float) -> None:
    pair, requests, judge = play(line, share)
    judgements = [judge.judge(one) for one in requests]
    untrue = [wrong for _, wrong in judgements if wrong]
    ends = [kind for kind, _ in judgements if kind != 'overtaken']
    print(f'{line} {share:.0%}: {ends.count("confirmed") / len(ends):.1%} confirmed')
    assert not untrue
    assert share or all(kind in ('confirmed', 'overtaken') for kind, _ in judgements)
    pair.mend()
    pair.run(QUIET)
    for simulated in pair.devices:
        light = pair.controller.lights[simulated.address]
        assert light.snapshot(pair.now).configuration == simulated.device.configuration
        assert light.status is not None
        assert light.status.enabled == simulated.device.enabled
        assert 'restarted' not in pair.recorders[simulated.address].events
        assert not light.snapshot(pair.now).shared_address


def test_the_same_seed_gives_the_same_answers() -> None:
    first, second = ([one.message for one in play('all of these', 0.3)[1]] for _ in range(2))
    assert first == second
